//! The recommendation of a study, and the certificate of the recommended gait.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_learner::{Agreement, SearchSpace, posterior};
use gait_optimizer::{Gait, TunedBounds};
use gaitwright_service::studies::analysis::{Analyses, Analysis};
use gaitwright_service::studies::identical_gaits::is_same_gait;
use gaitwright_service::studies::pruning::prune;
use gaitwright_service::studies::recommended_trial::ranking_to_show;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::study_plan::NewStudy;
use gaitwright_service::studies::utility_history::UtilityPoint;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::feedback::Source;
use gaitwright_store::gaits;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_store::{StudyId, TrialId, certificates, commit};
use gaitwright_tests::analytic::{Analytic, inactive_bound};
use gaitwright_tests::certified::{Verdicts, certificate};
use gaitwright_tests::large;
use gaitwright_tests::service::Service;
use gaitwright_tests::users;
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Duration;

async fn certified(service: &Service, trial: TrialId, passed: bool) {
    let mut writer = service.store.write().await.unwrap();
    assert!(certificates::insert(&mut writer, trial, &certificate(passed)).await.unwrap());
    commit(writer).await.unwrap();
}

async fn recommendation(service: &Service, study: StudyId) -> Value {
    let answer = service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await;
    assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
    answer.json()
}

#[tokio::test]
async fn recommendation_of_a_study_with_many_answers_does_not_wait_for_the_posterior() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start(&database, Analytic::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    for trial in service.trials(study).await {
        if trial.state == TrialState::Converged {
            let mut writer = service.store.write().await.unwrap();
            // The service may have certified it already.
            certificates::insert(&mut writer, trial.id, &certificate(true)).await.unwrap();
            commit(writer).await.unwrap();
        }
    }
    let entries = u32::try_from(service.feedback(study).await.len()).unwrap();
    let paths = ["recommendation", "history"].map(|list| format!("/api/v1/studies/{study}/{list}"));
    service.stop().await;
    // At the limit, every request waits; one answer more, and none does.
    for (answers, waits) in [(1500 - entries, true), (1, false)] {
        large::answer_often(&database, study, answers).await;
        let service = Service::start(&database, Analytic::default(), 1).await;
        let computed = service.scheduler.analyses().computed();
        for path in &paths {
            assert_eq!(service.fetch(path).await.status, StatusCode::OK);
        }
        assert_eq!(service.scheduler.analyses().computed() > computed, waits);
        let newest = service.trials(study).await.pop().unwrap();
        if !waits {
            let best = json!(newest.best_before);
            assert_eq!(recommendation(&service, study).await["trial_id"], best, "the last known best trial");
            assert_eq!(service.scheduler.analyses().computed(), computed, "no posterior was computed");
        }
        service.stop().await;
    }
}

#[tokio::test]
async fn study_without_a_gait_has_no_recommendation() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let without_gait = TunedBounds::parse("a5=0.039,a6=0").unwrap();
    let space = json!({"dimensions": [{"name": "a1", "values": [15.0, 20.0], "lengthscale": 5.0}]});
    let space: SearchSpace = serde_json::from_value(space).unwrap();
    let plan = |new: &mut NewStudy| {
        (new.base_bounds, new.search_space, new.number_of_trials) = (without_gait, Some(space.clone().into()), 2);
    };
    let study = service.study(plan).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    assert_eq!(trials.len(), 2);
    assert!(trials.iter().all(|trial| trial.state == TrialState::NotConverged));
    assert_eq!(ranked(&service, study).await, []);
    let api = format!("/api/v1/studies/{study}");
    assert_eq!(service.fetch(&format!("{api}/history")).await.items(), json!([]));
    assert_eq!(service.fetch(&format!("{api}/recommendation")).await.status, StatusCode::CONFLICT);
    let page = service.fetch(&format!("/studies/{study}")).await.text;
    assert!(!page.contains("data-best") && !page.contains(">recommended<"), "{page}");
    // The values of a last iterate are not those of a gait.
    assert!(trials.iter().all(|trial| trial.report.is_some() && trial.gait_rmse_rad.is_none()), "{trials:?}");
    let table = service.fetch(&format!("{api}/trials.csv")).await.text;
    let column = table.lines().next().unwrap().split(',').position(|name| name == "gait_rmse_rad").unwrap();
    assert_eq!(table.lines().count(), 1 + trials.len(), "{table}");
    assert!(table.lines().skip(1).all(|line| line.split(',').nth(column) == Some("")), "{table}");
    let rmse = format!("{:.4}", trials[0].report.as_ref().unwrap().gait_rmse_rad);
    for page in [format!("/studies/{study}?sort=gait_rmse_rad"), format!("/trials/{}", trials[0].id), "/".to_owned()] {
        let shown = service.fetch(&page).await.text;
        assert!(!shown.contains(&rmse), "{page}: {shown}");
    }
    service.stop().await;
}

#[tokio::test]
async fn recommendation_states_a_failed_certificate() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start_without_certificates(&folder.path().join("a.db"), Analytic::default()).await;
    let study = service.study(|new| new.number_of_trials = 6).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let page = format!("/studies/{study}");

    let best = ranked(&service, study).await[0];
    for file in ["recommendation", "recommendation.csv"] {
        let refused = service.fetch(&format!("/api/v1/studies/{study}/{file}")).await;
        assert_eq!(refused.status, StatusCode::CONFLICT, "{}", refused.text);
        assert!(refused.text.contains(&format!("POST /api/v1/trials/{best}/certificate")), "{}", refused.text);
    }
    assert!(service.fetch(&page).await.text.contains("This gait has no certificate yet"));

    certified(&service, best, false).await;
    let failed = recommendation(&service, study).await;
    assert_eq!(failed["trial_id"], json!(best), "the learner's answer is the same");
    assert_eq!(failed["certificate"], "failed");
    assert_eq!((&failed["failures"], &failed["passing"]), (&json!(["the simulated walker falls"]), &Value::Null));
    let shown = service.fetch(&page).await.text;
    assert!(shown.contains("This gait failed") && shown.contains("the simulated walker falls"), "{shown}");
    assert!(shown.contains("The next-best gait has no certificate"), "{shown}");
    assert!(
        service.fetch(&format!("/trials/{best}")).await.text.contains("Read the reasons before anyone walks with it")
    );
    let table = service.fetch(&format!("/api/v1/studies/{study}/recommendation.csv")).await.text;
    assert!(table.starts_with("bound,side,value,unit,limits,certificate_of_the_gait\n"), "{table}");
    assert_eq!(table.matches(",failed\n").count(), 8, "{table}");

    let other = service.trials(study).await.into_iter().find(|trial| trial.id != best && trial.state.is_result());
    let other = other.unwrap();
    certified(&service, other.id, true).await;
    let passing = &recommendation(&service, study).await["passing"];
    assert_eq!((&passing["trial_id"], &passing["number"]), (&json!(other.id), &json!(other.number)));
    assert_eq!(passing["bounds"], json!(other.action));
    let shown = service.fetch(&page).await.text;
    assert!(shown.contains(&format!("passed: <a href=\"/trials/{}\">trial {}</a>", other.id, other.number)), "{shown}");
    service.stop().await;
}

#[tokio::test]
async fn recommendation_states_a_passed_certificate() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start_without_certificates(&folder.path().join("a.db"), Analytic::default()).await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let best = ranked(&service, study).await[0];
    certified(&service, best, true).await;
    let passed = recommendation(&service, study).await;
    assert_eq!((&passed["certificate"], &passed["passing"]), (&json!("passed"), &Value::Null));
    assert!(service.fetch(&format!("/studies/{study}")).await.text.contains("This gait passed"));
    service.stop().await;
}

/// A certifier that takes some time and passes only the gait of these bounds.
fn only(bounds: Option<TunedBounds>) -> Verdicts<impl Fn(&Gait) -> bool> {
    Verdicts { pause: Duration::from_millis(200), passes: move |gait: &Gait| Some(gait.bounds) == bounds }
}

/// The recommendation after all certifications have ended.
async fn settled(service: &Service, study: StudyId) -> Value {
    for _ in 0..1000 {
        let found = service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await;
        if found.status == StatusCode::OK && found.json()["certifying"] == json!(false) {
            return found.json();
        }
        assert!(found.status == StatusCode::OK || found.text.contains("being certified"), "{}", found.text);
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    panic!("the gaits are not certified");
}

async fn ranked(service: &Service, study: StudyId) -> Vec<TrialId> {
    let study = service.get(study).await;
    let snapshot = StudySnapshot::read(&mut service.store.read().await.unwrap(), study).await.unwrap();
    let rank = service.store.clone().compute(move |pool| ranking_to_show(pool, &snapshot, &Analyses::default())).await;
    rank.unwrap().unwrap()
}

/// The trials whose gaits the service certified by itself, in order.
async fn certified_by_service(service: &Service) -> Vec<String> {
    let mut trail = audit::page(&mut service.store.read().await.unwrap(), "", None, 1000).await.unwrap();
    trail.retain(|row| row.change == "trial.certify" && row.actor == Actor::program().as_str());
    trail.iter().rev().map(|row| row.object.clone()).collect()
}

#[tokio::test]
async fn ended_study_certifies_its_ten_best_gaits_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start_certifying(&folder.path().join("a.db"), Analytic::default(), only(None)).await;
    let study = service.study(|new| new.number_of_trials = 20).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let early = service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await;
    assert!(early.status == StatusCode::CONFLICT && early.text.contains("being certified"), "{}", early.text);
    assert!(service.fetch(&format!("/studies/{study}")).await.text.contains("being certified"));

    let found = settled(&service, study).await;
    assert_eq!((&found["certificate"], &found["passing"]), (&json!("failed"), &Value::Null));
    let best = ranked(&service, study).await;
    assert!(best.len() > 10);
    let expected: Vec<String> = best[..10].iter().map(|trial| format!("trial {trial}")).collect();
    assert_eq!(certified_by_service(&service).await, expected);
    service.stop().await;
}

#[tokio::test]
async fn studies_that_ended_before_a_restart_are_certified_until_one_gait_passes() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start_without_certificates(&database, Analytic::default()).await;
    let study = service.study(|new| new.number_of_trials = 12).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let best = ranked(&service, study).await;
    let third = service.trials(study).await.into_iter().find(|trial| trial.id == best[2]).unwrap();
    service.stop().await;

    let service = Service::start_certifying(&database, Analytic::default(), only(Some(third.action))).await;
    let found = settled(&service, study).await;
    assert_eq!((&found["certificate"], &found["passing"]["trial_id"]), (&json!("failed"), &json!(third.id)));
    assert_eq!(certified_by_service(&service).await.len(), 3);
    let page = service.fetch(&format!("/studies/{study}")).await.text;
    assert!(page.contains("The best gait that passed") && !page.contains("being certified"), "{page}");

    tokio::time::sleep(Duration::from_millis(5)).await;
    prune(&mut service.store.clone(), 0).await.unwrap();
    let trials = service.trials(study).await;
    let needed: Vec<_> = trials.iter().filter(|trial| [best[0], best[2]].contains(&trial.id)).collect();
    let needs = |id| needed.iter().any(|trial| trial.id == id || trial.warm_started_from == Some(id));
    for trial in &trials {
        let kept = gaits::get(&mut service.store.read().await.unwrap(), trial.id).await.is_ok();
        assert_eq!(kept, needs(trial.id), "trial {}", trial.number);
    }
    service.stop().await;
}

#[tokio::test]
async fn requested_recommendation_of_a_running_study_is_certified_during_its_solves() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic::slow(Duration::from_millis(20));
    let passes = Verdicts { pause: Duration::from_millis(20), passes: |_: &Gait| true };
    let service = Service::start_certifying(&folder.path().join("a.db"), solver, passes).await;
    let study = service.study(|new| new.number_of_trials = 500).await;
    service.wait_for_trials(study, 3).await;
    assert!(certified_by_service(&service).await.is_empty(), "nobody asked");
    service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await;
    let ended = async || service.trials(study).await.iter().filter(|trial| !trial.state.is_open()).count();
    let before = ended().await;
    while certified_by_service(&service).await.is_empty() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    service.wait_for_trials(study, before + 1).await;
    assert_eq!(service.get(study).await.state, StudyState::Running);
    service.post(&format!("/api/v1/studies/{study}/stop"), &json!({"reason": "enough"})).await;
    assert_eq!(settled(&service, study).await["certificate"], "passed");
    service.stop().await;
}

async fn snapshot(service: &Service, study: StudyId) -> StudySnapshot {
    let study = service.get(study).await;
    StudySnapshot::read(&mut service.store.read().await.unwrap(), study).await.unwrap()
}

async fn utility_history(service: &Service, study: StudyId, analyses: &Arc<Analyses>) -> Vec<UtilityPoint> {
    let (snapshot, analyses) = (snapshot(service, study).await, Arc::clone(analyses));
    service.store.clone().compute(move |pool| analyses.utility_history(pool, &snapshot)).await.unwrap().unwrap()
}

#[tokio::test]
async fn utility_history_has_the_posterior_after_each_answer_of_a_person() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (12, AnswerSource::People)).await;
    let analyses = Arc::new(Analyses::default());
    for answers in 0..5 {
        users::asked(&service, study).await;
        assert_eq!(utility_history(&service, study, &analyses).await.len(), answers);
        users::answer_once(&service, study).await;
    }
    users::asked(&service, study).await;
    let points = utility_history(&service, study, &analyses).await;
    assert_eq!(points.iter().map(|point| point.answers).collect::<Vec<_>>(), [1, 2, 3, 4, 5]);
    // The points that were kept are those that a new cache computes.
    assert_eq!(points, utility_history(&service, study, &Arc::default()).await);

    // The last point is the present recommendation, and an earlier one the posterior of the log until the next answer.
    let now = snapshot(&service, study).await;
    let (space, settings) = (&now.study.plan.search_space, &now.study.plan.learner);
    let estimate = posterior(space, &now.log(), settings).unwrap();
    let last = points.last().unwrap();
    assert_eq!(last.trial, ranked(&service, study).await[0]);
    assert_eq!(last.utility, estimate.predict(now.trial(last.trial).unwrap().action_index).unwrap());
    let fourth = now.feedback.iter().enumerate().filter(|(_, row)| row.source == Source::Clinician).nth(3).unwrap().0;
    let mut before = now.clone();
    before.feedback.truncate(fourth);
    let estimate = posterior(space, &before.log(), settings).unwrap();
    let third = points[2];
    assert_eq!(third.utility, estimate.predict(now.trial(third.trial).unwrap().action_index).unwrap());

    // An answer that was retracted does not count, as if it had not been given.
    let first = now.feedback.iter().find(|row| row.source == Source::Clinician).unwrap().id;
    let retracted = service.post(&format!("/api/v1/preferences/{first}/retract"), &json!({"reason": "a slip"})).await;
    assert!(retracted.status.is_success(), "{}", retracted.text);
    let fewer = utility_history(&service, study, &analyses).await;
    assert_eq!(fewer.len(), 4);
    assert_eq!(fewer, utility_history(&service, study, &Arc::default()).await);
    service.stop().await;
}

#[tokio::test]
async fn analysis_pools_identical_gaits_and_lists_only_answers_that_the_learner_doubts() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let plan = |new: &mut NewStudy| {
        (new.number_of_trials, new.answer_source, new.repeat_results) = (6, AnswerSource::Both, Some(true));
        new.search_space = Some(inactive_bound().into());
    };
    let study = service.study(plan).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let analysis = async || {
        let (snapshot, analyses) = (snapshot(&service, study).await, Analyses::default());
        service.store.clone().compute(move |pool| analyses.of(pool, &snapshot)).await.unwrap().unwrap()
    };
    let before = analysis().await;
    let trials = service.trials(study).await;
    let pooled: Vec<TrialId> = before.gaits.iter().flat_map(|gait| gait.trials.clone()).collect();
    assert_eq!(pooled.len(), trials.len(), "each trial is in one row");
    assert!(before.gaits.iter().any(|gait| gait.trials.len() > 1), "{:?}", before.gaits);
    for (place, gait) in before.gaits.iter().enumerate() {
        let find = |id| trials.iter().find(|trial| trial.id == id).unwrap();
        assert!(gait.trials.iter().all(|id| is_same_gait(find(gait.trials[0]), find(*id))));
        assert!(before.gaits[..place].iter().all(|other| !is_same_gait(find(other.trials[0]), find(gait.trials[0]))));
    }
    assert!(before.gaits.windows(2).all(|pair| pair[0].utility.mean >= pair[1].utility.mean));
    assert!(before.surprising_answers.iter().all(|surprising| surprising.probability.is_none_or(|p| p < 0.5)));
    let doubted = |analysis: &Analysis| {
        let Agreement { comparisons, comparisons_agreeing, no_difference, no_difference_agreeing, .. } =
            analysis.agreement;
        comparisons - comparisons_agreeing + no_difference - no_difference_agreeing
    };
    assert_eq!(before.surprising_answers.len(), doubted(&before));
    service.stop().await;
}
