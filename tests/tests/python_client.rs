//! The Python client: it is what its generator makes of the description, its types hold, and the example, the guide and
//! the notebook run against a service. Where python3 or a module is absent, a test is skipped with a
//! message, unless `GAITWRIGHT_REQUIRE_PYTHON` is set.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::Value;
use skipped_tests::skipped_unless_required;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// The address in the guide and in the notebook.
const ADDRESS: &str = "127.0.0.1:8080";

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn python(arguments: &[&str]) -> std::io::Result<Output> {
    Command::new("python3")
        .arg("-B")
        .args(arguments)
        .env("MPLBACKEND", "Agg")
        .current_dir(repository().join("server/clients/python"))
        .output()
}

/// Whether python3 has these modules. Otherwise the test is skipped.
fn has(modules: &[&str]) -> bool {
    for import in modules.iter().map(|module| format!("import {module}")) {
        if !python(&["-c", &import]).is_ok_and(|output| output.status.success()) {
            skipped_unless_required("GAITWRIGHT_REQUIRE_PYTHON", &format!("python3 cannot {import}"));
            return false;
        }
    }
    true
}

/// Output of a Python program with these modules, or `None` if it is skipped. A program that fails fails the test.
fn ran(modules: &[&str], arguments: &[&str]) -> Option<String> {
    if !has(modules) {
        return None;
    }
    let output = python(arguments).unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    Some(text)
}

async fn ran_beside(modules: &[&str], arguments: Vec<String>) -> Option<String> {
    // Asked on the thread of the test, because its name is in the message.
    if !has(modules) {
        return None;
    }
    #[allow(clippy::disallowed_methods)] // a test waits for a process or a thread
    let beside =
        tokio::task::spawn_blocking(move || ran(&[], &arguments.iter().map(String::as_str).collect::<Vec<_>>()));
    beside.await.unwrap()
}

async fn service() -> (TempDir, Service, String) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let address = service.listening().await;
    (folder, service, address)
}

#[test]
fn client_matches_generator_output() {
    // `json` is in every Python: without it there is no python3.
    ran(&["json"], &["generate.py", "--check"]);
}

#[test]
fn the_client_repeats_pages_follows_and_waits() {
    ran(&["json"], &["-m", "unittest", "--quiet"]);
}

#[test]
fn the_types_of_the_client_are_strict() {
    ran(&["mypy", "numpy"], &["-m", "mypy", "--cache-dir=/dev/null", "."]);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_example_runs_a_study_to_its_end_as_often_as_it_is_started() {
    let (_folder, service, address) = service().await;
    for _ in 0..2 {
        let arguments = vec!["example.py".to_owned(), format!("http://{address}")];
        let Some(text) = ran_beside(&["json"], arguments).await else { return };
        assert_eq!(text.lines().filter(|line| line.starts_with("trial ")).count(), 10, "{text}");
        assert!(text.lines().last().unwrap().starts_with("finished; best: trial "), "{text}");
    }
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_programs_of_the_guide_run() {
    let (_folder, service, address) = service().await;
    let guide = std::fs::read_to_string(repository().join("docs/lab-script.md")).unwrap();
    let blocks: Vec<&str> = guide.split("```python\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert_eq!(blocks.len(), 3, "a loop, a wait, and tables");
    assert!(blocks[0].contains(ADDRESS));
    let program = |blocks: &[&str]| vec!["-c".to_owned(), blocks.concat().replace(ADDRESS, &address)];
    let Some(text) = ran_beside(&["json"], program(&blocks[..2])).await else { return };
    assert!(text.contains("{'a1': ") && text.contains("'converged': 3"), "{text}");
    if let Some(with_tables) = ran_beside(&["numpy"], program(&blocks)).await {
        assert!(with_tables.lines().count() > text.lines().count(), "{with_tables}");
    }
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_notebook_plots_a_gait_and_its_rmse() {
    let (_folder, service, address) = service().await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let text = std::fs::read_to_string(repository().join("server/clients/python/gait.ipynb")).unwrap();
    let notebook: Value = serde_json::from_str(&text).unwrap();
    let mut program = String::new();
    for cell in notebook["cells"].as_array().unwrap().iter().filter(|cell| cell["cell_type"] == "code") {
        assert_eq!(cell["outputs"], serde_json::json!([]), "the notebook is kept without outputs");
        program.extend(cell["source"].as_array().unwrap().iter().map(|line| line.as_str().unwrap()));
        program.push('\n');
    }
    assert!(program.contains(ADDRESS));
    let program = program.replace(ADDRESS, &address) + "print([len(plt.figure(n).axes) for n in plt.get_fignums()])";
    let Some(text) = ran_beside(&["matplotlib", "numpy"], vec!["-c".to_owned(), program]).await else { return };
    assert_eq!(text.trim(), "[5, 1]");
    service.stop().await;
}
