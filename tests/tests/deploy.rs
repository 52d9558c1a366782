//! The files of `server/deploy`, as far as they can be tested without a container engine and a running systemd.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_tests::{cli, client};
use skipped_tests::skipped;
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const BINARY: &str = env!("CARGO_BIN_EXE_gaitwright-cli");
const CONTAINER: &str = include_str!("../../server/deploy/Containerfile");
const UNIT: &str = include_str!("../../server/deploy/gaitwright.service");

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// The arguments of every line of the container file that begins with this word.
fn lines(word: &str) -> Vec<Vec<String>> {
    let split =
        |line: &str| line.split_whitespace().map(|part| part.trim_matches(['[', ']', '"', ',']).to_owned()).collect();
    CONTAINER.lines().filter_map(|line| line.strip_prefix(word)?.strip_prefix(' ')).map(split).collect()
}

/// The files that are copied into the build stage.
fn copied() -> BTreeSet<String> {
    let of_context = lines("COPY").into_iter().filter(|words| !words[0].starts_with("--from"));
    of_context.flat_map(|words| words[..words.len() - 1].to_vec()).collect()
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn container_file_copies_every_source_folder_and_only_existing_ones() {
    let root = root();
    let copied = copied();
    for path in &copied {
        assert!(root.join(path).exists(), "{path}");
    }
    let manifest: toml::Table = std::fs::read_to_string(root.join("Cargo.toml")).unwrap().parse().unwrap();
    let workspace = manifest["workspace"].as_table().unwrap();
    for member in workspace["members"].as_array().unwrap() {
        let folder = member.as_str().unwrap().split('/').next().unwrap();
        assert!(copied.contains(folder), "{member:?}");
    }
    assert!(copied.contains("Cargo.lock") && copied.contains("Cargo.toml"));
    let version = workspace["package"]["rust-version"].as_str().unwrap();
    assert!(lines("FROM")[0][0].contains(&format!("rust:{version}-")), "{:?}", lines("FROM"));

    // What the program embeds comes from these folders too.
    let mut files = Vec::new();
    for crate_folder in ["optimizer", "learner", "server"] {
        sources(&root.join(crate_folder), &mut files);
    }
    let mut embedded = 0;
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap();
        for macro_name in ["include_str!(\"", "include_bytes!(\""] {
            for rest in text.split(macro_name).skip(1) {
                let path = file.parent().unwrap().join(rest.split('"').next().unwrap()).canonicalize().unwrap();
                let top = path.strip_prefix(&root).unwrap().components().next().unwrap();
                assert!(
                    copied.contains(top.as_os_str().to_str().unwrap()),
                    "{} embeds {}",
                    file.display(),
                    path.display()
                );
                embedded += 1;
            }
        }
    }
    assert!(embedded >= 5, "{embedded}");
    // Crates reach the folders that they embed through symbolic links, so that they can be packaged.
    for (link, folder) in
        [("server/store/migrations", "migrations"), ("server/http/docs", "docs"), ("server/http/web", "web")]
    {
        assert_eq!(root.join(link).canonicalize().unwrap(), root.join(folder));
        assert!(copied.contains(folder), "{folder}");
    }
}

#[test]
fn container_runs_the_program_that_it_builds() {
    let build = lines("RUN").into_iter().find(|words| words[0] == "cargo").unwrap();
    assert_eq!(build, ["cargo", "build", "--release", "--locked", "--package", "gaitwright", "--features", "full"]);
    let built = lines("COPY").into_iter().find(|words| words[0] == "--from=build").unwrap();
    assert_eq!(built[1], "/source/target/release/gaitwright");
    assert_eq!(lines("ENTRYPOINT"), [["gaitwright"]]);

    // The image sets everything that the command needs.
    let words = |word: &str| lines(word).concat();
    assert_eq!(lines("WORKDIR").last().unwrap(), &["/data"]);
    assert_eq!((words("VOLUME"), words("EXPOSE")), (vec!["/data".to_owned()], vec!["8080".to_owned()]));
    assert!(words("ENV").contains(&"GAITWRIGHT_DATABASE=/data/gaitwright.db".to_owned()));
    assert!(words("RUN").contains(&"/data".to_owned()) && words("USER") == ["gaitwright"]);
}

#[test]
fn default_container_command_starts_on_an_empty_volume_and_prints_a_sign_in_link() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = lines("CMD").remove(0);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    if std::net::TcpListener::bind("0.0.0.0:8080").is_err() {
        skipped("another program listens on port 8080 of this machine");
        return;
    }
    for start in 0..2 {
        let mut command = cli::command(BINARY, folder.path(), &arguments);
        command.env("GAITWRIGHT_DATABASE", folder.path().join("gaitwright.db"));
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let line = lines.find(|line| line.as_ref().is_ok_and(|line| line.contains("http://localhost:8080/sign-in/")));
        let line = line.unwrap_or_else(|| panic!("start {start} ended without a link")).unwrap();
        std::thread::spawn(move || lines.for_each(drop));
        let path = line.split("localhost:8080").nth(1).unwrap().trim().to_owned();
        let answer = client::send("localhost:8080", "POST", &path, "").unwrap();
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(answer.status == 303 && answer.head.contains("gaitwright_session="), "{}", answer.head);
    }
    assert!(folder.path().join("gaitwright.db").exists());
}

#[test]
fn unit_starts_the_program_with_known_settings() {
    let setting = |name: &str| UNIT.lines().find_map(|line| line.strip_prefix(name)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("gaitwright.toml"), "").unwrap();
    let start: Vec<&str> = setting("ExecStart=").split_whitespace().collect();
    assert_eq!(start, ["/usr/local/bin/gaitwright", "serve", "--config", "/etc/gaitwright.toml"]);
    let mut command = cli::command(BINARY, folder.path(), &["config", "show", "--config", "gaitwright.toml"]);
    for (name, value) in setting("Environment=").split_whitespace().map(|pair| pair.split_once('=').unwrap()) {
        command.env(name, value);
    }
    let output = command.output().unwrap();
    let (shown, said) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && said.is_empty(), "{said}");
    let database = "database = \"/var/lib/gaitwright/gaitwright.db\"  # environment GAITWRIGHT_DATABASE";
    assert!(shown.contains(database) && shown.contains("log_format = \"json\""), "{shown}");
    let descriptors: u64 = setting("LimitNOFILE=").parse().unwrap();
    assert!(descriptors >= 8192, "connections, the record and its copies");
    let stop: u64 = setting("TimeoutStopSec=").parse().unwrap();
    assert!(stop >= 30, "the service drains for up to 20 s");
}

#[test]
fn systemd_accepts_the_unit() {
    let folder = tempfile::tempdir().unwrap();
    let unit = folder.path().join("gaitwright.service");
    std::fs::write(&unit, UNIT.replace("/usr/local/bin/gaitwright", BINARY)).unwrap();
    let Ok(output) = Command::new("systemd-analyze").args(["verify", "--man=no"]).arg(&unit).output() else {
        skipped("there is no systemd-analyze on this machine");
        return;
    };
    // Complaints about other units of the machine are ignored.
    let ours = |output: &Output| {
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        text.lines().filter(|line| line.contains("gaitwright.service")).map(str::to_owned).collect::<Vec<_>>()
    };
    assert!(ours(&output).is_empty(), "{:?}", ours(&output));
    // Checks that the tool reports errors on this machine, because a tool that cannot start would also report none.
    std::fs::write(&unit, UNIT.replace("/usr/local/bin/gaitwright", "bin/gaitwright")).unwrap();
    let faulty = Command::new("systemd-analyze").args(["verify", "--man=no"]).arg(&unit).output().unwrap();
    assert!(!ours(&faulty).is_empty(), "{}", String::from_utf8_lossy(&faulty.stderr));
}
