//! The walls of ARCHITECTURE.md: which modules depend on which, where SQL is, and which crates do no I/O.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_tests::{imports, sources};
use std::path::Path;

/// The source folders of the crates.
const CRATES: [&str; 9] = [
    "optimizer/nlp/src",
    "optimizer/src",
    "learner/src",
    "server/compute/src",
    "server/store/src",
    "server/charts/src",
    "server/service/src",
    "server/http/src",
    "server/src",
];

/// Crates, and folders and files of them, with what these must not import from the same crate: ARCHITECTURE.md draws the
/// arrows.
const WALLS: [(&str, &str, &[&str]); 16] = [
    ("server/http/src", "api/", &["pages/"]),
    ("server/http/src", "pages/", &["api/"]),
    ("server/http/src", "figures/", &["api/", "pages/"]),
    ("server/http/src", "format.rs", &["api/", "pages/", "figures/"]),
    ("server/service/src", "access/", &["studies/", "workers/"]),
    ("server/service/src", "workers/", &["access/", "studies/"]),
    ("server/service/src", "error.rs", &["access/", "studies/", "workers/"]),
    (
        "learner/src",
        "inference/",
        &["gaussian_process", "posterior", "acquisition/", "learner.rs", "propose", "comparisons"],
    ),
    ("learner/src", "posterior", &["acquisition/", "learner.rs", "propose", "comparisons"]),
    ("learner/src", "acquisition/", &["propose", "comparisons"]),
    ("optimizer/src", "body/", &["walking", "gait", "solve", "certificate", "execution"]),
    ("optimizer/src", "walking/", &["gait", "solve", "certificate", "execution"]),
    ("optimizer/src", "gait/", &["gait_problem", "initial_guess", "solve", "certificate", "execution"]),
    (
        "optimizer/src",
        "gait_problem/",
        &["initial_guess", "solve", "explanation", "sensitivity", "certificate", "execution"],
    ),
    (
        "optimizer/src",
        "certificate/",
        &["gait_problem", "initial_guess", "solve", "explanation", "sensitivity", "execution"],
    ),
    ("optimizer/src", "solve/", &["explanation", "sensitivity", "certificate", "execution"]),
];

#[test]
fn files_of_a_crate_do_not_import_from_each_other_in_circles() {
    for folder in CRATES {
        let imports = imports::of_crate(&sources::below(folder));
        assert!(imports.len() > 1, "{folder} has moved");
        assert_eq!(imports::circle(&imports), None, "{folder}");
    }
}

#[test]
fn modules_do_not_import_across_the_walls_of_the_architecture() {
    for (crate_folder, folder, forbidden) in WALLS {
        let imports = imports::of_crate(&sources::below(crate_folder));
        let behind: Vec<_> = imports.iter().filter(|(file, _)| file.starts_with(folder)).collect();
        assert!(!behind.is_empty(), "{crate_folder}/{folder} has moved");
        for (file, others) in behind {
            let crossed = others.iter().find(|other| forbidden.iter().any(|folder| other.starts_with(folder)));
            assert_eq!(crossed, None, "{file}");
        }
    }
}

/// SQL needs the crate `sqlx`.
#[test]
fn only_the_store_contains_sql() {
    for (file, text) in sources::of_server() {
        assert!(file.starts_with("store/") || !text.contains("sqlx"), "{file}");
    }
}

/// The learner and the optimiser work on what they are given.
#[test]
fn libraries_do_no_input_or_output() {
    for folder in ["optimizer/nlp/src", "optimizer/src", "learner/src"] {
        for (file, text) in sources::below(folder) {
            for module in ["std::fs", "std::env", "std::net", "std::process", "std::io"] {
                assert!(!text.contains(module), "{folder}/{file} uses {module}");
            }
        }
    }
}

/// Whether a code span names a source file, a document or a folder of the repository.
fn is_place(span: &str) -> bool {
    let plain = span.chars().all(|c| c.is_ascii_alphanumeric() || "_-./".contains(c));
    let ending = Path::new(span).extension().and_then(|ending| ending.to_str());
    plain && (matches!(ending, Some("rs" | "md")) || span.ends_with('/'))
}

#[test]
fn places_that_the_architecture_names_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let text = std::fs::read_to_string(root.join("ARCHITECTURE.md")).unwrap();
    let files: Vec<String> = ["server", "optimizer", "learner", "tests"]
        .into_iter()
        .flat_map(|folder| sources::below(folder).into_iter().map(move |(file, _)| format!("/{folder}/{file}")))
        .collect();
    let mut seen = 0;
    for span in text.split('`').skip(1).step_by(2).filter(|span| is_place(span)) {
        seen += 1;
        let end = format!("/{span}");
        let is_source =
            files.iter().any(|file| if span.ends_with('/') { file.contains(&end) } else { file.ends_with(&end) });
        assert!(is_source || root.join(span).exists(), "{span}");
    }
    assert!(seen > 60, "{seen}");
}
