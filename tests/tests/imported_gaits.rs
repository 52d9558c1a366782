//! Which gaits of an imported study may be walked with. Nobody vouches for an archive without a trusted signature, so
//! only a certificate made here opens one of its gaits, and safety reports given here apply to it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright_service::studies::archive::{self, SigningKey};
use gaitwright_service::studies::walkable::{self, Certified, NotWalkable};
use gaitwright_store::studies::{Evaluation, StudyState};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{Store, StudyId, TrialId, certificates, commit, gaits, trials};
use gaitwright_tests::archives::{exported, import, import_trusting};
use gaitwright_tests::certified::certificate;
use gaitwright_tests::consistent_gaits::Consistent;
use gaitwright_tests::scripted;
use gaitwright_tests::service::Service;
use serde_json::json;
use std::path::Path;

async fn converged(store: &Store, study: StudyId) -> Vec<Trial> {
    let mut found = trials::of_study(&mut store.read().await.unwrap(), study).await.unwrap();
    found.retain(|trial| trial.state == TrialState::Converged);
    found
}

/// The two records into which a study is imported: from an unsigned archive, and from one with a trusted signature.
async fn imported(folder: &Path, from: &Store, study: StudyId) -> [Store; 2] {
    let key = SigningKey::read(&SigningKey::generate().unwrap()).unwrap();
    let trusted = [key.public()];
    let unsigned = Store::open(&folder.join("unsigned.db")).await.unwrap();
    import(&unsigned, &exported(from, study).await).await.unwrap();
    let signed = Store::open(&folder.join("signed.db")).await.unwrap();
    let file = archive::export(from.path(), study, Vec::new(), Some(key)).await.unwrap();
    import_trusting(&signed, &file, &trusted).await.unwrap();
    [unsigned, signed]
}

async fn certify(store: &Store, trial: &Trial, passed: bool) {
    let mut writer = store.write().await.unwrap();
    certificates::insert(&mut writer, trial.id, &certificate(passed)).await.unwrap();
    commit(writer).await.unwrap();
}

async fn admitted(store: &Store, trial: TrialId) -> Result<Certified, NotWalkable> {
    let found = walkable::admit(&mut store.read().await.unwrap(), trial).await.unwrap();
    found.map(|gait| gait.certified())
}

#[tokio::test]
async fn gait_of_an_untrusted_archive_is_walkable_only_after_its_certificate_passed() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Consistent::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 6).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let [unsigned, signed] = imported(folder.path(), &service.store, study).await;
    service.stop().await;
    let trials = converged(&unsigned, study).await;
    for store in [&unsigned, &signed] {
        let closed = admitted(store, trials[0].id).await;
        assert!(matches!(closed, Err(NotWalkable::NotCertified { .. })), "{closed:?}");
        certify(store, &trials[0], true).await;
        certify(store, &trials[1], false).await;
        assert_eq!(admitted(store, trials[0].id).await, Ok(Certified::Passed));
    }
    let number = trials[1].number;
    assert_eq!(admitted(&unsigned, trials[1].id).await, Err(NotWalkable::Unconfirmed { number }));
    assert_eq!(admitted(&signed, trials[1].id).await, Ok(Certified::Failed));
    unsigned.close().await;
    signed.close().await;
}

#[tokio::test]
async fn lab_script_trial_is_walkable_only_if_its_archive_has_a_trusted_signature() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Consistent::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.evaluation) = (2, Evaluation::Script)).await;
    let trial = scripted::trial(&service, study).await;
    let [unsigned, signed] = imported(folder.path(), &service.store, study).await;
    service.stop().await;
    let number = trial.number;
    assert_eq!(admitted(&unsigned, trial.id).await, Err(NotWalkable::Unconfirmed { number }));
    assert_eq!(admitted(&signed, trial.id).await, Ok(Certified::ByLab));
    unsigned.close().await;
    signed.close().await;
}

#[tokio::test]
async fn imported_trial_without_its_gait_is_not_walkable() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Consistent::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let mut writer = service.store.write().await.unwrap();
    assert!(gaits::drop_of_study(&mut writer, study, &[]).await.unwrap() > 0);
    commit(writer).await.unwrap();
    let records = imported(folder.path(), &service.store, study).await;
    service.stop().await;
    for store in records {
        for Trial { id, number, .. } in converged(&store, study).await {
            assert_eq!(admitted(&store, id).await, Err(NotWalkable::Pruned { number }));
        }
        store.close().await;
    }
}

#[tokio::test]
async fn report_covers_the_same_motion_in_an_imported_study() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Consistent::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 6).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let clone = service.post(&format!("/api/v1/studies/{study}/clone"), &json!({"start": true})).await.json();
    let clone: StudyId = clone["id"].as_str().unwrap().parse().unwrap();
    service.wait_for(clone, &[StudyState::Finished]).await;
    let files = [exported(&service.store, study).await, exported(&service.store, clone).await];
    service.stop().await;

    let other = Service::start_as_is(&folder.path().join("b.db"), Consistent::default(), 1).await;
    import(&other.store, &files[0]).await.unwrap();
    let reported = converged(&other.store, study).await.remove(0);
    let report = format!("/api/v1/trials/{}/safety-reports", reported.id);
    assert_eq!(other.post(&report, &json!({"note": "stumbled"})).await.status, StatusCode::CREATED);
    import(&other.store, &files[1]).await.unwrap();
    let twin = converged(&other.store, clone).await.into_iter().find(|trial| trial.action == reported.action).unwrap();
    let closed = admitted(&other.store, twin.id).await;
    assert!(matches!(closed, Err(NotWalkable::SameGaitReportedUnsafe { .. })), "{closed:?}");
    other.stop().await;
}
