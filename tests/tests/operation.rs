//! Running the service: archives, retention, migrations, metrics, HTTPS, restore.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Request, StatusCode};
use gait_optimizer::SolveStatus;
use gaitwright_service::studies::archive::archive_file::read_through;
use gaitwright_service::studies::pruning::prune;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::walkable::{self, NotWalkable};
use gaitwright_store::audit::Actor;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_store::{Store, certificates, commit, explanations, gaits, members, read_only, studies};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::archives::{exported, import};
use gaitwright_tests::certified::certificate;
use gaitwright_tests::consistent_gaits::Consistent;
use gaitwright_tests::explained::explanation;
use gaitwright_tests::service::Service;
use http_body_util::BodyExt;
use serde_json::json;
use sqlx::sqlite::SqliteConnectOptions;
use std::path::Path;
use std::process::Command;
use tower::ServiceExt;

async fn posterior(service: &Service, study: gaitwright_store::StudyId) -> Vec<(u64, u64)> {
    let mut reader = service.store.read().await.unwrap();
    let study = studies::get(&mut reader, study).await.unwrap();
    let snapshot = StudySnapshot::read(&mut reader, study).await.unwrap();
    let plan = &snapshot.study.plan;
    let posterior = gait_learner::posterior(&plan.search_space, &snapshot.log(), &plan.learner).unwrap();
    let mean = |trial: &gaitwright_store::trials::Trial| posterior.mean(trial.action_index).unwrap().to_bits();
    snapshot.trials.iter().map(|trial| (trial.action_index.0, mean(trial))).collect()
}

#[tokio::test]
async fn exported_study_gives_the_same_posterior_in_another_record() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Consistent::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (12, AnswerSource::Both)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let converged: Vec<_> =
        trials.iter().filter(|t| t.gait_rmse_rad.is_some() && t.state.as_str() == "converged").collect();
    let answer = json!({"trial_a": converged[0].id, "trial_b": converged[1].id, "answer": "b", "author": "K"});
    let given = service.post(&format!("/api/v1/studies/{study}/preferences"), &answer).await.json();
    let retract = format!("/api/v1/preferences/{}/retract", given["id"].as_str().unwrap());
    assert_eq!(service.post(&retract, &json!({"reason": "mistyped"})).await.status, StatusCode::OK);
    let answer =
        json!({"trial_a": converged[2].id, "trial_b": converged[0].id, "answer": "no_difference", "author": "K"});
    service.post(&format!("/api/v1/studies/{study}/preferences"), &answer).await;
    let expected = posterior(&service, study).await;
    let certified = converged[0].id;
    let mut writer = service.store.write().await.unwrap();
    assert!(certificates::find(&mut writer, certified).await.unwrap().is_some());
    let explained = converged[1].id;
    let why = explanation(&converged[1].action, SolveStatus::Infeasible, &[]);
    assert!(explanations::request(&mut writer, explained, &Actor::program()).await.unwrap());
    assert!(explanations::insert(&mut writer, explained, "{}", &why).await.unwrap());
    commit(writer).await.unwrap();
    let file = exported(&service.store, study).await;

    // A second record with its own rows.
    let other = Service::start(&folder.path().join("b.db"), Consistent::default(), 1).await;
    let own = other.study(|new| (new.number_of_trials, new.seed) = (3, 5)).await;
    other.wait_for(own, &[StudyState::Finished]).await;
    assert_eq!(import(&other.store, &file).await.unwrap(), study, "its subject is the built-in one there");
    assert_eq!(posterior(&other, study).await, expected);
    other.stop().await;

    let fresh = Store::open(&folder.path().join("c.db")).await.unwrap();
    assert_eq!(import(&fresh, &file).await.unwrap(), study);
    assert!(import(&fresh, &file).await.unwrap_err().to_string().contains("already"));
    for place in [30, file.len() / 2, file.len() - 1] {
        let mut changed = file.clone();
        changed[place] ^= 1;
        assert!(read_through(&changed[..]).is_err(), "byte {place}");
    }
    assert!(read_through(&file[..file.len() - 7]).is_err());
    assert!(read_through(&b""[..]).is_err());
    let mut reader = fresh.read().await.unwrap();
    // Certificates and explanations are not imported, because the service can compute them again.
    assert_eq!(certificates::find(&mut reader, certified).await.unwrap(), None);
    assert_eq!(explanations::find(&mut reader, explained).await.unwrap(), None);
    assert!(explanations::is_requested(&mut reader, explained).await.unwrap());
    drop(reader);
    fresh.close().await;
    drop(fresh);
    let again = Service::start_as_is(&folder.path().join("c.db"), Consistent::default(), 1).await;
    assert_eq!(posterior(&again, study).await, expected);
    for path in ["trials", "preferences", "history"] {
        let path = format!("/api/v1/studies/{study}/{path}");
        assert_eq!(service.fetch(&path).await.text, again.fetch(&path).await.text, "{path}");
    }
    again.stop().await;
    service.stop().await;
}

#[tokio::test]
async fn prune_drops_old_trajectories_and_keeps_the_best() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start_without_certificates(&database, Analytic::default()).await;
    let study = service.study(|new| new.number_of_trials = 6).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    assert_eq!(prune(&mut service.store.clone(), 1).await.unwrap(), 0, "it ended just now");
    let mut kept = 0;
    for trial in service.trials(study).await {
        kept += u32::from(gaits::get(&mut service.store.read().await.unwrap(), trial.id).await.is_ok());
    }
    assert_eq!(kept, 6);
    tokio::time::sleep(std::time::Duration::from_millis(5)).await;
    assert_eq!(
        prune(&mut service.store.clone(), 0).await.unwrap(),
        0,
        "each may still be the best that passes its certificate"
    );
    let trials = service.trials(study).await;
    let measured = trials.iter().filter(|trial| trial.gait_rmse_rad.is_some());
    let best = measured.min_by(|a, b| a.gait_rmse_rad.partial_cmp(&b.gait_rmse_rad).unwrap()).unwrap().id;
    let mut writer = service.store.write().await.unwrap();
    certificates::insert(&mut writer, best, &certificate(true)).await.unwrap();
    commit(writer).await.unwrap();
    // Its warm start is kept, so its problem can be solved again.
    let started_from =
        service.trials(study).await.into_iter().find(|trial| trial.id == best).unwrap().warm_started_from;
    assert_eq!(prune(&mut service.store.clone(), 0).await.unwrap(), 5 - u64::from(started_from.is_some()));
    let mut reader = service.store.read().await.unwrap();
    assert!(gaits::get(&mut reader, best).await.is_ok());
    // A pruned gait cannot be certified, so it is not walkable.
    let mut dropped = 0;
    for trial in trials.iter().filter(|trial| trial.id != best && trial.state == TrialState::Converged) {
        if gaits::find(&mut reader, trial.id).await.unwrap().is_none() {
            let found = walkable::admit(&mut reader, trial.id).await.unwrap();
            assert_eq!(found, Err(NotWalkable::Pruned { number: trial.number }));
            dropped += 1;
        }
    }
    assert!(dropped > 0);
    drop(reader);
    service.stop().await;
}

#[tokio::test]
async fn metrics_count_requests_by_route() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 2).await;
    let study = service.study(|new| new.number_of_trials = 2).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let text = service.fetch("/metrics").await.text;
    assert!(text.contains("gaitwright_studies{state=\"finished\"} 1"), "{text}");
    assert!(text.contains("gaitwright_workers 2"), "{text}");
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let value = line.rsplit(' ').next().unwrap();
        assert!(value.parse::<f64>().is_ok(), "{line}");
    }
    let router = service.router();
    let send = async |method: &str, path: &str| {
        let request = Request::builder().method(method).uri(path).body(Body::empty()).unwrap();
        router.clone().oneshot(request).await.unwrap().into_body().collect().await.unwrap().to_bytes()
    };
    for number in 0..3 {
        send(&format!("INVENTED{number}"), "/health").await;
    }
    let text = String::from_utf8(send("GET", "/metrics").await.to_vec()).unwrap();
    assert!(text.contains("method=\"other\"") && !text.contains("INVENTED"), "{text}");
    assert_eq!(service.fetch("/ready").await.status, StatusCode::OK);
    service.scheduler.stop();
    assert_eq!(service.fetch("/ready").await.status, StatusCode::SERVICE_UNAVAILABLE);
}

fn gaitwright(folder: &Path, arguments: &[&str]) -> (bool, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gaitwright-cli"));
    // The program would report the switches of the tests as unknown settings.
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("GAITWRIGHT_")) {
        command.env_remove(name);
    }
    let output = command.args(arguments).current_dir(folder).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output.status.success(), text)
}

#[tokio::test]
async fn restore_keeps_the_present_record_beside_the_backup() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("gaitwright.db");
    let service = Service::start(&database, Analytic::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 4).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let before = service.fetch(&format!("/api/v1/studies/{study}/trials")).await.text;
    let (done, text) = gaitwright(folder.path(), &["backup", "copy.db"]);
    assert!(done, "{text}");
    let (done, text) = gaitwright(folder.path(), &["restore", "copy.db"]);
    assert!(!done && text.contains("in use by another Gaitwright process"), "{text}");
    let later = service.study(|new| new.number_of_trials = 1).await;
    service.wait_for(later, &[StudyState::Finished]).await;
    service.stop().await;

    let (done, text) = gaitwright(folder.path(), &["restore", "copy.db"]);
    assert!(done, "{text}");
    let kept = std::fs::read_dir(folder.path())
        .unwrap()
        .flatten()
        .any(|file| file.file_name().to_string_lossy().contains("before-"));
    assert!(kept, "the record that was replaced is kept");
    let (done, text) = gaitwright(folder.path(), &["audit", "verify"]);
    assert!(done && text.contains("intact"), "{text}");
    let service = Service::start(&database, Analytic::default(), 1).await;
    assert_eq!(service.fetch(&format!("/api/v1/studies/{study}/trials")).await.text, before);
    assert_eq!(service.fetch(&format!("/api/v1/studies/{later}")).await.status, StatusCode::NOT_FOUND);
    service.stop().await;
}

/// How many studies a file holds.
async fn studies_in(file: &Path) -> usize {
    let pool = read_only::open(file).await.unwrap();
    let rows = sqlx::query("select 1 from studies").fetch_all(&pool).await.unwrap();
    pool.close().await;
    rows.len()
}

#[tokio::test]
async fn restore_replaces_a_damaged_or_newer_record_and_keeps_it() {
    let folder = tempfile::tempdir().unwrap();
    let (database, copy) = (folder.path().join("gaitwright.db"), folder.path().join("copy.db"));
    let service = Service::start(&copy, Analytic::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 2).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    service.stop().await;

    std::fs::write(&database, "was a record once").unwrap();
    std::fs::write(folder.path().join("gaitwright.db-wal"), "and its log").unwrap();
    let mut kept = Vec::new();
    for _ in 0..3 {
        let (done, text) = gaitwright(folder.path(), &["restore", "copy.db"]);
        assert!(done, "{text}");
        kept.push(text.lines().next().unwrap().rsplit(' ').next().unwrap().to_owned());
        assert_eq!(studies_in(&database).await, 1);
    }
    assert!(kept[0] != kept[1] && kept[1] != kept[2] && kept[0] != kept[2], "{kept:?}");
    assert_eq!(std::fs::read(folder.path().join(&kept[0])).unwrap(), b"was a record once");
    assert_eq!(std::fs::read(folder.path().join(format!("{}-wal", kept[0]))).unwrap(), b"and its log");

    let pool = sqlx::SqlitePool::connect_with(SqliteConnectOptions::new().filename(&database)).await.unwrap();
    let newer = "insert into _sqlx_migrations select 9999, 'later', installed_on, 1, checksum, 0 from _sqlx_migrations \
                 where version = 1";
    sqlx::query(newer).execute(&pool).await.unwrap();
    pool.close().await;
    let (done, text) = gaitwright(folder.path(), &["restore", "copy.db"]);
    assert!(done, "{text}");
    let (done, text) = gaitwright(folder.path(), &["audit", "verify"]);
    assert!(done && text.matches("intact: ").count() == 2, "{text}");
}

#[tokio::test]
async fn restore_includes_the_log_of_the_backup() {
    let folder = tempfile::tempdir().unwrap();
    let live = folder.path().join("live.db");
    let service = Service::start(&live, Analytic::default(), 1).await;
    service.study(|new| (new.number_of_trials, new.start) = (2, false)).await;
    // A copy by hand, which is not recommended, but together with the log.
    for ending in ["", "-wal"] {
        std::fs::copy(folder.path().join(format!("live.db{ending}")), folder.path().join(format!("copy.db{ending}")))
            .unwrap();
    }
    service.stop().await;
    let (done, text) = gaitwright(folder.path(), &["restore", "copy.db"]);
    assert!(done, "{text}");
    assert_eq!(studies_in(&folder.path().join("gaitwright.db")).await, 1);
}

#[tokio::test]
async fn record_with_a_hard_link_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    Service::start(&database, Analytic::default(), 1).await.stop().await;
    std::fs::hard_link(&database, folder.path().join("b.db")).unwrap();
    for name in ["a.db", "b.db"] {
        let refused = Store::open(&folder.path().join(name)).await.unwrap_err().to_string();
        assert!(refused.contains("has other hard links"), "{refused}");
    }
    std::fs::remove_file(folder.path().join("b.db")).unwrap();
    Store::open(&database).await.unwrap().close().await;
}

#[tokio::test]
async fn config_shows_the_origin_of_each_value() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("gaitwright.toml"), "idle_minutes = 15\n").unwrap();
    let (done, text) = gaitwright(folder.path(), &["config", "show", "--workers", "3"]);
    assert!(done, "{text}");
    assert!(text.contains("idle_minutes = \"15\"  # file gaitwright.toml"), "{text}");
    assert!(text.contains("workers = \"3\"  # flag"), "{text}");
    assert!(text.contains("listen = \"127.0.0.1:8080\"  # default"), "{text}");
    std::fs::write(folder.path().join("gaitwright.toml"), "colour = 3\n").unwrap();
    let (done, text) = gaitwright(folder.path(), &["config", "show"]);
    assert!(!done && text.contains("colour is not a setting"), "{text}");
}

#[tokio::test]
async fn every_command_reads_record_and_second_anchor_from_the_settings_file() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| gaitwright(folder.path(), arguments);
    let verified = || run(&["audit", "verify"]);
    let write = |name: &str| {
        std::fs::write(folder.path().join(name), "database = \"a.db\"\nanchor = \"b.anchor\"\n").unwrap();
    };
    write("gaitwright.toml");
    let database = folder.path().join("a.db");
    Service::start(&database, Analytic::default(), 1).await.stop().await;
    let store = Store::open(&database).await.unwrap();
    let mut writer = store.write().await.unwrap();
    gaitwright_service::access::user_administration::operator_administrator(&mut writer).await.unwrap();
    commit(writer).await.unwrap();
    store.close().await;
    let (done, text) = verified();
    assert!(!done && text.contains("b.anchor"), "a second anchor that is missing: {text}");

    // Opens the record with the second anchor, and thereby creates it.
    let (done, text) = run(&["users", "list"]);
    assert!(done && text.contains("admin"), "{text}");
    let (done, text) = verified();
    assert!(done && text.contains("complete according to anchor b.anchor"), "{text}");
    let (done, text) = run(&["backup", "copy.db"]);
    assert!(done, "{text}");
    let (done, text) = run(&["users", "link", "admin"]);
    assert!(done && text.contains("/sign-in/"), "{text}");
    assert!(verified().0);

    // An earlier state in its place is noticed by the second anchor alone.
    std::fs::remove_file(folder.path().join("a.db.anchor")).unwrap();
    for ending in ["-wal", "-shm"] {
        let _ = std::fs::remove_file(folder.path().join(format!("a.db{ending}")));
    }
    std::fs::copy(folder.path().join("copy.db"), &database).unwrap();
    for arguments in [&["audit", "verify"][..], &["users", "list"], &["prune", "--older-than-days", "1"]] {
        let (done, text) = run(arguments);
        assert!(!done && text.contains("its anchor b.anchor"), "{arguments:?}: {text}");
    }
    let (done, text) = run(&["audit", "verify", "--database", "copy.db", "--anchor", ""]);
    assert!(done, "{text}");
    let (done, text) = run(&["restore", "copy.db"]);
    assert!(done, "{text}");
    assert!(verified().0);

    std::fs::rename(folder.path().join("gaitwright.toml"), folder.path().join("other.toml")).unwrap();
    let (done, text) = verified();
    assert!(!done && text.contains("gaitwright.db"), "{text}");
    let (done, text) = run(&["audit", "verify", "--config", "other.toml"]);
    assert!(done && text.contains("complete according to anchor b.anchor"), "{text}");
}

#[test]
fn anchor_in_a_folder_that_does_not_exist_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let serve = ["serve", "--no-sign-in", "--listen", "127.0.0.1:0", "--anchor", "other disk/b.anchor"];
    let (done, text) = gaitwright(folder.path(), &serve);
    assert!(!done && text.contains("There is no folder other disk for the anchor other disk/b.anchor."), "{text}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing was created");
}

#[tokio::test]
async fn restricted_study_stays_restricted_after_import() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Consistent::default(), 1).await;
    let restricted = service.study(|new| (new.number_of_trials, new.restricted) = (2, true)).await;
    let open = service.study(|new| new.number_of_trials = 2).await;
    for study in [restricted, open] {
        service.wait_for(study, &[StudyState::Finished]).await;
    }
    for study in [restricted, open] {
        let elsewhere = Store::open(&folder.path().join(format!("{study}.db"))).await.unwrap();
        assert_eq!(import(&elsewhere, &exported(&service.store, study).await).await.unwrap(), study);
        let found = members::is_restricted(&mut elsewhere.read().await.unwrap(), study).await.unwrap();
        assert_eq!(found, study == restricted);
        elsewhere.close().await;
    }
    service.stop().await;
}
