//! The command line with the real optimiser, on coarse meshes and without muscles, so that it takes seconds.
//! `GAITWRIGHT_LONG_TESTS=1` adds a gait with muscles.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gait_optimizer::{
    CancelToken, Device, GaitProblem, GaitSettings, ReferenceGait, SolveOptions, Subject, TunedBounds,
};
use gaitwright_service::access::Reach;
use gaitwright_service::studies::built_in_entries;
use gaitwright_service::studies::study_plan::{self, NewStudy};
use gaitwright_service::workers::nats::{ResultMessage, SolveOrder, pack};
use gaitwright_service::workers::{Assignment, AssignmentResult, Attempt, Evaluate, GaitSolver};
use gaitwright_store::studies::{AnswerSource, AtlasRole, StudyFilter, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_store::{Store, StudyId, TrialId, attempts, commit, studies, subjects, trials};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::cli;
use gaitwright_tests::service::Service;
use serde_json::{Value, json};
use skipped_tests::long_tests_are_skipped;
use std::collections::HashSet;
use std::path::Path;
use std::process::{Output, Stdio};
use std::time::Duration;

const BINARY: &str = env!("CARGO_BIN_EXE_gaitwright-cli");
const COARSE: [&str; 4] = ["--muscles", "off", "--mesh", "2,2,3,3"];

fn gaitwright(folder: &Path, arguments: &[&str]) -> Output {
    let output = cli::run(BINARY, folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

fn json_of(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stdout)))
}

/// Numbers and identifiers differ from machine to machine and from run to run; names, words and order do not.
fn redacted(value: &Value) -> Value {
    match value {
        Value::Number(_) => "[number]".into(),
        Value::String(text) if text.len() == 36 && text.matches('-').count() == 4 => "[id]".into(),
        Value::String(text) if text.len() == 16 && text.bytes().all(|b| b.is_ascii_hexdigit()) => "[digest]".into(),
        Value::Array(list) if list.iter().all(Value::is_number) => json!(format!("[{} numbers]", list.len())),
        Value::Array(list) => list.iter().map(redacted).collect(),
        Value::Object(fields) => Value::Object(fields.iter().map(|(k, v)| (k.clone(), redacted(v))).collect()),
        other => other.clone(),
    }
}

#[test]
fn commands_solve_a_gait_cold_and_warm_and_a_sweep() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let cold = json_of(&gaitwright(folder, &[&["solve", "--json", "--out", "gait.json"][..], &COARSE].concat()));
    insta::assert_json_snapshot!("solve_cold", redacted(&cold));
    assert_eq!(cold["status"], "converged");
    assert!(cold["max_violation"].as_f64().unwrap() <= 1e-6);

    let warm = ["solve", "--json", "--warm", "gait.json", "--bounds", "a5=0.013"];
    let warm = json_of(&gaitwright(folder, &[&warm[..], &COARSE].concat()));
    insta::assert_json_snapshot!("solve_warm", redacted(&warm));
    assert!(warm["iterations"].as_u64() < cold["iterations"].as_u64());
    assert_eq!(warm["lineage"]["ancestors"], json!([ancestor(&cold)]));

    // Every local optimum that the guesses reach is kept, and can be started from.
    let many = ["solve", "--json", "--initial-guesses", "4", "--out", "many.json"];
    let many = json_of(&gaitwright(folder, &[&many[..], &COARSE].concat()));
    let runs = many["solver_runs"].as_array().unwrap();
    let answer = runs.iter().find(|run| run["chosen"] == true).unwrap()["local_optimum"].as_u64().unwrap();
    let other = runs
        .iter()
        .find(|run| run["local_optimum"].as_u64().is_some_and(|local_optimum| local_optimum != answer))
        .unwrap();
    let number = other["local_optimum"].to_string();
    let again = ["solve", "--json", "--warm", "many.json", "--warm-local-optimum", &number];
    let again = json_of(&gaitwright(folder, &[&again[..], &COARSE].concat()));
    assert_eq!(again["solver_runs"][0]["status"], "converged");
    let away = again["solver_runs"][0]["gait_rmse_rad"].as_f64().unwrap() - other["gait_rmse_rad"].as_f64().unwrap();
    assert!(away.abs() < 1e-3, "{away}");
    assert_eq!(again["lineage"]["ancestors"][0]["local_optimum"].as_u64(), other["local_optimum"].as_u64());
    let unknown = cli::run(
        BINARY,
        folder,
        &[&["solve", "--warm", "many.json", "--warm-local-optimum", "9"][..], &COARSE].concat(),
    );
    assert_eq!(unknown.status.code(), Some(2));
    assert!(
        String::from_utf8_lossy(&unknown.stderr)
            .contains("many.json has no local optimum with the number 9. Numbers for --warm-local-optimum: 1, 2")
    );

    let [reachable, unreachable] = ["a5=0.013", "a7=5,a8=5"];
    std::fs::write(folder.join("actions.csv"), cli::actions(&[reachable, unreachable])).unwrap();
    let sweep = ["sweep", "--actions", "actions.csv", "--out", "out.csv", "--warm", "gait.json", "--max-iterations"];
    let output = gaitwright(folder, &[&sweep[..], &["200"], &COARSE].concat());
    assert!(output.stdout.is_empty());
    let table = std::fs::read_to_string(folder.join("out.csv")).unwrap();
    let rows: Vec<&str> = table.lines().collect();
    insta::assert_snapshot!("sweep_header", rows[0]);
    assert!(rows[1].starts_with(&format!("{},converged,", cli::action(reachable))), "{}", rows[1]);
    // No posture satisfies these bounds, which is a result with one of the six statuses.
    let status = rows[2].strip_prefix(&(cli::action(unreachable) + ",")).unwrap().split(',').next().unwrap();
    assert!(["infeasible", "stalled", "iteration_limit"].contains(&status), "{}", rows[2]);
    assert_eq!(cli::files(folder), ["actions.csv", "gait.json", "many.json", "out.csv"]);

    // A gait of the other variant is refused with one message for the whole table.
    let output = cli::run(BINARY, folder, &[&sweep[..], &["200", "--muscles", "on"]].concat());
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("the gait has no muscles, but the problem has muscles"), "{text}");
}

/// The answer of a solve as those that start from it name it.
fn ancestor(report: &Value) -> Value {
    let lineage = &report["lineage"];
    json!({
        "id": lineage["id"], "local_optimum": lineage["local_optimum"], "objective": report["objective"],
        "gait_rmse_rad": report["gait_rmse_rad"]
    })
}

#[test]
fn gait_file_lists_its_ancestors() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let solve = |arguments: &[&str]| {
        json_of(&gaitwright(folder, &[&["solve", "--json", "--initial-guesses", "1"], arguments, &COARSE].concat()))
    };
    let first = solve(&["--out", "first.json"]);
    assert_eq!((&first["lineage"]["local_optimum"], &first["lineage"]["ancestors"]), (&json!(1), &json!([])));
    let second = solve(&["--warm", "first.json", "--bounds", "a5=0.013", "--out", "second.json"]);
    let third = solve(&["--warm", "second.json", "--bounds", "a5=0.02"]);
    assert_eq!(third["started_from"], "warm");
    assert_eq!(third["lineage"]["ancestors"], json!([ancestor(&second), ancestor(&first)]));
    assert_ne!(first["lineage"]["id"], second["lineage"]["id"]);

    // The same in the text output.
    let output = gaitwright(folder, &[&["solve", "--warm", "second.json"][..], &COARSE].concat());
    let text = String::from_utf8_lossy(&output.stdout);
    for (words, gait) in [("started from", &second), ("which came from", &first)] {
        let id = gait["lineage"]["id"].as_str().unwrap();
        assert!(text.contains(&format!("  {words:<19}gait {id} (local optimum 1, objective ")), "{text}");
    }

    // A file of a version that kept no lineage, and one whose gait is not the one it speaks of.
    let mut file: Value = serde_json::from_str(&std::fs::read_to_string(folder.join("second.json")).unwrap()).unwrap();
    file["lineage"]["id"] = "0123456789abcdef".into();
    std::fs::write(folder.join("other.json"), file.to_string()).unwrap();
    file.as_object_mut().unwrap().remove("lineage");
    std::fs::write(folder.join("older.json"), file.to_string()).unwrap();
    for name in ["other.json", "older.json"] {
        let child = solve(&["--warm", name, "--bounds", "a5=0.02"]);
        assert_eq!(child["lineage"]["ancestors"], json!([ancestor(&second)]), "{name}");
    }

    // A gait of the cold start that follows a warm one in vain has not come from there.
    for x in file["warm_start"]["point"]["x"].as_array_mut().unwrap() {
        *x = 0.0.into();
    }
    std::fs::write(folder.join("nothing.json"), file.to_string()).unwrap();
    let fresh = solve(&["--warm", "nothing.json"]);
    assert_eq!((&fresh["started_from"], &fresh["lineage"]["ancestors"]), (&json!("cold_after_warm"), &json!([])));
    assert_eq!(fresh["lineage"]["id"], first["lineage"]["id"]);
    let output = gaitwright(folder, &[&["solve", "--warm", "nothing.json"][..], &COARSE].concat());
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("  started from       initial guesses: the warm start from gait "), "{text}");
}

#[test]
fn solver_settings_are_read_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("solver.json"), r#"{"bound_push": 0.01}"#).unwrap();
    let solve = ["solve", "--json", "--initial-guesses", "1"];
    let gait = |flags: &[&str]| {
        let report = json_of(&gaitwright(folder, &[&solve[..], flags, &COARSE].concat()));
        assert_eq!(report["status"], "converged");
        report["lineage"]["id"].as_str().unwrap().to_owned()
    };
    // The start is nearer to its bounds, so the way is another one, and at least the last bits of where it ends.
    let usual = gait(&[]);
    assert_ne!(gait(&["--solver-settings", "solver.json"]), usual);
    assert_eq!(gait(&[]), usual);
}

/// If the output folder is removed during the solve, the report is still printed.
#[test]
fn report_is_printed_although_the_gait_file_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("place");
    std::fs::create_dir(&place).unwrap();
    let arguments = [&["solve", "--json", "--out", "place/gait.json", "--max-iterations", "40"][..], &COARSE].concat();
    let child =
        cli::command(BINARY, folder.path(), &arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    while cli::files(&place).is_empty() {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::fs::remove_dir_all(&place).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("Cannot write place/gait.json"));
    assert!(json_of(&output)["status"].is_string());
}

/// A command does not overwrite its own input, nor the output file of a stopped solve.
#[cfg(unix)]
#[test]
fn solve_does_not_overwrite_its_input_file() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let solved = gaitwright(folder, &[&["solve", "--out", "gait.json"][..], &COARSE].concat());
    assert!(solved.status.success());
    let gait = std::fs::read(folder.join("gait.json")).unwrap();

    std::os::unix::fs::symlink("gait.json", folder.join("link.json")).unwrap();
    let onto_itself = [&["solve", "--warm", "gait.json", "--out", "link.json"][..], &COARSE].concat();
    let output = cli::run(BINARY, folder, &onto_itself);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("gait.json is an input of this command"));

    // A link is followed.
    std::fs::write(folder.join("target.json"), "old").unwrap();
    std::os::unix::fs::symlink("target.json", folder.join("other.json")).unwrap();
    let through = [&["solve", "--warm", "gait.json", "--out", "other.json"][..], &COARSE].concat();
    assert!(gaitwright(folder, &through).status.success());
    assert!(folder.join("other.json").is_symlink());
    assert!(std::fs::read_to_string(folder.join("target.json")).unwrap().contains("\"report\""));

    // A device is written to, not replaced.
    let device = [&["solve", "--warm", "gait.json", "--out", "/dev/null"][..], &COARSE].concat();
    assert!(gaitwright(folder, &device).status.success());
    assert!(!std::fs::metadata("/dev/null").unwrap().is_file());

    let stopped = [&["solve", "--tolerance", "1e-10", "--out", "gait.json"][..], &COARSE].concat();
    let child = cli::command(BINARY, folder, &stopped).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while !cli::files(folder).iter().any(|name| name.contains(".part")) {
        std::thread::sleep(Duration::from_millis(1));
    }
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert_eq!(std::fs::read(folder.join("gait.json")).unwrap(), gait);
    assert_eq!(cli::files(folder), ["gait.json", "link.json", "other.json", "target.json"]);
}

#[test]
fn tune_runs_a_study_of_three_trials() {
    let folder = tempfile::tempdir().unwrap();
    let tune = ["tune", "--muscles", "off", "--trials", "3", "--seed", "2", "--workers", "1", "--json"];
    let summary = json_of(&gaitwright(folder.path(), &tune));
    assert_eq!(summary["state"], "finished");
    let trials = summary["trials"].as_array().unwrap();
    assert_eq!(trials.len(), 3);
    for trial in trials {
        assert!(["converged", "not_converged"].contains(&trial["label"].as_str().unwrap()), "{trial}");
        insta::assert_json_snapshot!("tune_trial_fields", trial.as_object().unwrap().keys().collect::<Vec<_>>());
    }
    assert_eq!(trials[0]["warm_started_from"], Value::Null);
    let best = trials.iter().find(|trial| trial["number"] == summary["best_trial"]).expect("a best trial");
    assert_eq!((&best["action"], &best["label"]), (&summary["best_action"], &json!("converged")));
    insta::assert_json_snapshot!("tune_fields", summary.as_object().unwrap().keys().collect::<Vec<_>>());
}

#[test]
fn tune_finds_a_new_gait_in_every_trial_unless_results_may_repeat() {
    let distinct = |more: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let tune = ["tune", "--muscles", "off", "--trials", "6", "--seed", "7", "--workers", "1", "--json"];
        let summary = json_of(&gaitwright(folder.path(), &[&tune[..], more].concat()));
        let rmse = |trial: &Value| trial["gait_rmse_rad"].as_f64().unwrap().to_bits();
        summary["trials"].as_array().unwrap().iter().map(rmse).collect::<HashSet<_>>().len()
    };
    assert_eq!(distinct(&[]), 6);
    assert!(distinct(&["--repeat-results"]) < 6);
}

#[test]
fn tune_takes_the_multi_start_flags_of_solve() {
    let folder = tempfile::tempdir().unwrap();
    let flags = ["--muscles", "off", "--json", "--initial-guesses", "3", "--nearest-within", "100"];
    let tuned = json_of(&gaitwright(folder.path(), &[&["tune", "--trials", "1"][..], &flags].concat()));
    let trial = &tuned["trials"][0];
    let values = trial["action"].as_object().unwrap().iter().map(|(name, value)| format!("{name}={value}"));
    let bounds = values.collect::<Vec<_>>().join(",");
    let solved = json_of(&gaitwright(folder.path(), &[&["solve", "--bounds", &bounds][..], &flags].concat()));
    assert_eq!(solved["gait_rmse_rad"], trial["gait_rmse_rad"]);

    let refused = cli::run(BINARY, folder.path(), &["tune", "--trials", "1", "--nearest-within", "101"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--nearest-within"));
}

/// Waits for a condition that another process brings about.
async fn until(what: &str, mut done: impl AsyncFnMut() -> bool) {
    for _ in 0..6000 {
        if done().await {
            return;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    panic!("{what} did not happen");
}

/// A study that differs from what the command asks for only in one part of its plan.
async fn study_in(database: &Path, change: impl FnOnce(&mut NewStudy)) -> StudyId {
    let store = Store::open(database).await.unwrap();
    let mut writer = store.write().await.unwrap();
    built_in_entries::ensure(&mut writer).await.unwrap();
    let subject = subjects::by_pseudonym(&mut writer, "paper-1").await.unwrap().unwrap();
    let mut new = NewStudy { muscles: false, number_of_trials: 2, ..NewStudy::of(subject.id) };
    change(&mut new);
    let study =
        study_plan::create(&mut writer, &gaitwright_store::audit::Actor::program(), Reach::Every, new).await.unwrap();
    commit(writer).await.unwrap();
    store.close().await;
    study.id
}

/// Ctrl-C ends a study with the usual exit code and a message on how to resume. The same command then resumes that
/// study only.
#[cfg(unix)]
#[tokio::test]
async fn tune_continues_an_interrupted_study_and_ignores_studies_of_another_kind() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("gaitwright.db");
    let of_people = study_in(&database, |new| new.answer_source = AnswerSource::People).await;
    let coarser = study_in(&database, |new| new.gait_settings.mesh.ss2 += 1).await;
    let shorter = study_in(&database, |new| new.solve_options.max_iterations = 7).await;
    let tighter = study_in(&database, |new| new.base_bounds.a1 = 19.0).await;
    let bolder = study_in(&database, |new| new.learner.preference_noise *= 2.0).await;

    let arguments = ["tune", "--muscles", "off", "--trials", "2", "--workers", "1", "--json"];
    let child =
        cli::command(BINARY, folder.path(), &arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let of_others = [of_people, coarser, shorter, tighter, bolder];
    let pool = gaitwright_store::read_only::open(&database).await.unwrap();
    let mut ours = None;
    until("a study of its own", async || {
        let mut reader = pool.acquire().await.unwrap();
        let all = studies::page(&mut reader, Reach::Every, &StudyFilter::newest(10)).await.unwrap();
        ours = all.into_iter().map(|study| study.id).find(|id| !of_others.contains(id));
        match ours {
            Some(id) => !trials::of_study(&mut reader, id).await.unwrap().is_empty(),
            None => false,
        }
    })
    .await;
    pool.close().await;
    let signalled = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(signalled.success());
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{text}");
    assert!(text.contains("run the same command again to continue"), "{text}");
    assert_eq!(json_of(&output)["state"], "running");

    let again = gaitwright(folder.path(), &arguments);
    assert!(String::from_utf8_lossy(&again.stderr).contains("continuing study"));
    let summary = json_of(&again);
    assert_eq!((&summary["study_id"], &summary["state"]), (&json!(ours.unwrap()), &json!("finished")));
    let store = Store::open(&database).await.unwrap();
    let mut reader = store.read().await.unwrap();
    for other in of_others {
        assert!(trials::of_study(&mut reader, other).await.unwrap().is_empty());
        assert_eq!(studies::get(&mut reader, other).await.unwrap().state, StudyState::Running);
    }
    drop(reader);
    store.close().await;
}

/// If a trial fails because of the program, the command fails, and still prints its results.
#[tokio::test(flavor = "multi_thread")]
async fn failed_trial_sets_the_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("gaitwright.db");
    let solver = Analytic { panics: vec![1], ..Analytic::slow(Duration::from_millis(300)) };
    let service = Service::start(&database, solver, 1).await;
    let study = service.study(|new| (new.muscles, new.number_of_trials) = (false, 2)).await;
    until("a second trial", async || service.trials(study).await.len() == 2).await;
    assert_eq!(service.trials(study).await[0].state, TrialState::Failed);
    service.stop().await;

    let output =
        cli::run(BINARY, folder.path(), &["tune", "--muscles", "off", "--trials", "2", "--workers", "1", "--json"]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("trial 1 of 2 failed: ") && text.contains("panics"), "{text}");
    assert_eq!((&json_of(&output)["study_id"], &json_of(&output)["state"]), (&json!(study), &json!("finished")));
}

/// Rows are written as they are computed, so a killed process leaves the finished rows.
#[test]
fn killed_sweep_keeps_its_rows() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let action = "a5=0.013";
    std::fs::write(folder.join("actions.csv"), cli::actions(&[action; 9])).unwrap();
    let sweep = ["sweep", "--actions", "actions.csv", "--out", "out.csv", "--workers", "1", "--max-iterations", "20"];
    let arguments = [&sweep[..], &COARSE].concat();
    let mut child = cli::command(BINARY, folder, &arguments).stderr(Stdio::null()).spawn().unwrap();
    let part = folder.join(format!(".out.csv.{}.part", child.id()));
    let rows = || std::fs::read_to_string(&part).map_or(0, |text| text.matches('\n').count());
    while rows() < 3 {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it was killed");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let text = std::fs::read_to_string(&part).unwrap();
    let start = cli::action(action) + ",";
    assert!(text.lines().skip(1).take(2).all(|row| row.starts_with(&start)), "{text}");
    assert!(!folder.join("out.csv").exists());
}

/// Runs an atlas until its progress file has this many lines, kills it, and returns the whole lines.
fn solves_of_killed_atlas(folder: &Path, workers: &str, lines: usize) -> Vec<String> {
    let atlas = ["atlas", "--out", "atlas.csv", "--workers", workers];
    let arguments = [&atlas[..], &COARSE].concat();
    let mut child = cli::command(BINARY, folder, &arguments).stderr(Stdio::null()).spawn().unwrap();
    let text = || std::fs::read_to_string(folder.join("atlas.csv.progress")).unwrap_or_default();
    while text().matches('\n').count() < lines {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it was killed");
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    text().split_inclusive('\n').filter(|line| line.ends_with('\n')).map(str::to_owned).collect()
}

#[test]
fn killed_atlas_continues_and_does_not_depend_on_the_number_of_workers() {
    let folder = tempfile::tempdir().unwrap();
    let first = solves_of_killed_atlas(folder.path(), "1", 17);
    // As if it had been killed while it wrote a line.
    let progress = folder.path().join("atlas.csv.progress");
    std::fs::write(&progress, format!("{}{{\"action\":", first.concat())).unwrap();
    let longer = solves_of_killed_atlas(folder.path(), "2", first.len() + 16);
    assert_eq!(longer[..first.len()], first);

    let other = tempfile::tempdir().unwrap();
    let at_once = solves_of_killed_atlas(other.path(), "2", longer.len().min(33));
    let same = at_once.len().min(longer.len());
    assert_eq!(at_once[..same], longer[..same]);

    let refused =
        cli::run(BINARY, folder.path(), &["atlas", "--out", "atlas.csv", "--muscles", "off", "--mesh", "2,2,3,4"]);
    let text = String::from_utf8_lossy(&refused.stderr);
    assert!(text.contains("atlas of another problem or version"), "{text}");
    assert_eq!(refused.status.code(), Some(2));
}

/// The trials of each study of a database, with the workers that solved them.
async fn workers_by_role(database: &Path) -> Vec<(AtlasRole, Vec<String>)> {
    let pool = gaitwright_store::read_only::open(database).await.unwrap();
    let mut reader = pool.acquire().await.unwrap();
    let mut found = Vec::new();
    for study in studies::page(&mut reader, Reach::Every, &StudyFilter::newest(10)).await.unwrap() {
        let mut workers = Vec::new();
        for trial in trials::of_study(&mut reader, study.id).await.unwrap() {
            let ended = attempts::of_trial(&mut reader, trial.id).await.unwrap();
            workers.extend(ended.into_iter().map(|attempt| attempt.worker));
        }
        found.push((study.plan.atlas, workers));
    }
    drop(reader);
    pool.close().await;
    found
}

/// A killed `tune --atlas` keeps its solves, and the same command continues them.
#[cfg(unix)]
#[tokio::test]
async fn killed_tune_continues_its_atlas() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, database) = (folder.path(), folder.path().join("gaitwright.db"));
    std::fs::write(folder.join("coarse.json"), r#"{"mesh": {"ds2": 2, "ds3": 2, "ss2": 3, "ss1": 3}}"#).unwrap();
    let tune = ["tune", "--atlas", "--muscles", "off", "--settings", "coarse.json", "--trials", "5", "--json"];
    let _ = study_in(&database, |new| new.answer_source = AnswerSource::People).await;
    let solves = async || {
        let studies = workers_by_role(&database).await;
        assert!(studies.iter().filter(|(role, _)| *role == AtlasRole::Make).count() <= 1, "{studies:?}");
        studies.into_iter().find(|(role, _)| *role == AtlasRole::Make).map_or(0, |(_, workers)| workers.len())
    };
    let start = || {
        let mut command = cli::command(BINARY, folder, &tune);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let mut killed = start();
    until("solves of the atlas", async || solves().await > 3).await;
    killed.kill().unwrap();
    killed.wait().unwrap();
    let kept = solves().await;
    let continued = start();
    until("more solves of the atlas", async || solves().await > kept + 3).await;
    let signalled = std::process::Command::new("kill").args(["-INT", &continued.id().to_string()]).status().unwrap();
    assert!(signalled.success());
    let output = continued.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{text}");
    assert!(text.contains("continuing study") && text.contains("of 11664 actions have a result"), "{text}");

    let service = Service::start(&database, Analytic::default(), 1).await;
    let listed = service.fetch("/api/v1/studies").await.json();
    let atlas = listed["items"].as_array().unwrap().iter().find(|study| study["atlas"] == "make").unwrap();
    let table = service.fetch(&format!("/api/v1/studies/{}/atlas.csv", atlas["id"].as_str().unwrap())).await.text;
    service.stop().await;
    let mut rows = table.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let header = rows.next().unwrap();
    let column = |name: &str| header.iter().position(|column| *column == name).unwrap();
    let values = column("objective")..column("active");
    assert_eq!(values.len(), 9);
    let rows: Vec<_> = rows.filter(|row| !row[column("gait")].is_empty()).collect();
    assert!(!rows.is_empty());
    assert!(rows.iter().all(|row| row[values.clone()].iter().all(|cell| cell.parse::<f64>().is_ok())), "{table}");
}

/// A real result with muscles, with many more iterations than solves take, beside the 1 MiB that a NATS broker takes in
/// one message unless told otherwise.
#[test]
fn broker_delivers_a_result_with_muscles() {
    let problem = GaitProblem {
        subject: Subject::builtin(1).unwrap(),
        device: Device::ampro3().unwrap(),
        bounds: TunedBounds::default(),
        muscles: true,
        settings: GaitSettings::default(),
        reference: ReferenceGait::builtin().unwrap(),
    };
    let attempt = Attempt { trial: TrialId::fresh(), number: 1 };
    let options = SolveOptions { max_iterations: 20, ..SolveOptions::default() };
    let mut order = Assignment { attempt, number: 1, problem, warm_start: None, options };
    let mut iterations = Vec::new();
    let outcome = GaitSolver.evaluate(&order, &mut |record| iterations.push(*record), &CancelToken::new()).unwrap();
    assert!(outcome.gait.domains.iter().all(|domain| domain.muscles.is_some()));
    let iterations: Vec<_> = iterations.iter().cycle().take(3000).copied().collect();
    order.warm_start = Some(outcome.warm_start.clone());
    let order = pack(&SolveOrder { program: String::new(), assignment: order }).unwrap().len();
    let result = AssignmentResult::Ended { outcome: Box::new(outcome), iterations };
    let result = pack(&ResultMessage { attempt, worker: "worker".to_owned(), result }).unwrap().len();
    eprintln!("a job takes {order} bytes, a result {result}");
    assert!(order.max(result) < 512 << 10, "a job takes {order} bytes, a result {result}");
}

#[test]
fn long_solve_of_a_gait_with_muscles_converges() {
    if long_tests_are_skipped("") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mesh = ["--mesh", "3,3,4,4", "--json"];
    let cold = json_of(&gaitwright(folder.path(), &[&["solve", "--out", "gait.json"][..], &mesh].concat()));
    assert_eq!(cold["status"], "converged");
    assert!(cold["solver_runs"].as_array().unwrap().len() >= 2, "several guesses");
    let warm = ["solve", "--warm", "gait.json", "--bounds", "a5=0.013"];
    let warm = json_of(&gaitwright(folder.path(), &[&warm[..], &mesh].concat()));
    assert_eq!((&warm["status"], &warm["started_from"]), (&json!("converged"), &json!("warm")));
}
