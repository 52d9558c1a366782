//! A NATS broker as a process, with its own folder.

use skipped_tests::skipped_unless_required;
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;

/// A running broker; killed when dropped.
pub struct Broker {
    folder: TempDir,
    port: u16,
    process: Child,
    arguments: &'static [&'static str],
}

impl Broker {
    /// Starts one. `None`, with the reason on stderr: if this machine has no nats-server and none is required.
    pub fn start() -> Option<Self> {
        Self::start_with(&[])
    }

    /// The same with further arguments of nats-server.
    pub fn start_with(arguments: &'static [&'static str]) -> Option<Self> {
        if Command::new("nats-server").arg("--version").output().is_err() {
            skipped_unless_required("GAITWRIGHT_REQUIRE_NATS", "there is no nats-server");
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let process = run(&folder, port, arguments);
        Some(Self { folder, port, process, arguments })
    }

    /// Its address.
    pub fn url(&self) -> String {
        format!("nats://127.0.0.1:{}", self.port)
    }

    /// Kills the broker and restarts it with its stored data.
    pub fn restart(&mut self) {
        self.kill();
        self.process = run(&self.folder, self.port, self.arguments);
    }

    /// Kills the broker and restarts it without data.
    pub fn wipe(&mut self) {
        self.kill();
        self.folder = tempfile::tempdir().unwrap();
        self.process = run(&self.folder, self.port, self.arguments);
    }

    /// Kills the broker, until it is restarted.
    pub fn kill(&mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        self.kill();
    }
}

fn run(folder: &TempDir, port: u16, arguments: &[&str]) -> Child {
    let mut process = Command::new("nats-server")
        .args(["-js", "-a", "127.0.0.1", "-p", &port.to_string(), "-sd"])
        .arg(folder.path())
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    for _ in 0..500 {
        if TcpStream::connect(("127.0.0.1", port)).is_ok() {
            return process;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    process.kill().unwrap();
    process.wait().unwrap();
    panic!("nats-server does not listen");
}
