//! `gaitwright serve` as a process: the sign-in link, HTTPS from files, shutdown.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_service::access::Role;
use gaitwright_service::access::user_administration::{self, NewUser};
use gaitwright_store::audit::Actor;
use gaitwright_store::{Store, commit};
use gaitwright_tests::cli::run;
use gaitwright_tests::client::{get, post, send};
use gaitwright_tests::serve_process::Process;
use serde_json::json;
use skipped_tests::skipped;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant, SystemTime};

const BINARY: &str = env!("CARGO_BIN_EXE_gaitwright-cli");

#[test]
fn first_start_prints_a_sign_in_link_that_works_once() {
    let folder = tempfile::tempdir().unwrap();
    let process = Process::start(BINARY, folder.path(), &[], "sign in");
    let line = process.said.last().unwrap();
    let path = line.split(process.address()).nth(1).unwrap().to_owned();
    assert_eq!(get(process.address(), "/api/v1/studies").unwrap().status, 401);
    assert_eq!(get(process.address(), "/health").unwrap().status, 200);
    let first = send(process.address(), "POST", &path, "").unwrap();
    assert_eq!(first.status, 303);
    assert!(first.head.to_lowercase().contains("set-cookie: gaitwright_session="), "{}", first.head);
    let second = send(process.address(), "POST", &path, "").unwrap();
    assert!(!second.head.to_lowercase().contains("set-cookie"), "{}", second.head);
}

#[test]
fn one_time_links_do_not_appear_in_trace_logs() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("gaitwright.toml"), "log = \"trace\"\n").unwrap();
    let process = Process::start(BINARY, folder.path(), &[], "sign in");
    let path = process.said.last().unwrap().split(process.address()).nth(1).unwrap().to_owned();
    let secret = path.rsplit('/').next().unwrap().to_owned();
    assert_eq!(get(process.address(), &path).unwrap().status, 200);
    let first = send(process.address(), "POST", &path, "").unwrap();
    let session = first.head.split("gaitwright_session=").nth(1).unwrap().split(';').next().unwrap().to_owned();
    let said = process.end();
    assert!(said.iter().any(|line| line.contains("/sign-in/{link}")), "{said:?}");
    for secret in [secret, session] {
        assert!(secret.len() == 64 && !said.iter().any(|line| line.contains(&secret)), "{said:?}");
    }
}

#[test]
fn connections_without_a_complete_request_are_closed() {
    let folder = tempfile::tempdir().unwrap();
    let process = Process::start(BINARY, folder.path(), &["--no-sign-in"], "listening on ");
    let silent = |said: &'static str| {
        let mut stream = TcpStream::connect(process.address()).unwrap();
        std::thread::spawn(move || {
            stream.write_all(said.as_bytes()).unwrap();
            stream.set_read_timeout(Some(Duration::from_mins(1))).unwrap();
            // Cut off, with or without a word: not the end of our patience.
            stream.read_to_end(&mut Vec::new()).map_or_else(|e| e.kind() == ErrorKind::ConnectionReset, |_| true)
        })
    };
    let cut_off = [silent(""), silent("GET / HTTP/1.1\r\nhost: localhost\r\n")].map(|one| one.join().unwrap());
    assert_eq!(cut_off, [true, true]);
    assert_eq!(get(process.address(), "/health").unwrap().status, 200);
}

#[cfg(unix)]
#[test]
fn notify_program_runs_with_the_study_and_its_state() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("notify");
    std::fs::write(&program, "#!/bin/sh\necho \"$1 $2 $GAITWRIGHT_LOG_FORMAT.\" >> notices\n").unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = Command::new(BINARY);
    command.args(["serve", "--listen", "127.0.0.1:0", "--no-sign-in", "--notify-program", "notify"]);
    command.env("GAITWRIGHT_LOG_FORMAT", "text").current_dir(folder.path());
    let process = Process::watch(command, "listening on ");
    let subjects = get(process.address(), "/api/v1/subjects").unwrap().items();
    let body = json!({ "subject_id": subjects[0]["id"], "start": false });
    let study = post(process.address(), "/api/v1/studies", &body).unwrap().json();
    let study = study["id"].as_str().unwrap();
    let stopped = send(process.address(), "POST", &format!("/api/v1/studies/{study}/stop"), "").unwrap();
    assert_eq!(stopped.status, 200, "{}", stopped.body);
    let notices = || std::fs::read_to_string(folder.path().join("notices")).unwrap_or_default();
    assert!((0..600).any(|_| {
        std::thread::sleep(Duration::from_millis(50));
        !notices().is_empty()
    }));
    std::thread::sleep(Duration::from_secs(2));
    assert_eq!(notices(), format!("{study} stopped .\n"));

    let missing = run(BINARY, folder.path(), &["serve", "--no-sign-in", "--notify-program", "missing"]);
    assert_eq!(missing.status.code(), Some(2));
    let text = String::from_utf8_lossy(&missing.stderr);
    assert!(
        text.contains("notify_program (flag) is \"missing\"; it must be the path of an existing program"),
        "{text}"
    );
}

#[test]
fn system_page_lists_scheduled_backups() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("copies")).unwrap();
    let process =
        Process::start(BINARY, folder.path(), &["--no-sign-in", "--backup-folder", "copies"], "listening on ");
    let listed = || get(process.address(), "/system").unwrap().body.contains(".scheduled-");
    assert!((0..200).any(|_| {
        std::thread::sleep(Duration::from_millis(50));
        listed()
    }));
}

#[test]
fn failing_scheduled_backups_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    let copies = folder.path().join("copies");
    // Removes the folder of backups from a running service before its next backup is due, after so many seconds.
    let without_folder = |seconds: u64| {
        std::fs::create_dir(&copies).unwrap();
        let made = SystemTime::now() - Duration::from_hours(24) + Duration::from_secs(seconds);
        std::fs::File::create(copies.join("gaitwright.db.scheduled-1")).unwrap().set_modified(made).unwrap();
        let begun = Instant::now();
        let process =
            Process::start(BINARY, folder.path(), &["--no-sign-in", "--backup-folder", "copies"], "listening on ");
        std::fs::remove_dir_all(&copies).unwrap();
        (begun.elapsed().as_secs() < seconds).then_some(process)
    };
    let process = [3, 9, 27, 81].into_iter().find_map(without_folder).unwrap();
    let read = |path: &str| get(process.address(), path).unwrap();
    let wait = || std::thread::sleep(Duration::from_millis(100));
    assert!((0..900).inspect(|_| wait()).any(|_| read("/ready").body.contains("The last scheduled backup failed")));
    assert_eq!(read("/ready").status, 200);
    assert!(read("/metrics").body.contains("gaitwright_scheduled_backup_failed 1"));
    let page = read("/system").body;
    assert!(page.contains("The last attempt failed, and none has succeeded since"), "{page}");
}

#[test]
fn log_format_json_writes_json_lines() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("gaitwright.toml"), "log_format = \"json\"\n").unwrap();
    let process = Process::start(BINARY, folder.path(), &["--no-sign-in"], "listening on ");
    let line: serde_json::Value = serde_json::from_str(process.said.last().unwrap()).unwrap();
    assert_eq!((&line["level"], &line["fields"]["workers"]), (&"INFO".into(), &1.into()), "{line}");
    assert!(line["timestamp"].is_string() && line["target"].as_str().unwrap().starts_with("gaitwright"), "{line}");
}

#[cfg(unix)]
#[test]
fn term_signal_shuts_the_service_down_cleanly() {
    let folder = tempfile::tempdir().unwrap();
    let mut process = Process::start(BINARY, folder.path(), &["--no-sign-in"], "listening on ");
    assert_eq!(get(process.address(), "/api/v1/studies").unwrap().status, 200);
    let killed = Command::new("kill").args(["-TERM", &process.child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    assert!(process.child.wait().unwrap().success());
    let log = folder.path().join("gaitwright.db-wal");
    assert!(!log.exists(), "the write-ahead log is merged into the file");
}

#[test]
fn https_is_served_with_a_certificate_from_files() {
    let folder = tempfile::tempdir().unwrap();
    let made = Command::new("openssl")
        .args(["req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2"])
        .args(["-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", "k.pem", "-out", "c.pem"])
        .current_dir(folder.path())
        .output();
    let curl = Command::new("curl").arg("--version").output();
    let (Ok(made), Ok(_)) = (made, curl) else {
        skipped("openssl and curl are needed");
        return;
    };
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let tls = ["--no-sign-in", "--tls-certificate", "c.pem", "--tls-key", "k.pem"];
    let process = Process::start(BINARY, folder.path(), &tls, "listening on ");
    assert!(process.origin.starts_with("https://"), "{}", process.origin);
    let answer = Command::new("curl")
        .args(["--silent", "--show-error", "--include", "--cacert", "c.pem", &format!("{}/health", process.origin)])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&answer.stdout).to_lowercase();
    assert!(text.contains("\"status\":\"healthy\""), "{text} {}", String::from_utf8_lossy(&answer.stderr));
    assert!(text.contains("strict-transport-security"), "{text}");
    assert!(get(process.address(), "/health").is_err(), "plain HTTP is not answered");
}

#[cfg(target_os = "linux")]
#[test]
fn silent_connections_above_the_descriptor_limit_leave_health_answering() {
    let folder = tempfile::tempdir().unwrap();
    let service = format!(
        "ulimit -n 1024; exec {} serve --no-sign-in --workers 1 --listen 127.0.0.1:0",
        env!("CARGO_BIN_EXE_gaitwright-cli")
    );
    // Of one address, and with so high a limit for one that the total bites.
    for limit in ["100", "60000"] {
        let mut command = Command::new("bash");
        command.args(["-c", &service]).env("GAITWRIGHT_CONNECTIONS_PER_ADDRESS", limit).current_dir(folder.path());
        let process = Process::watch(command, "listening on ");
        let silent: Vec<TcpStream> = (0..1500).filter_map(|_| TcpStream::connect(process.address()).ok()).collect();
        assert_eq!(silent.len(), 1500);
        std::thread::sleep(Duration::from_millis(400));
        for call in 0..8 {
            let begun = std::time::Instant::now();
            let answer = get(process.address(), "/health").unwrap();
            assert_eq!(answer.status, 200, "call {call}");
            assert!(begun.elapsed() < Duration::from_secs(2), "call {call} took {:?}", begun.elapsed());
        }
        let open = std::fs::read_dir(format!("/proc/{}/fd", process.child.id())).unwrap().count();
        assert!(open < if limit == "100" { 200 } else { 1000 }, "{open} descriptors");
        drop(silent);
        let said = process.end().join("\n");
        assert!(said.contains("too many connections"), "{said}");
        assert!(!said.contains('\u{1b}'), "colour codes in a file: {said}");
    }
}

/// Peak memory of a process, MiB.
#[cfg(target_os = "linux")]
fn peak_memory_mib(process: &Process) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", process.child.id())).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() / 1024
}

#[cfg(target_os = "linux")]
#[test]
fn bodies_sent_in_single_bytes_use_little_memory() {
    const CONNECTIONS: usize = 8;
    const BYTES: usize = 8000;
    let folder = tempfile::tempdir().unwrap();
    let process = Process::start(BINARY, folder.path(), &["--no-sign-in"], "listening on ");
    assert_eq!(get(process.address(), "/health").unwrap().status, 200);
    let before = peak_memory_mib(&process);
    let head = "POST /sign-in HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/x-www-form-urlencoded\r\n\
                content-length: 60000\r\n\r\n";
    let drip = |_| {
        let mut stream = TcpStream::connect(process.address()).unwrap();
        stream.set_nodelay(true).unwrap();
        std::thread::spawn(move || {
            stream.write_all(head.as_bytes()).unwrap();
            for _ in 0..BYTES {
                stream.write_all(b"a").unwrap();
                std::thread::sleep(Duration::from_micros(200));
            }
            stream
        })
    };
    let dripping: Vec<_> = (0..CONNECTIONS).map(drip).collect();
    let open: Vec<TcpStream> = dripping.into_iter().map(|one| one.join().unwrap()).collect();
    let used = peak_memory_mib(&process) - before;
    assert!(used < 16, "{used} MiB for {} bytes on {} connections", open.len() * BYTES, open.len());
}

/// Sends a byte of a header every 50 ms from an address, on one connection after another.
#[cfg(target_os = "linux")]
async fn drip(from: std::net::SocketAddr, to: std::net::SocketAddr) {
    use tokio::io::AsyncWriteExt;
    loop {
        let socket = tokio::net::TcpSocket::new_v4().unwrap();
        socket.bind(from).unwrap();
        if let Ok(mut stream) = socket.connect(to).await {
            let mut sent = stream.write_all(b"GET / HTTP/1.1\r\nA: ").await;
            while sent.is_ok() {
                tokio::time::sleep(Duration::from_millis(50)).await;
                sent = stream.write_all(b"a").await;
            }
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// Each of these addresses has 20 busy clients, and the service accepts 90 connections. `/health` still responds within
/// two seconds.
#[cfg(target_os = "linux")]
async fn busy_connections_leave_health_answering(addresses: std::ops::RangeInclusive<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_gaitwright-cli"));
    command.args(["serve", "--no-sign-in", "--workers", "1", "--listen", "127.0.0.1:0"]).current_dir(folder.path());
    command.env("GAITWRIGHT_CONNECTIONS", "90").env("GAITWRIGHT_CONNECTIONS_PER_ADDRESS", "10");
    let process = Process::watch(command, "listening on ");
    let to = process.address().parse().unwrap();
    let mut busy = tokio::task::JoinSet::new();
    for address in addresses {
        for _ in 0..20 {
            busy.spawn(drip(([127, 0, 0, address], 0).into(), to));
        }
    }
    tokio::time::sleep(Duration::from_secs(1)).await;
    // The other threads of the runtime continue to send single bytes.
    for call in 0..8 {
        let begun = std::time::Instant::now();
        assert_eq!(get(process.address(), "/health").unwrap().status, 200, "call {call}");
        assert!(begun.elapsed() < Duration::from_secs(2), "call {call} took {:?}", begun.elapsed());
    }
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn busy_connections_of_nine_addresses_leave_capacity_for_another_address() {
    busy_connections_leave_health_answering(2..=10).await;
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn refused_connections_do_not_delay_those_of_another_address() {
    // All are below the limit of one address.
    busy_connections_leave_health_answering(2..=19).await;
}

/// Makes a record whose administrators are all disabled.
async fn disable_every_administrator(folder: &Path) {
    let store = Store::open(&folder.join("gaitwright.db")).await.unwrap();
    let mut writer = store.write().await.unwrap();
    let new = NewUser { name: "admin".to_owned(), role: Role::Administrator };
    user_administration::add(&mut writer, &Actor::program(), &new).await.unwrap();
    sqlx::query("update users set disabled_at = created_at").execute(&mut **writer).await.unwrap();
    commit(writer).await.unwrap();
    store.close().await;
}

#[tokio::test]
async fn service_prints_a_sign_in_link_if_all_administrators_are_disabled() {
    for arguments in [&[][..], &["--sign-in-link"]] {
        let folder = tempfile::tempdir().unwrap();
        disable_every_administrator(folder.path()).await;
        let process = Process::start(BINARY, folder.path(), arguments, "sign in");
        let path = process.said.last().unwrap().split(process.address()).nth(1).unwrap().to_owned();
        let first = send(process.address(), "POST", &path, "").unwrap();
        assert!(first.head.to_lowercase().contains("set-cookie: gaitwright_session="), "{}", first.head);
    }
}

#[tokio::test]
async fn users_link_command_prints_a_working_sign_in_link() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| run(env!("CARGO_BIN_EXE_gaitwright-cli"), folder.path(), arguments);
    let nothing = run(&["users", "link", "Ada"]);
    assert!(!nothing.status.success() && !folder.path().join("gaitwright.db").exists());
    disable_every_administrator(folder.path()).await;
    let store = Store::open(&folder.path().join("gaitwright.db")).await.unwrap();
    let mut writer = store.write().await.unwrap();
    let new = NewUser { name: "Ada".to_owned(), role: Role::Administrator };
    user_administration::add(&mut writer, &Actor::program(), &new).await.unwrap();
    commit(writer).await.unwrap();
    store.close().await;
    drop(store);
    let listed = String::from_utf8(run(&["users", "list"]).stdout).unwrap();
    assert_eq!(listed, "admin\tadministrator\tone-time link\tdisabled\nAda\tadministrator\tone-time link\n");
    assert_eq!(run(&["users", "link", "Bob"]).status.code(), Some(2));
    assert_eq!(run(&["users", "link", "admin"]).status.code(), Some(2), "who is disabled gets none");
    let link = String::from_utf8(run(&["users", "link", "ada"]).stdout).unwrap();
    let process = Process::start(BINARY, folder.path(), &[], "sign in");
    let first = send(process.address(), "POST", link.trim(), "").unwrap();
    assert!(first.head.to_lowercase().contains("set-cookie: gaitwright_session="), "{}", first.head);
    for (arguments, instead) in
        [(&["users", "list"][..], "Users and tokens page"), (&["users", "link", "ada"], "--sign-in-link")]
    {
        let busy = run(arguments);
        let said = String::from_utf8_lossy(&busy.stderr).into_owned();
        assert!(busy.status.code() == Some(2) && said.contains(instead), "{said}");
    }
}
