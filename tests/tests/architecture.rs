//! The walls of ARCHITECTURE.md: which modules depend on which, where SQL is, and which crates do no I/O.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_tests::{imports, sources};
use std::collections::{HashMap, HashSet};
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
const WALLS: [(&str, &str, &[&str]); 29] = [
    ("server/http/src", "api/", &["pages/"]),
    ("server/http/src", "pages/", &["api/", "resources/"]),
    ("server/http/src", "figures/", &["api/", "pages/", "resources/"]),
    ("server/http/src", "resources/", &["api/", "pages/", "figures/"]),
    ("server/http/src", "format.rs", &["api/", "pages/", "figures/"]),
    ("server/service/src", "access/", &["studies/", "workers/"]),
    ("server/service/src", "workers/", &["access/", "studies/"]),
    ("server/service/src", "error.rs", &["access/", "studies/", "workers/"]),
    ("learner/src", "inference/", &["gaussian_process", "posterior", "acquisition/", "propose", "comparisons"]),
    ("learner/src", "posterior", &["acquisition/", "utility_inference", "propose", "comparisons"]),
    ("learner/src", "acquisition/", &["propose", "comparisons"]),
    ("optimizer/src", "body/", &["walking", "gait", "solve", "certificate", "execution"]),
    ("optimizer/src", "muscle/", &["walking", "gait", "initial_guess", "solve", "certificate", "execution"]),
    ("optimizer/src", "opensim_reading.rs", &["body", "gait", "reference", "emg", "solve"]),
    ("optimizer/src", "table.rs", &["body", "gait", "reference", "emg", "opensim_reading", "solve"]),
    ("optimizer/src", "signal_filter/", &["body", "gait", "reference", "emg", "solve"]),
    ("optimizer/src", "explanation/", &["sensitivity", "certificate", "execution"]),
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
    ("optimizer/src", "initial_guess/", &["solve", "explanation", "sensitivity", "certificate", "execution"]),
    ("optimizer/src", "solve/", &["explanation", "sensitivity", "certificate", "execution"]),
    ("optimizer/src", "sensitivity/", &["explanation", "certificate", "execution"]),
    (
        "optimizer/src",
        "execution/",
        &["gait_problem", "initial_guess", "solve", "explanation", "sensitivity", "certificate"],
    ),
    (
        "optimizer/src",
        "export/",
        &["gait_problem", "initial_guess", "solve", "explanation", "sensitivity", "certificate", "execution"],
    ),
    (
        "optimizer/src",
        "reference/",
        &["gait", "gait_problem", "initial_guess", "solve", "explanation", "sensitivity", "certificate", "execution"],
    ),
    (
        "optimizer/src",
        "emg/",
        &["gait_problem", "initial_guess", "solve", "explanation", "sensitivity", "certificate", "execution"],
    ),
    (
        "optimizer/src",
        "limit_cycle",
        &["gait", "gait_problem", "initial_guess", "solve", "explanation", "sensitivity", "certificate", "execution"],
    ),
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
fn modules_of_a_crate_do_not_import_from_each_other_in_circles() {
    for folder in CRATES {
        let imports = imports::of_crate(&sources::below(folder));
        for modules in imports::between_modules(&imports) {
            assert_eq!(imports::circle(&modules), None, "{folder}");
        }
    }
}

#[test]
fn modules_do_not_import_across_the_walls_of_the_architecture() {
    for (crate_folder, folder, forbidden) in WALLS {
        let imports = imports::of_crate(&sources::below(crate_folder));
        let behind: Vec<_> = imports.iter().filter(|(file, _)| is_of(file, folder)).collect();
        assert!(!behind.is_empty(), "{crate_folder}/{folder} has moved");
        for place in forbidden {
            assert!(imports.iter().any(|(file, _)| file.starts_with(place)), "{crate_folder}/{place} has moved");
        }
        for (file, others) in behind {
            let crossed = others.iter().find(|other| forbidden.iter().any(|folder| other.starts_with(folder)));
            assert_eq!(crossed, None, "{file}");
        }
    }
}

/// Whether a file is in a folder, or is the root of the module with that folder.
fn is_of(file: &str, folder: &str) -> bool {
    file.starts_with(folder) || folder.strip_suffix('/').is_some_and(|module| file == format!("{module}.rs"))
}

/// SQL needs the crate `sqlx`.
#[test]
fn only_the_store_contains_sql() {
    for (file, text) in sources::of_server() {
        assert!(file.starts_with("store/") || !text.contains("sqlx"), "{file}");
    }
}

/// A type of a source text with the traits that it derives.
struct DerivingType<'a> {
    traits: Vec<&'a str>,
    name: &'a str,
    has_fields: bool,
    /// The lines of its fields or variants.
    body: Vec<&'a str>,
}

impl<'a> DerivingType<'a> {
    /// The words of the types of its fields.
    fn field_types(&self) -> Vec<&'a str> {
        let code = self.body.iter().filter(|line| !line.trim_start().starts_with(['/', '#']));
        let types = code.map(|line| line.split_once(": ").map_or(*line, |(_, of)| of));
        types.flat_map(|of| of.split(|c: char| !c.is_ascii_alphanumeric())).collect()
    }
}

/// The types of a source text that derive traits.
fn deriving_types(text: &str) -> Vec<DerivingType<'_>> {
    let mut types = Vec::new();
    for rest in text.split("#[derive(").skip(1) {
        let (traits, rest) = rest.split_once(")]").unwrap();
        let item = ["struct ", "enum "].into_iter().filter_map(|kind| rest.find(kind)).min().unwrap();
        let item = &rest[item..];
        let (head, body) = item.split_at(item.find(['{', ';']).unwrap());
        // Formatted items end with a brace that is not indented.
        let all: Vec<&str> = if body.starts_with('{') {
            body.lines().take_while(|line| *line != "}").skip(1).collect()
        } else {
            vec![&head[head.find('(').unwrap_or(head.len())..]]
        };
        let variants = body.lines().take_while(|line| line.trim() != "}").skip(1);
        let mut variants = variants.filter(|line| !line.trim_start().starts_with(['/', '#']));
        let has_fields = if head.starts_with("struct ") {
            body.starts_with('{') || head.contains(',')
        } else {
            variants.any(|line| line.contains(['{', '(']))
        };
        let name = head.split(|c: char| c.is_whitespace() || c == '<' || c == '(').nth(1).unwrap();
        types.push(DerivingType { traits: traits.split(',').map(str::trim).collect(), name, has_fields, body: all });
    }
    types
}

/// Rows have fields. What the store reads back, such as the payload of an event, is deserialised as well; it is served by no
/// field and no body (`rows_of_the_record_are_not_served`).
fn could_be_served(found: &DerivingType) -> bool {
    let derives = |name| found.traits.contains(&name);
    found.has_fields && (derives("ToSchema") || derives("Serialize") && !derives("Deserialize"))
}

/// Types that may be served, and types that may not.
const EXAMPLES: &str = "
#[derive(Serialize, ToSchema)]
pub struct Id(Uuid);
#[derive(Clone, Serialize, ToSchema)]
pub enum State {
    /// Running (and not paused).
    Running,
}
#[derive(Serialize, Deserialize)]
pub struct Payload {
    id: Id,
}
#[derive(Clone, Serialize)]
pub struct Row {
    id: Id,
}
#[derive(Serialize)]
pub enum Content {
    NoDifference {
        a: Id,
    },
}
#[derive(Serialize)]
pub struct Pair(Id, Id);
#[derive(Serialize, Deserialize, ToSchema)]
pub struct Described {
    id: Id,
}
";

#[test]
fn rows_of_the_record_are_not_served() {
    let examples = deriving_types(EXAMPLES);
    let names: Vec<&str> = examples.iter().filter(|found| could_be_served(found)).map(|found| found.name).collect();
    assert_eq!(names, ["Row", "Content", "Pair", "Described"]);

    let (mut vocabulary, mut documents) = (0, Vec::new());
    let store = sources::below("server/store/src");
    for (file, text) in &store {
        assert!(!text.contains("ToSchema for"), "{file}");
        for found in deriving_types(text) {
            assert!(!could_be_served(&found), "{file}: {}", found.name);
            vocabulary += usize::from(found.traits.contains(&"ToSchema"));
            documents.extend((found.has_fields && found.traits.contains(&"Serialize")).then_some(found.name));
        }
    }
    assert!(vocabulary > 10 && documents.contains(&"ExecutionReported"), "{vocabulary} {documents:?}");

    // The compiler refuses to serve a type without `Serialize`, which only documents of the record have.
    let mut bodies = 0;
    for (file, text) in sources::below("server/http/src/api") {
        for body in ["Json<", "body = "].into_iter().flat_map(|start| text.split(start).skip(1)) {
            bodies += 1;
            let body = &body[..body.find([',', ')', '(', '\n']).unwrap()];
            let mut words = body.split(|c: char| !c.is_ascii_alphanumeric());
            assert!(!words.any(|word| documents.contains(&word)), "{file}: {body}");
        }
    }
    assert!(bodies > 100, "{bodies}");

    // Nor as a field of what is served or received.
    let mut wire_types = 0;
    for folder in ["server/http/src", "server/service/src"] {
        for (file, text) in sources::below(folder) {
            for found in deriving_types(&text).iter().filter(|found| found.traits.contains(&"ToSchema")) {
                wire_types += 1;
                let stored = found.field_types().into_iter().find(|word| documents.contains(word));
                assert_eq!(stored, None, "{file}: {}", found.name);
            }
        }
    }
    assert!(wire_types > 150, "{wire_types}");
}

const KINDS: [&str; 4] = ["struct ", "enum ", "trait ", "type "];

/// The name of each type and trait of product code, and whether clients see it.
fn definitions(text: &str) -> Vec<(&str, bool)> {
    let product = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
    let wire: HashSet<&str> = deriving_types(product)
        .iter()
        .filter(|found| found.traits.contains(&"ToSchema"))
        .map(|found| found.name)
        .collect();
    let mut found = Vec::new();
    for raw in product.lines() {
        let mut line = raw.trim_start();
        for visibility in ["pub ", "pub(crate) ", "pub(super) "] {
            line = line.strip_prefix(visibility).unwrap_or(line);
        }
        if line.starts_with("pub(in ") {
            line = line.split_once(") ").unwrap().1;
        }
        // An indented alias is that of a trait.
        let kinds: &[&str] = if raw.starts_with(' ') { &KINDS[..3] } else { &KINDS };
        let Some(rest) = kinds.iter().find_map(|kind| line.strip_prefix(kind)) else {
            continue;
        };
        let name = rest.split(|c: char| !c.is_ascii_alphanumeric()).next().unwrap();
        if name.starts_with(|c: char| c.is_ascii_uppercase()) {
            found.push((name, wire.contains(name)));
        }
    }
    found
}

/// A name means one thing. What clients see of a type can have its name.
#[test]
fn names_of_types_are_different() {
    let examples = definitions(EXAMPLES);
    assert_eq!(examples.iter().filter(|(_, wire)| *wire).count(), 3, "{examples:?}");
    let (mut places, mut wire) = (HashMap::<String, Vec<String>>::new(), HashMap::<String, Vec<String>>::new());
    for folder in CRATES {
        for (file, text) in sources::below(folder) {
            if file.ends_with("tests.rs")
                || file.contains("tests/")
                || folder == "server/src" && file.starts_with("bin/")
            {
                continue;
            }
            for (name, is_wire) in definitions(&text) {
                let is_wire = folder == "server/http/src" && (is_wire || file.starts_with("resources/"));
                let found = if is_wire { &mut wire } else { &mut places };
                found.entry(name.to_owned()).or_default().push(format!("{folder}/{file}"));
            }
        }
    }
    assert!(places.len() > 500 && wire.len() > 100, "{} {}", places.len(), wire.len());
    let mut repeated: Vec<_> = places.iter().chain(&wire).filter(|(_, files)| files.len() > 1).collect();
    repeated.sort();
    assert!(repeated.is_empty(), "{repeated:#?}");
}

const LIBRARIES: [&str; 3] = ["optimizer/nlp/src", "optimizer/src", "learner/src"];

/// The learner and the optimiser work on what they are given.
#[test]
fn libraries_do_no_input_or_output() {
    for folder in LIBRARIES {
        for (file, text) in sources::below(folder) {
            for module in ["std::fs", "std::env", "std::net", "std::process", "std::io"] {
                assert!(!text.contains(module), "{folder}/{file} uses {module}");
            }
        }
    }
}

/// Files that measure how long a solve takes, for its report and its time limit.
const MEASURE_TIME: [&str; 9] = [
    "optimizer/nlp/src/formulation.rs",
    "optimizer/nlp/src/iterate.rs",
    "optimizer/nlp/src/newton_system.rs",
    "optimizer/nlp/src/newton_system/iterative_refinement.rs",
    "optimizer/nlp/src/newton_system/multiplier_estimate.rs",
    "optimizer/nlp/src/solve.rs",
    "optimizer/src/solve.rs",
    "optimizer/src/solve/phases.rs",
    "optimizer/src/solve/time_limit.rs",
];

/// Equal inputs and seeds give equal results.
#[test]
fn libraries_read_no_clock_and_draw_no_random_numbers_of_the_system() {
    let clocks = ["std::time", "Instant::now", "SystemTime"];
    let random = ["getrandom", "rand::rng", "thread_rng", "from_os_rng", "from_entropy", "OsRng", "RandomState"];
    for folder in LIBRARIES {
        for (file, text) in sources::below(folder) {
            // A duration is not a clock.
            let text = text.replace("std::time::Duration", "");
            let path = format!("{folder}/{file}");
            let clock = clocks.iter().find(|name| text.contains(*name));
            assert_eq!(clock.is_some(), MEASURE_TIME.contains(&path.as_str()), "{path}: {clock:?}");
            let drawn = random.iter().find(|name| text.contains(*name));
            assert!(drawn.is_none(), "{path} uses {drawn:?}");
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

/// A bare module name in a row of a table is a file or folder below a folder that the row begins with; the words of the
/// picture of modules are files or folders of their crate.
#[test]
fn modules_that_the_architecture_names_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let text = std::fs::read_to_string(root.join("ARCHITECTURE.md")).unwrap();
    let files: Vec<String> = ["server", "optimizer", "learner"]
        .into_iter()
        .flat_map(|folder| sources::below(folder).into_iter().map(move |(file, _)| format!("/{folder}/{file}")))
        .collect();
    // `src/` stands for the modules directly in a crate.
    let is_module = |folder: &str, name: &str| {
        let (file, inner) = (format!("{name}.rs"), format!("{name}/"));
        files.iter().any(|path| match (folder, path.split_once("/src/")) {
            ("src/", Some((_, module))) => module == file || module.starts_with(&inner),
            _ => {
                path.contains(&format!("/{folder}"))
                    && (path.ends_with(&format!("/{file}")) || path.contains(&format!("/{inner}")))
            }
        })
    };
    let is_word = |span: &&str| span.len() > 1 && span.chars().all(|c| c.is_ascii_lowercase() || c == '_');
    let mut seen = 0;
    for row in text.lines().filter(|line| line.starts_with("| `")) {
        let (first, rest) = row[2..].split_once(" | ").unwrap();
        let folders: Vec<&str> = first.split('`').skip(1).step_by(2).filter(|span| span.ends_with('/')).collect();
        for name in rest.split('`').skip(1).step_by(2).filter(is_word).filter(|name| *name != "gaitwright") {
            seen += 1;
            assert!(
                folders.iter().any(|folder| is_module(folder, name) || is_module("src/", name)),
                "{folders:?}: {name}"
            );
        }
    }
    let picture = text.split("```").nth(3).unwrap();
    let mut inside = "";
    for line in picture.lines().filter(|line| line.contains("->")) {
        let named = line.split(' ').next().unwrap();
        inside = if named.is_empty() { inside } else { named };
        let modules = line.strip_prefix(named).unwrap().trim_start().split("      ").next().unwrap();
        let modules = modules.split(|c: char| !(c.is_ascii_lowercase() || c == '_')).filter(|word| !word.is_empty());
        for name in modules {
            seen += 1;
            assert!(is_module(&format!("{inside}/"), name), "{inside}: {name}");
        }
    }
    assert!(seen > 70, "{seen}");
}
