//! The Python client: the description has each of its operations, and its example runs to the end. Without python3 the
//! test is skipped with a message.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_http::openapi;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use gaitwright_tests::skipped::skipped;
use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;

fn python(arguments: &[&str]) -> Option<String> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../server/clients/python");
    let output = Command::new("python3").arg("-B").args(arguments).current_dir(folder).output();
    let Ok(output) = output else {
        skipped("there is no python3");
        return None;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8(output.stdout).unwrap())
}

#[test]
fn every_operation_of_the_client_is_in_the_description() {
    let program = "import json, gaitwright_client as g\n\
                   print(json.dumps([[n, *o, callable(getattr(g.Client, n, None))] for n, o in g.OPERATIONS.items()]))";
    let Some(text) = python(&["-c", program]) else { return };
    let known: Vec<(String, String, String, bool)> = serde_json::from_str(&text).unwrap();
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    assert!(known.len() > 20);
    for (name, method, path, is_method) in known {
        assert!(document["paths"][&path][&method].is_object(), "{name}: {method} {path} is not described");
        assert!(is_method || name == "tell", "{name} is listed and cannot be called");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn python_example_runs_a_study_to_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = format!("http://{}", listener.local_addr().unwrap());
    let router = service.router();
    tokio::spawn(async move { axum::serve(listener, router).await.unwrap() });
    #[allow(clippy::disallowed_methods)] // a test waits for a process or a thread
    let ran = tokio::task::spawn_blocking(move || python(&["example.py", &address])).await.unwrap();
    let Some(text) = ran else { return };
    assert_eq!(text.lines().filter(|line| line.starts_with("trial ")).count(), 10, "{text}");
    assert!(text.lines().last().unwrap().starts_with("best: trial "), "{text}");
    service.stop().await;
}
