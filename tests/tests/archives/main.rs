//! Archives are untrusted: forgeries are refused with a reason, archives that would exhaust the memory are refused
//! early, and data that cannot be checked is marked.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod decompression_bombs;
mod forgeries;
mod rows;

use axum::http::StatusCode;
use forgeries::{FORGERIES, MORE, of_source};
use gaitwright_service::studies::archive::{self, SigningKey};
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::{Store, StudyId, now};
use gaitwright_tests::archives::{exported, import, import_trusting};
use gaitwright_tests::cli;
use gaitwright_tests::consistent_gaits::Consistent;
use gaitwright_tests::service::Service;
use rows::{Rows, framed, sha256};
use serde_json::{Value, json};
use tempfile::TempDir;

/// A study with answers of every kind, its service and its archive.
async fn study() -> (TempDir, Service, StudyId, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Consistent::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (8, AnswerSource::Both)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let good: Vec<_> = trials.iter().filter(|t| t.state.as_str() == "converged").map(|t| t.id).collect();
    for (path, body) in [
        ("preferences", json!({"trial_a": good[0], "trial_b": good[1], "answer": "b", "author": "K"})),
        ("preferences", json!({"trial_a": good[2], "trial_b": good[0], "answer": "no_difference", "author": "K"})),
        ("assessments", json!({"trial_a": good[1], "trial_b": good[2], "answer": "unsafe_a", "author": "K"})),
    ] {
        let done = service.post(&format!("/api/v1/studies/{study}/{path}"), &body).await;
        assert!(done.status.is_success(), "{path}: {}", done.text);
    }
    let given = service.fetch(&format!("/api/v1/studies/{study}/preferences")).await.items();
    let own = given.as_array().unwrap().iter().find(|row| row["author"] == "K").unwrap();
    let retract = format!("/api/v1/preferences/{}/retract", own["id"].as_str().unwrap());
    assert!(service.post(&retract, &json!({"reason": "mistyped"})).await.status.is_success());
    let file = exported(&service.store, study).await;
    (folder, service, study, file)
}

#[tokio::test]
async fn review_made_with_a_fast_clock_does_not_cover_later_reports() {
    let (folder, service, study, _) = study().await;
    let listed = format!("/api/v1/studies/{study}/safety-reports");
    let gait = service.fetch(&listed).await.items()[0]["trial_id"].as_str().unwrap().to_owned();
    let review = json!({"decision": "cleared", "reason": "seen again"});
    assert_eq!(
        service.post(&format!("/api/v1/trials/{gait}/safety-reviews"), &review).await.status,
        StatusCode::CREATED
    );
    let mut rows = Rows::of(&exported(&service.store, study).await);
    service.stop().await;
    let ahead = now().plus_seconds(500).to_string();
    for table in ["assessments", "safety_reviews"] {
        for row in rows.table(table) {
            row["created_at"] = json!(ahead);
        }
    }
    let database = folder.path().join("b.db");
    let store = Store::open(&database).await.unwrap();
    import(&store, &rows.packed()).await.unwrap();
    store.close().await;
    let other = Service::start(&database, Consistent::default(), 1).await;
    assert_eq!(other.fetch(&listed).await.items()[0]["in_force"], json!(false));
    let report = other.post(&format!("/api/v1/trials/{gait}/safety-reports"), &json!({"note": "fell"})).await;
    assert_eq!((report.status, &report.json()["in_force"]), (StatusCode::CREATED, &json!(true)), "{}", report.text);
    assert!(report.json()["created_at"].as_str().unwrap() > ahead.as_str(), "times have the order of recording");
    let file = other.fetch(&format!("/api/v1/trials/{gait}/controller.json")).await;
    assert!(file.status == StatusCode::CONFLICT && file.text.contains("reported as unsafe"), "{}", file.text);
    other.stop().await;
}

#[tokio::test]
async fn forged_archive_is_refused_with_the_wrong_row_and_changes_nothing() {
    let (folder, service, study, file) = study().await;
    service.stop().await;
    let whole = Rows::of(&file);
    let store = Store::open(&folder.path().join("b.db")).await.unwrap();
    let mut missed = Vec::new();
    for (what, forge, why) in FORGERIES.iter().chain(&MORE) {
        let mut rows = whole.clone();
        forge(&mut rows);
        match import(&store, &rows.packed()).await {
            Ok(_) => missed.push(format!("{what}: imported")),
            Err(refusal) if refusal.to_string().contains(why) => {}
            Err(refusal) => missed.push(format!("{what}: expected {why:?}: {refusal}")),
        }
    }
    assert!(missed.is_empty(), "{} of {}:\n{}", missed.len(), FORGERIES.len() + MORE.len(), missed.join("\n"));
    // Repacked without a change, the archive is accepted.
    assert_eq!(import(&store, &whole.packed()).await.unwrap(), study);
    store.close().await;
}

/// Forgeries that no rule can detect: only a signature vouches for answers.
#[tokio::test]
async fn only_a_trusted_signature_confirms_answers_and_an_unsigned_study_is_marked() {
    let (folder, service, study, file) = study().await;
    let key = SigningKey::read(&SigningKey::generate().unwrap()).unwrap();
    let (own, other) = (key.public(), SigningKey::read(&SigningKey::generate().unwrap()).unwrap().public());
    let signed = archive::export(service.store.path(), study, Vec::new(), Some(key)).await.unwrap();
    let trail = service.fetch("/api/v1/audit").await.text;
    assert!(!trail.contains("study.export"), "nobody took it through the service yet");
    assert_eq!(
        service.fetch(&format!("/api/v1/studies/{study}/imports")).await.items(),
        json!([]),
        "a study that was made here"
    );
    service.stop().await;

    let turned = |file: &[u8]| {
        let mut rows = Rows::of(file);
        let row = of_source(&mut rows, "clinician");
        let (a, b) = (row["trial_a"].clone(), row["trial_b"].clone());
        (row["trial_a"], row["trial_b"]) = (b, a);
        rows.packed()
    };
    let database = folder.path().join("b.db");
    let store = Store::open(&database).await.unwrap();
    for (what, forged, why) in [
        ("unsigned", file.clone(), "it is not signed"),
        ("turned, signature dropped", turned(&signed), "it is not signed"),
        ("turned, old signature", with_end_of(&turned(&signed), &signed), "do not match the hash at its end"),
    ] {
        let refusal = import_trusting(&store, &forged, std::slice::from_ref(&own)).await.unwrap_err().to_string();
        assert!(refusal.contains(why), "{what}: {refusal}");
    }
    let refusal = import_trusting(&store, &signed, &[other]).await.unwrap_err().to_string();
    assert!(refusal.contains(&format!("signed by {own}")), "{refusal}");
    assert_eq!(import_trusting(&store, &signed, std::slice::from_ref(&own)).await.unwrap(), study);
    store.close().await;
    drop(store);

    let other = Service::start_as_is(&folder.path().join("c.db"), Consistent::default(), 1).await;
    import(&other.store, &turned(&file)).await.unwrap();
    let from = other.fetch(&format!("/api/v1/studies/{study}/imports")).await.items();
    assert_eq!((&from[0]["signed_by"], &from[0]["trusted"]), (&Value::Null, &json!(false)));
    assert_eq!(from[0]["file_sha256"], sha256(&turned(&file)));
    let page = other.fetch(&format!("/studies/{study}")).await.text;
    assert!(page.contains("The archive is not signed") && page.contains(&sha256(&turned(&file))), "{page}");

    // A new archive has the earlier imports of the study, and the audit trail has the export.
    let answer = other.fetch_bytes(&format!("/api/v1/studies/{study}/archive")).await;
    assert_eq!(answer.0, StatusCode::OK);
    assert!(other.fetch("/api/v1/audit").await.text.contains("study.export"));
    other.stop().await;
    let again = Service::start_as_is(&folder.path().join("d.db"), Consistent::default(), 1).await;
    import(&again.store, &answer.1).await.unwrap();
    let from = again.fetch(&format!("/api/v1/studies/{study}/imports")).await.items();
    assert_eq!(from.as_array().unwrap().len(), 2);
    again.stop().await;

    // An unsigned archive does not vouch for earlier imports.
    let mut rows = Rows::of(&answer.1);
    let (earlier, key) = (rows.first("imports"), own.to_string());
    (earlier["signed_by"], earlier["trusted"]) = (json!(key), json!(1));
    let last = Service::start_as_is(&folder.path().join("e.db"), Consistent::default(), 1).await;
    import(&last.store, &rows.packed()).await.unwrap();
    let from = last.fetch(&format!("/api/v1/studies/{study}/imports")).await.items();
    for import in from.as_array().unwrap() {
        assert_eq!((&import["signed_by"], &import["trusted"]), (&Value::Null, &json!(false)), "{from}");
    }
    last.stop().await;
}

/// The rows of one archive with the last line of another.
fn with_end_of(rows: &[u8], other: &[u8]) -> Vec<u8> {
    let content = |file: &[u8]| {
        let start = file.iter().position(|byte| *byte == b'\n').unwrap() + 1;
        String::from_utf8(zstd::decode_all(&file[start..]).unwrap()).unwrap()
    };
    let (rows, other) = (content(rows), content(other));
    let kept = rows.trim_end().rsplit_once('\n').unwrap().0;
    framed(&format!("{kept}\n{}\n", other.trim_end().rsplit_once('\n').unwrap().1))
}

#[tokio::test]
async fn archive_rows_without_gait_are_counted_and_rows_with_a_wrong_hash_are_refused() {
    let (folder, service, study, file) = study().await;
    service.stop().await;
    let mut rows = Rows::of(&file);
    rows.0.retain(|(table, _)| table != "gaits");
    let other = Service::start_as_is(&folder.path().join("b.db"), Consistent::default(), 1).await;
    import(&other.store, &rows.packed()).await.unwrap();
    let from = other.fetch(&format!("/api/v1/studies/{study}/imports")).await.items();
    let converged = other.trials(study).await.iter().filter(|trial| trial.gait_rmse_rad.is_some()).count();
    assert_eq!(from[0]["unchecked_rmse"], json!(converged));
    assert!(other.fetch(&format!("/studies/{study}")).await.text.contains("could not be computed again"));
    other.stop().await;

    let start = file.iter().position(|byte| *byte == b'\n').unwrap() + 1;
    let content = String::from_utf8(zstd::decode_all(&file[start..]).unwrap()).unwrap();
    let changed = content.replacen("\"author\":\"K\"", "\"author\":\"L\"", 1);
    let store = Store::open(&folder.path().join("c.db")).await.unwrap();
    let refusal = import(&store, &framed(&changed)).await.unwrap_err().to_string();
    assert!(refusal.contains("does not match its hash"), "{refusal}");
    store.close().await;
}

#[tokio::test]
async fn archive_with_different_content_for_a_known_identifier_is_refused() {
    let (folder, service, study, file) = study().await;
    let person = service.subject().await;
    service.stop().await;
    for (table, column, value, why) in [
        (
            "subjects",
            "notes",
            json!("another"),
            format!("subject {person} exists here with different content (notes differs)"),
        ),
        (
            "devices",
            "created_at",
            json!("2020-01-01T00:00:00.000Z"),
            "exists here with different content (created_at".to_owned(),
        ),
    ] {
        let database = folder.path().join(format!("{table}.db"));
        let store = Store::open(&database).await.unwrap();
        let mut rows = Rows::of(&file);
        rows.first(table)[column] = value;
        assert_eq!(import(&store, &rows.packed()).await.unwrap(), study);
        // The same study under another identifier, with the rows as they were.
        let renamed = String::from_utf8(zstd::decode_all(&file[19..]).unwrap()).unwrap();
        let renamed = renamed.replace(&study.to_string(), "01900000-0000-7000-8000-000000000009");
        let refusal = import(&store, &Rows::of(&framed(&renamed)).packed()).await.unwrap_err().to_string();
        assert!(refusal.contains(&why) && refusal.contains("nothing was changed"), "{refusal}");
        store.close().await;
    }
}

#[tokio::test]
async fn study_of_a_built_in_subject_is_imported_into_a_record_with_that_subject() {
    let (folder, service, study, file) = study().await;
    let there = service.subject().await;
    let name = service.get(study).await.plan.name;
    service.stop().await;
    let other = Service::start(&folder.path().join("b.db"), Consistent::default(), 1).await;
    let here = other.subject().await;
    assert_ne!(here, there);
    let mut rows = Rows::of(&file);
    rows.first("subjects")["notes"] = json!("another person");
    let refusal = import(&other.store, &rows.packed()).await.unwrap_err().to_string();
    assert!(refusal.contains("has the name \"paper-"), "{refusal}");
    other.study(|new| (new.number_of_trials, new.name) = (1, Some(name.to_uppercase()))).await;
    assert_eq!(import(&other.store, &file).await.unwrap(), study);
    let imported = other.get(study).await.plan;
    assert_eq!((imported.subject_id, imported.name), (here, format!("{name} (2)")), "names stay unique");
    other.stop().await;
}

#[tokio::test]
async fn row_changed_by_another_program_is_not_exported() {
    let (_folder, service, study, _) = study().await;
    let path = service.store.path().to_owned();
    service.stop().await;
    let options = sqlx::sqlite::SqliteConnectOptions::new().filename(&path);
    let pool = sqlx::SqlitePool::connect_with(options).await.unwrap();
    sqlx::query("update subjects set notes = 'forged'").execute(&pool).await.unwrap();
    pool.close().await;
    let refusal = archive::export(&path, study, Vec::new(), None).await.unwrap_err().to_string();
    assert!(refusal.contains("a row of subjects was changed outside the program"), "{refusal}");
}

#[tokio::test]
async fn command_line_signs_archives_and_checks_trusted_keys() {
    let (folder, service, study, _) = study().await;
    service.stop().await;
    let run = |arguments: &[&str]| {
        let output = cli::run(env!("CARGO_BIN_EXE_gaitwright-cli"), folder.path(), arguments);
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let (code, key, _) = run(&["signing-key", "key"]);
    assert_eq!((code, key.len()), (Some(0), 64));
    assert_eq!(run(&["signing-key", "key"]).0, Some(2), "a key is never written over");
    let study = study.to_string();
    let export = ["export", &study, "signed.gait", "--database", "a.db", "--sign", "key"];
    assert_eq!(run(&export).0, Some(0));
    assert_eq!(run(&["export", &study, "plain.gait", "--database", "a.db"]).0, Some(0));
    let (code, _, text) = run(&["import", "plain.gait", "--database", "b.db", "--trust", &key]);
    assert!(code == Some(2) && text.contains("it is not signed"), "{text}");
    assert!(!folder.path().join("b.db").exists(), "what is refused makes no record");
    assert_eq!(run(&["import", "signed.gait", "--database", "b.db", "--trust", &key]).1, study);
    #[cfg(unix)]
    for file in ["key", "signed.gait"] {
        let mode = std::os::unix::fs::MetadataExt::mode(&std::fs::metadata(folder.path().join(file)).unwrap());
        assert_eq!(mode & 0o777, 0o600, "{file}");
    }
}
