//! `gaitwright serve` as a process of its own.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;

/// A service as a process, killed when dropped.
pub struct Process {
    /// The process.
    pub child: Child,
    /// Its output until it was ready.
    pub said: Vec<String>,
    /// Its output from then on.
    later: Option<JoinHandle<Vec<String>>>,
    /// Scheme and address.
    pub origin: String,
}

impl Process {
    /// Starts the service of a program on a free port, and waits until its output contains `ready`.
    pub fn start(program: &str, folder: &Path, arguments: &[&str], ready: &str) -> Self {
        let mut command = Command::new(program);
        command.args(["serve", "--listen", "127.0.0.1:0", "--workers", "1"]).args(arguments).current_dir(folder);
        Self::watch(command, ready)
    }

    /// Starts a command that becomes a service, and waits until its output contains `ready`.
    pub fn watch(mut command: Command, ready: &str) -> Self {
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        let mut said = Vec::new();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        while !said.last().is_some_and(|line: &String| line.contains(ready)) {
            let line = lines.next().unwrap_or_else(|| panic!("it ended before it was ready: {said:?}"));
            said.push(line.unwrap());
        }
        // Reads later output, so that the pipe does not fill up.
        let later = std::thread::spawn(move || lines.map_while(Result::ok).collect());
        let listening = said.iter().find(|line| line.contains("listening on ")).unwrap();
        let origin = listening.split("listening on ").nth(1).unwrap().split_whitespace().next().unwrap().to_owned();
        Self { child, said, later: Some(later), origin }
    }

    /// Host and port.
    pub fn address(&self) -> &str {
        self.origin.split("://").nth(1).unwrap()
    }

    /// Stops the service and returns its output after it was ready.
    pub fn end(mut self) -> Vec<String> {
        self.child.kill().unwrap();
        self.later.take().unwrap().join().unwrap()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended by itself already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
