//! README and guides: links work, commands and their flags exist, addresses are in the description, and the service
//! shows every guide.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_optimizer::TunedBounds;
use gaitwright_http::openapi;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::cli;
use gaitwright_tests::service::Service;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const BINARY: &str = env!("CARGO_BIN_EXE_gaitwright-cli");

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The packages whose programs the documents run, with their folders.
const PACKAGES: [(&str, &str); 4] = [
    ("gait-optimizer", "optimizer"),
    ("interior-point", "optimizer/nlp"),
    ("gait-learner", "learner"),
    ("gaitwright-tests", "tests"),
];

/// Every Markdown file of the repository, with its text.
fn documents() -> BTreeMap<PathBuf, String> {
    let folders = [
        "",
        "docs",
        "docs/benchmarks",
        "optimizer",
        "optimizer/data",
        "optimizer/benches/casadi",
        "optimizer/benches/mujoco",
        "learner",
        "server/clients/python",
    ];
    let mut found = BTreeMap::new();
    for folder in folders {
        let Ok(entries) = std::fs::read_dir(repository().join(folder)) else { continue };
        for path in
            entries.map(|entry| entry.unwrap().path()).filter(|path| path.extension().is_some_and(|e| e == "md"))
        {
            let text = std::fs::read_to_string(&path).unwrap();
            found.insert(path, text);
        }
    }
    assert!(found.len() >= 10, "{:?}", found.keys());
    found
}

/// The anchors of a document's headings.
fn anchors(text: &str) -> BTreeSet<String> {
    let heading = |line: &str| {
        let title = line.trim_start_matches('#').trim().to_lowercase();
        title
            .chars()
            .filter(|c| c.is_alphanumeric() || " -".contains(*c))
            .map(|c| if c == ' ' { '-' } else { c })
            .collect()
    };
    text.lines().filter(|line| line.starts_with('#')).map(heading).collect()
}

/// The targets of a document's links and images.
fn links(text: &str) -> Vec<String> {
    text.split("](").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0.to_owned())).collect()
}

/// The lines of a document's shell blocks, without comments.
fn commands(text: &str) -> Vec<String> {
    let blocks = text.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next());
    let lines = blocks.flat_map(str::lines).map(|line| line.split("  #").next().unwrap().split(" > ").next().unwrap());
    lines.map(|line| line.trim().to_owned()).filter(|line| !line.is_empty()).collect()
}

#[test]
fn every_link_leads_to_a_file_and_a_heading() {
    let documents = documents();
    let (mut broken, mut followed) = (Vec::new(), 0);
    for (path, text) in &documents {
        for link in links(text).into_iter().filter(|link| !link.contains("://") && !link.contains(char::is_whitespace))
        {
            let (file, fragment) = link.split_once('#').unwrap_or((&link, ""));
            let target = if file.is_empty() { path.clone() } else { path.parent().unwrap().join(file) };
            followed += 1;
            let there = target.exists();
            let heading = fragment.is_empty()
                || anchors(&std::fs::read_to_string(&target).unwrap_or_default()).contains(fragment);
            if !there || !heading {
                broken.push(format!("{}: {link}", path.display()));
            }
        }
    }
    assert!(followed > 20, "{followed}");
    assert!(broken.is_empty(), "{broken:#?}");
}

/// The flags that the help of a command describes, but not those that its sentences mention.
fn flags_of(help: &str) -> BTreeSet<&str> {
    // Sentences are indented further.
    let described = help.lines().filter(|line| ["  -", "      --"].iter().any(|start| line.starts_with(start)));
    let names = described.map(str::trim_start).flat_map(|line| line.split("  ").next().unwrap().split([' ', ',', '=']));
    names.filter(|name| name.starts_with('-')).collect()
}

#[test]
fn flags_of_a_help_text_are_whole_and_its_own() {
    let help = "Options:\n      --trials <TRIALS>  Number of trials, unlike --walks\n  -h, --help\n          Shows --trial or\n          --walk\n";
    assert_eq!(flags_of(help), BTreeSet::from(["--trials", "-h", "--help"]));
}

#[test]
fn every_command_and_flag_exists() {
    let folder = tempfile::tempdir().unwrap();
    let help = |words: &[&str]| {
        let output = cli::run(BINARY, folder.path(), &[words, &["--help"]].concat());
        (output.status.success(), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let (mut wrong, mut tried) = (Vec::new(), 0);
    for (path, text) in documents() {
        let lines = commands(&text).into_iter().filter_map(|line| {
            let starts = ["cargo run -- ", "cargo run --release -- ", "gaitwright "];
            let run = starts.iter().find_map(|start| line.strip_prefix(start));
            run.map(str::to_owned)
        });
        for line in lines {
            let words: Vec<&str> = line.split_whitespace().collect();
            // `config show` and its like have a word more.
            let (mut known, mut text) = help(&words[..1]);
            if let Some(word) = words.get(1).filter(|word| text.contains(&format!("\n  {word} "))) {
                (known, text) = help(&[words[0], word]);
            }
            tried += 1;
            let known_flags = flags_of(&text);
            let flags = words.iter().filter(|word| word.starts_with('-')).map(|word| word.split('=').next().unwrap());
            let missing: Vec<&str> = flags.filter(|flag| !known_flags.contains(flag)).collect();
            if !known || !missing.is_empty() {
                wrong.push(format!("{}: {line}: {missing:?}", path.display()));
            }
        }
    }
    assert!(tried > 30, "{tried}");
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_benchmark_names_an_existing_program() {
    let (mut missing, mut tried) = (Vec::new(), 0);
    for (path, text) in documents() {
        for line in
            commands(&text).into_iter().flat_map(|line| line.split(" && ").map(str::to_owned).collect::<Vec<_>>())
        {
            let words: Vec<&str> = line.split_whitespace().collect();
            let after = |flag: &str| words.windows(2).find(|pair| pair[0] == flag).map(|pair| pair[1]);
            let Some(package) = after("-p") else { continue };
            let folder =
                PACKAGES.iter().find(|(name, _)| *name == package).map(|(_, folder)| repository().join(folder));
            let programs = [("--example", "examples"), ("--bench", "benches"), ("--test", "tests")];
            for (program, sources) in programs.into_iter().filter_map(|(flag, sources)| Some((after(flag)?, sources))) {
                tried += 1;
                let exists = folder.as_ref().is_some_and(|folder| {
                    let sources = folder.join(sources);
                    sources.join(format!("{program}.rs")).exists() || sources.join(program).join("main.rs").exists()
                });
                if !exists {
                    missing.push(format!("{}: {line}", path.display()));
                }
            }
        }
    }
    assert!(tried > 10, "{tried}");
    assert!(missing.is_empty(), "{missing:#?}");
}

/// `.ci/benchmarks` writes the results, so each looks as the script writes it.
#[test]
fn results_of_benchmarks_are_written_by_the_script() {
    let page = std::fs::read_to_string(repository().join("docs/benchmarks.md")).unwrap();
    let mut benchmarks = 0;
    for section in page.split("\n## ").skip(1) {
        let (question, rest) = section.split_once("\n\n").unwrap();
        assert!(question.ends_with('?'), "{question}");
        let (command, result) = rest.strip_prefix("```sh\n").and_then(|rest| rest.split_once("\n```\n\n")).unwrap();
        assert!(!command.contains('\n'), "{question}: {command}");
        let (measured, output) =
            result.split_once("\n\n```text\n").unwrap_or_else(|| panic!("{question} has no result"));
        let parts = [": ", " cores, load average ", " at the start, version ", ", commit ", ", "];
        let mut left = measured.strip_prefix("Measured on ").unwrap_or_else(|| panic!("{question}: {measured}"));
        for part in parts {
            left = left.split_once(part).unwrap_or_else(|| panic!("{question}: {measured}")).1;
        }
        let seconds = left.strip_suffix(" s.").and_then(|seconds| seconds.parse::<u32>().ok());
        assert!(seconds.is_some(), "{question}: {measured}");
        let after = output.split_once("\n```").unwrap().1;
        assert!(after.trim().is_empty(), "{question}: {after}");
        benchmarks += 1;
    }
    assert!(benchmarks > 10, "{benchmarks}");
}

/// An address with every identifier replaced: `/studies/STUDY/ask` is `/studies/{}/ask`.
fn template(address: &str) -> String {
    let part = |part: &str| {
        let named =
            part.starts_with('{') || (part.len() > 1 && part.chars().all(|c| c.is_ascii_uppercase() || c == '-'));
        if named { "{}".to_owned() } else { part.to_owned() }
    };
    address.split('/').map(part).collect::<Vec<_>>().join("/")
}

#[test]
fn every_address_of_the_guides_is_described() {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let described: BTreeSet<String> = document["paths"]
        .as_object()
        .unwrap()
        .keys()
        .map(|path| template(path.trim_start_matches("/api/v1")))
        .collect();
    let (mut unknown, mut tried) = (Vec::new(), 0);
    for (path, text) in documents() {
        if path.parent().unwrap().file_name().is_none_or(|folder| folder != "docs") {
            continue;
        }
        let said = text.split(|c: char| c.is_whitespace() || "`\"'();,".contains(c));
        for word in said.filter_map(|word| {
            word.strip_prefix("/api/v1")
                .or_else(|| word.starts_with("/studies").then_some(word))
                .or_else(|| word.starts_with("/trials").then_some(word))
        }) {
            tried += 1;
            if !described.contains(&template(word.split_once('?').map_or(word, |(path, _)| path)))
                && !word.ends_with("$1")
            {
                unknown.push(format!("{}: {word}", path.display()));
            }
        }
    }
    assert!(tried > 10, "{tried}");
    assert!(unknown.is_empty(), "{unknown:#?}");
}

#[tokio::test]
async fn every_guide_is_served_with_images_and_links_that_work() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let contents = service.fetch("/help").await;
    let listed: BTreeSet<String> = contents
        .text
        .split("href=\"/help/")
        .skip(1)
        .map(|rest| format!("/help/{}", rest.split('"').next().unwrap()))
        .collect();
    for guide in std::fs::read_dir(repository().join("docs")).unwrap().map(|entry| entry.unwrap().path()) {
        let address = format!("/help/{}", guide.file_stem().unwrap().to_str().unwrap());
        assert!(guide.is_dir() || listed.contains(&address), "{address} is not in the table of contents");
    }
    let mut followed = 0;
    for address in listed {
        let page = service.fetch(&address).await;
        assert_eq!(page.status, StatusCode::OK, "{address}");
        for target in page.text.split("href=\"").chain(page.text.split("src=\"")).skip(1) {
            let target = target.split('"').next().unwrap();
            let Some(rest) = target.strip_prefix("/help/") else { continue };
            followed += 1;
            let (there, fragment) = rest.split_once('#').unwrap_or((rest, ""));
            let linked = service.fetch(&format!("/help/{there}")).await;
            assert_eq!(linked.status, StatusCode::OK, "{address}: {target}");
            assert!(fragment.is_empty() || linked.text.contains(&format!("id=\"{fragment}\"")), "{address}: {target}");
        }
    }
    assert!(followed > 5, "{followed}");
    assert_eq!(service.fetch("/help/nothing").await.status, StatusCode::NOT_FOUND);
    service.stop().await;
}

/// Pages link to sections of the guides by the anchors of their headings.
#[test]
fn every_link_of_a_page_to_a_guide_has_its_section() {
    let (mut linked, mut sections) = (BTreeSet::new(), 0);
    for template in std::fs::read_dir(repository().join("web/templates")).unwrap() {
        let template = template.unwrap().path();
        let text = std::fs::read_to_string(&template).unwrap();
        for target in text.split("href=\"/help/").skip(1).map(|rest| rest.split('"').next().unwrap()) {
            let (guide, section) = target.split_once('#').unwrap_or((target, ""));
            if guide.contains('{') {
                continue;
            }
            let file =
                if guide == "data-files" { "optimizer/data/README.md".to_owned() } else { format!("docs/{guide}.md") };
            let guide_text = std::fs::read_to_string(repository().join(file)).unwrap();
            assert!(section.is_empty() || anchors(&guide_text).contains(section), "{}: {target}", template.display());
            sections += u32::from(!section.is_empty());
            linked.insert(guide.to_owned());
        }
    }
    assert!(sections > 15, "{sections}");
    for guide in [
        "clinician",
        "rater",
        "lab-session",
        "lab-script",
        "unattended",
        "administrator",
        "developer",
        "method",
        "glossary",
    ] {
        assert!(linked.contains(guide), "no page links to the guide {guide}");
    }
}

/// The glossary alone does not count: the footer of every page links to it.
#[test]
fn every_page_links_to_the_guide_it_is_about() {
    // Pages without a caller, errors, and the guides themselves.
    let without = ["sign_in", "sign_in_link", "no_account", "error", "unsent_form", "study_closed", "help"];
    let mut pages = 0;
    for template in std::fs::read_dir(repository().join("web/templates")).unwrap() {
        let template = template.unwrap().path();
        let text = std::fs::read_to_string(&template).unwrap();
        let name = template.file_stem().unwrap().to_string_lossy();
        if !text.contains("{% extends \"base.html\" %}") || without.contains(&name.as_ref()) {
            continue;
        }
        pages += 1;
        let mut guides = text.split("href=\"/help/").skip(1).map(|rest| rest.split(['"', '#']).next().unwrap());
        assert!(guides.any(|guide| guide != "glossary"), "{name} links to no guide");
    }
    assert!(pages > 20, "{pages}");
}

#[test]
fn guides_have_every_tuned_bound() {
    let guide = |name: &str| std::fs::read_to_string(repository().join("docs").join(name)).unwrap();
    for bound in TunedBounds::NAMES {
        assert!(
            guide("clinician.md").contains(&format!("\n| {bound} |")),
            "{bound} is not in the table of clinician.md"
        );
    }
    let header = TunedBounds::NAMES.join(",");
    assert!(guide("unattended.md").contains(&format!("`{header}`")), "unattended.md does not have the header {header}");
    let last = TunedBounds::NAMES.last().unwrap();
    assert!(guide("glossary.md").contains(&format!("a1 to {last}")), "glossary.md does not have a1 to {last}");
}
