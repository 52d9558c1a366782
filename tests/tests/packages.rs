//! The packages of `server/deploy/packages/build`, made of a small program in place of the compiled one.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use skipped_tests::skipped;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A program of this machine that exits with 0, whatever its arguments.
const PROGRAM: &str = "/bin/true";

const LICENCES: [&str; 2] = ["LICENSE-APACHE", "LICENSE-MIT"];

const EXAMPLES: [(&str, &str); 3] = [
    ("ask_tell.m", "server/clients/matlab/ask_tell.m"),
    ("example.py", "server/clients/python/example.py"),
    ("gait.ipynb", "server/clients/python/gait.ipynb"),
];

fn of_repository(path: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)).unwrap()
}

fn assert_examples(folder: &Path) {
    for (name, source) in EXAMPLES {
        assert_eq!(std::fs::read(folder.join(name)).unwrap(), of_repository(source), "{name}");
    }
}

fn run(command: &mut Command) -> Output {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// The packages in a folder, by file name. `None` without Python.
fn packages(folder: &Path) -> Option<BTreeMap<String, Vec<u8>>> {
    if Command::new("python3").arg("--version").output().is_err() {
        skipped("there is no python3");
        return None;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let build = root.join("server/deploy/packages/build");
    run(Command::new("python3").arg("-B").arg(build).args(["--program", PROGRAM, "--out"]).arg(folder));
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    Some(files.map(|file| (file.file_name().into_string().unwrap(), std::fs::read(file.path()).unwrap())).collect())
}

fn with_ending(folder: &Path, ending: &str) -> PathBuf {
    let mut files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files.find(|file| file.to_string_lossy().ends_with(ending)).unwrap()
}

#[test]
fn packages_of_the_same_program_are_equal_bit_by_bit() {
    let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (Some(first), Some(second)) = (packages(first.path()), packages(second.path())) else { return };
    let endings = [".tar.gz", ".whl", ".deb"];
    assert!(endings.iter().all(|ending| first.keys().any(|name| name.ends_with(ending))), "{:?}", first.keys());
    assert!(first == second);
}

#[test]
fn wheel_installs_the_program_and_the_client_without_a_network() {
    let folder = tempfile::tempdir().unwrap();
    if packages(folder.path()).is_none() {
        return;
    }
    let environment = folder.path().join("environment");
    if !Command::new("python3").args(["-m", "venv"]).arg(&environment).output().unwrap().status.success() {
        return skipped("python3 cannot make virtual environments");
    }
    let wheel = with_ending(folder.path(), ".whl");
    run(Command::new(environment.join("bin/pip")).args(["install", "--no-index"]).arg(wheel));
    run(Command::new(environment.join("bin/gaitwright")).arg("--version"));
    let import = "import gaitwright_client; print(gaitwright_client.__file__)";
    let output = run(Command::new(environment.join("bin/python")).args(["-c", import]));
    assert!(String::from_utf8_lossy(&output.stdout).starts_with(&*environment.to_string_lossy()), "{output:?}");
    assert_examples(&environment.join("share/gaitwright/examples"));
    let licences = "from importlib.metadata import files; print(*[f.locate() for f in files('gaitwright')], sep='\\n')";
    let output = run(Command::new(environment.join("bin/python")).args(["-c", licences]));
    let installed = String::from_utf8(output.stdout).unwrap();
    for licence in LICENCES {
        let file = installed.lines().find(|file| file.ends_with(licence)).expect("the text of the licence");
        assert_eq!(std::fs::read(file).unwrap(), of_repository(licence));
    }
}

#[test]
fn tarball_has_the_program_its_own_readme_the_licences_and_the_examples() {
    let folder = tempfile::tempdir().unwrap();
    if packages(folder.path()).is_none() {
        return;
    }
    run(Command::new("tar").arg("xzf").arg(with_ending(folder.path(), ".tar.gz")).arg("-C").arg(folder.path()));
    let content = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
    let unpacked = content.into_iter().find(|path| path.is_dir()).unwrap();
    run(&mut Command::new(unpacked.join("gaitwright")));
    assert_eq!(std::fs::read(unpacked.join("README.md")).unwrap(), of_repository("server/deploy/packages/README.md"));
    for licence in LICENCES {
        assert_eq!(std::fs::read(unpacked.join(licence)).unwrap(), of_repository(licence));
    }
    assert_examples(&unpacked.join("examples"));
}

#[test]
fn upgrade_of_the_debian_package_restarts_a_running_service() {
    let folder = tempfile::tempdir().unwrap();
    if packages(folder.path()).is_none() {
        return;
    }
    let control = folder.path().join("control");
    let Ok(output) = Command::new("dpkg-deb").arg("-e").arg(with_ending(folder.path(), ".deb")).arg(&control).output()
    else {
        return skipped("there is no dpkg-deb");
    };
    assert!(output.status.success(), "{output:?}");
    // A `systemctl` that only prints its arguments, on a machine that need not run systemd.
    let script = std::fs::read_to_string(control.join("postinst")).unwrap();
    assert!(script.contains("/run/systemd/system"), "{script}");
    let script = script.replace("/run/systemd/system", "/");
    let configure = |old_version: &[&str]| {
        let script = format!("systemctl() {{ echo \"$@\"; }}\n{script}");
        let output = run(Command::new("sh").args(["-c", &script, "postinst", "configure"]).args(old_version));
        String::from_utf8(output.stdout).unwrap()
    };
    assert_eq!(configure(&["0.0.1"]), "daemon-reload\ntry-restart gaitwright\n");
    // dpkg passes an empty version at the first installation.
    assert_eq!((configure(&[]), configure(&[""])), ("daemon-reload\n".to_owned(), "daemon-reload\n".to_owned()));
}

#[test]
fn debian_package_has_the_program_where_its_unit_starts_it() {
    let folder = tempfile::tempdir().unwrap();
    if packages(folder.path()).is_none() {
        return;
    }
    let root = folder.path().join("root");
    let Ok(output) = Command::new("dpkg-deb").arg("-x").arg(with_ending(folder.path(), ".deb")).arg(&root).output()
    else {
        return skipped("there is no dpkg-deb");
    };
    assert!(output.status.success(), "{output:?}");
    assert_eq!(std::fs::read(root.join("usr/bin/gaitwright")).unwrap(), std::fs::read(PROGRAM).unwrap());
    let unit = std::fs::read_to_string(root.join("usr/lib/systemd/system/gaitwright.service")).unwrap();
    assert!(unit.contains("\nExecStart=/usr/bin/gaitwright serve --config /etc/gaitwright.toml\n"), "{unit}");
    assert!(root.join("etc/gaitwright.toml").is_file());
    let documents = root.join("usr/share/doc/gaitwright");
    let copyright = std::fs::read_to_string(documents.join("copyright")).unwrap();
    for licence in LICENCES {
        assert!(copyright.contains(&*String::from_utf8(of_repository(licence)).unwrap()));
    }
    assert_examples(&documents.join("examples"));
}
