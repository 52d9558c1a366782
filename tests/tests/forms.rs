//! Pages and forms, through the router: refusals, stored values and messages.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Method, Request, StatusCode};
use gaitwright_service::access::Role;
use gaitwright_store::studies::{AnswerSource, Evaluation, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_store::{StudyId, TrialId};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::callers::{self, send, signed_in};
use gaitwright_tests::service::{Answer, Service};
use serde_json::json;
use std::time::Duration;
use tempfile::TempDir;

const FORM: &str = "application/x-www-form-urlencoded";
const UNKNOWN: &str = "01890000-0000-7000-8000-000000000000";

async fn service() -> (TempDir, Service) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    (folder, service)
}

/// A finished study and two of its converged trials.
async fn finished(service: &Service) -> (StudyId, TrialId, TrialId) {
    let study = service.study(|new| new.number_of_trials = 5).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let mut converged = trials.iter().filter(|t| t.state == TrialState::Converged).map(|t| t.id);
    (study, converged.next().unwrap(), converged.next().unwrap())
}

#[track_caller]
fn is_page(answer: &Answer, status: StatusCode, holds: &str) {
    assert_eq!(answer.status, status, "{}", answer.text);
    assert!(answer.content_type().starts_with("text/html"), "{}", answer.content_type());
    assert!(answer.text.contains("</html>") && answer.text.contains(holds), "{holds}: {}", answer.text);
}

#[tokio::test]
async fn browsers_get_error_pages_and_programs_problem_documents() {
    let (_folder, service) = service().await;
    let (study, _, _) = finished(&service).await;
    for (path, status) in [
        ("/studies/abc".to_owned(), StatusCode::NOT_FOUND),
        ("/trials/abc".to_owned(), StatusCode::NOT_FOUND),
        (format!("/studies/{UNKNOWN}"), StatusCode::NOT_FOUND),
        (format!("/studies/{study}/compare?a=zz"), StatusCode::UNPROCESSABLE_ENTITY),
        ("/?after=zz".to_owned(), StatusCode::UNPROCESSABLE_ENTITY),
        (format!("/studies/{study}/do"), StatusCode::METHOD_NOT_ALLOWED),
        ("/nothing".to_owned(), StatusCode::NOT_FOUND),
    ] {
        is_page(&service.fetch(&path).await, status, "Back to the home page");
    }
    is_page(&service.fetch("/units").await, StatusCode::METHOD_NOT_ALLOWED, "There is no page at this address.");
    let wrong_method = service.post("/api/v1/health", &json!({})).await;
    assert_eq!(wrong_method.status, StatusCode::METHOD_NOT_ALLOWED);
    assert_eq!(wrong_method.content_type(), "application/problem+json");
    assert_eq!(wrong_method.json()["type"], "/problems/method-not-allowed");
    assert!(wrong_method.headers["allow"].to_str().unwrap().contains("GET"));
    service.stop().await;
}

#[tokio::test]
async fn oversized_body_is_refused_as_too_large() {
    let (_folder, service) = service().await;
    let text = "x".repeat((1 << 20) + 1);
    let answer = service.post_text("/api/v1/subjects", "application/json", &text).await;
    assert_eq!(answer.status, StatusCode::PAYLOAD_TOO_LARGE);
    assert_eq!(answer.json()["type"], "/problems/too-large");
    is_page(
        &service.post_text("/studies/new", FORM, &text).await,
        StatusCode::PAYLOAD_TOO_LARGE,
        "The limit here is 1 MiB",
    );
    service.stop().await;
}

#[tokio::test]
async fn requests_with_an_unknown_host_are_refused() {
    let (_folder, service) = service().await;
    let with_host = |host: &str| {
        let request = axum::http::Request::get("/api/v1/subjects").header("host", host);
        request.body(axum::body::Body::empty()).unwrap()
    };
    for host in ["127.0.0.1:8080", "localhost:8080", "[::1]:1"] {
        assert_eq!(service.send(with_host(host)).await.status, StatusCode::OK, "{host}");
    }
    for host in ["evil.example", "127.0.0.1.evil.example:8080", "10.0.0.7:8080"] {
        let answer = service.send(with_host(host)).await;
        assert_eq!(answer.status, StatusCode::FORBIDDEN, "{host}");
        assert_eq!(answer.json()["type"], "/problems/forbidden");
    }
    service.stop().await;
}

#[tokio::test]
async fn deceptive_pseudonyms_are_refused() {
    let (_folder, service) = service().await;
    let add = async |pseudonym: &str| {
        let body = json!({"pseudonym": pseudonym, "height_m": 1.8, "body_mass_kg": 70.5});
        service.post("/api/v1/subjects", &body).await.status
    };
    for bad in [
        "S\u{202e}10",
        "S\u{200b}01",
        "S\u{ad}01",
        "S\u{feff}01",
        "S\u{7}",
        "\u{3164}\u{3164}",
        "١٩٨٠٠٢٠٣",
        "１９８００２０３",
        "a<b",
    ] {
        assert_eq!(add(bad).await, StatusCode::UNPROCESSABLE_ENTITY, "{bad:?}");
    }
    for good in ["S01", "Zürich-7 (left)", "被験者 3", "site_2/S#4"] {
        assert_eq!(add(good).await, StatusCode::CREATED, "{good:?}");
    }
    service.stop().await;
}

#[tokio::test]
async fn study_form_checks_every_field() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    let send = async |change: (&str, &str)| {
        let id = subject.to_string();
        let mut fields = vec![
            ("subject", id.as_str()),
            ("pseudonym", ""),
            ("height_m", ""),
            ("body_mass_kg", ""),
            ("muscles", "off"),
            ("answer_source", "gait_rmse"),
            ("number_of_trials", "2"),
            ("parallel_trials", "1"),
            ("seed", "1"),
            ("name", ""),
        ];
        match fields.iter_mut().find(|(name, _)| *name == change.0) {
            Some(field) => field.1 = change.1,
            None => fields.push(change),
        }
        let body: Vec<String> = fields.iter().map(|(name, value)| format!("{name}={value}")).collect();
        service.post_text("/studies/new", FORM, &body.join("&")).await
    };
    let unprocessable = StatusCode::UNPROCESSABLE_ENTITY;
    for (field, value, says) in [
        ("muscles", "maybe", "must be on or off"),
        ("muscles", "", "must be on or off"),
        ("answer_source", "mixed", "it must be gait_rmse, people or both"),
        ("number_of_trials", "-1", "it must be 1 to 10000"),
        ("parallel_trials", "1.5", "it must be 1 to 64"),
        ("seed", "-1", "it must be 0 to 9007199254740991"),
        (
            "nearest_within_percent",
            "101",
            "\u{201c}Objective tolerance, %\u{201d} is \u{201c}101\u{201d}; it must be 0 to 100, or empty",
        ),
        ("nearest_within_percent", "all", "it must be 0 to 100, or empty"),
        ("subject", "paper-1", "a subject from the list"),
        ("pseudonym", "S09", "A new subject"),
        ("height_m", "1.8", "A new subject"),
    ] {
        is_page(&send((field, value)).await, unprocessable, &says.replace('"', "&#34;"));
    }
    is_page(&send(("colour", "red")).await, StatusCode::BAD_REQUEST, "colour");
    assert_eq!(service.fetch("/api/v1/studies").await.items(), json!([]), "nothing was started");
    assert_eq!(send(("muscles", "on")).await.status, StatusCode::SEE_OTHER);
    let lowest = json!("lowest_objective");
    let nearest = json!({"nearest_to_reference": {"within_percent": 5.0}});
    assert_eq!(send(("nearest_within_percent", "5")).await.status, StatusCode::SEE_OTHER);
    let made = service.fetch("/api/v1/studies").await.items();
    for (study, expected) in made.as_array().unwrap().iter().zip([nearest, lowest]) {
        assert_eq!(study["solve_options"]["local_optimum_choice"], expected, "{study}");
    }
    service.stop().await;
}

#[tokio::test]
async fn answer_is_retracted_through_its_link_in_its_own_study_only() {
    let (_folder, service) = service().await;
    let (study, a, b) = finished(&service).await;
    let (other, _, _) = finished(&service).await;
    let body = json!({"trial_a": a, "trial_b": b, "answer": "a"});
    let given = service.post(&format!("/api/v1/studies/{study}/preferences"), &body).await.json();
    let id = given["id"].as_str().unwrap();
    let form = format!("saved={id}&author=K&reason=typo");
    for elsewhere in [UNKNOWN.to_owned(), other.to_string()] {
        let answer = service.post_text(&format!("/studies/{elsewhere}/retract"), FORM, &form).await;
        is_page(&answer, StatusCode::NOT_FOUND, "does not exist");
    }
    let read = service.fetch(&format!("/api/v1/preferences/{id}")).await.json();
    assert_eq!(read["retraction"], json!(null), "nothing was retracted");
    let change = format!("/studies/{study}/compare?change={id}");
    assert!(service.fetch(&format!("/studies/{study}")).await.text.contains(&change));
    let link = format!("/studies/{study}/compare?saved={id}");
    assert!(service.fetch(&link).await.text.contains(&format!("action=\"/studies/{study}/retract\"")));
    let answer = service.post_text(&format!("/studies/{study}/retract"), FORM, &form).await;
    assert_eq!(answer.status, StatusCode::SEE_OTHER);
    // A retracted answer is struck through; the reason for the retraction is not.
    let page = service.fetch(&format!("/studies/{study}")).await.text;
    let struck = page.split("class=\"retracted\">").nth(1).unwrap().split("</span>").next().unwrap();
    assert!(struck.contains("trial") && !struck.contains("typo") && page.contains("retracted: typo"));
    assert!(!page.contains(&change), "a retracted answer cannot be changed");
    service.stop().await;
}

#[tokio::test]
async fn change_shows_its_own_comparison_and_replaces_the_answer() {
    let (_folder, service) = service().await;
    let (study, a, b) = finished(&service).await;
    let body = json!({"trial_a": a, "trial_b": b, "answer": "b", "source": "clinician", "author": "K", "note": "firm"});
    let given = service.post(&format!("/api/v1/studies/{study}/preferences"), &body).await.json();
    let id = given["id"].as_str().unwrap();
    let page = service.fetch(&format!("/studies/{study}/compare?change={id}")).await.text;
    for (name, value) in [("a", a.to_string()), ("b", b.to_string()), ("changes", id.to_owned())] {
        assert!(page.contains(&format!("type=\"hidden\" name=\"{name}\" value=\"{value}\"")), "{name}: {page}");
    }
    let form = format!("a={a}&b={b}&changes={id}&answer=a&source=clinician&author=K&note=&key={UNKNOWN}");
    let path = format!("/studies/{study}/compare");
    for _ in 0..2 {
        let sent = service.post_text(&path, FORM, &form).await;
        assert_eq!(sent.status, StatusCode::SEE_OTHER, "{}", sent.text);
    }
    let first = service.fetch(&format!("/api/v1/preferences/{id}")).await.json();
    assert_eq!(first["retraction"]["reason"], "another answer was given instead");
    let people = service.fetch(&format!("/api/v1/studies/{study}/preferences")).await.items();
    let valid = people.as_array().unwrap().iter().filter(|row| row["author"] == "K" && row["retraction"].is_null());
    let winners: Vec<String> = valid.map(|row| row["content"]["winner"].as_str().unwrap().to_owned()).collect();
    assert_eq!(winners, [a.to_string()]);
    // The answer that was replaced cannot be replaced again.
    let again = form.replace(UNKNOWN, "01890000-0000-7000-8000-000000000001");
    assert_eq!(service.post_text(&path, FORM, &again).await.status, StatusCode::CONFLICT);
    service.stop().await;
}

#[tokio::test]
async fn finished_study_waits_for_no_answer_after_a_retraction() {
    let (_folder, service) = service().await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (3, AnswerSource::Both)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let converged: Vec<_> =
        service.trials(study).await.into_iter().filter(|trial| trial.state == TrialState::Converged).collect();
    let body = json!({"trial_a": converged[0].id, "trial_b": converged[1].id, "answer": "a", "author": "K"});
    let given = service.post(&format!("/api/v1/studies/{study}/preferences"), &body).await.json();
    let form = format!("saved={}&author=K&reason=typo", given["id"].as_str().unwrap());
    assert_eq!(
        service.post_text(&format!("/studies/{study}/retract"), FORM, &form).await.status,
        StatusCode::SEE_OTHER
    );
    let page = service.fetch(&format!("/studies/{study}")).await.text;
    assert!(page.contains("finished") && !page.contains("Waiting for your answer"), "{page}");
    service.stop().await;
}

#[tokio::test]
async fn form_sent_twice_with_another_answer_shows_the_recorded_one() {
    let (_folder, service) = service().await;
    let (study, a, b) = finished(&service).await;
    let path = format!("/studies/{study}/compare");
    let send = async |answer: &str, author: &str| {
        let body = format!("a={a}&b={b}&answer={answer}&source=clinician&author={author}&note=firm&key={UNKNOWN}");
        service.post_text(&path, FORM, &body).await
    };
    let before = service.feedback(study).await.len();
    let first = send("a", "K").await;
    assert_eq!(first.status, StatusCode::SEE_OTHER);
    let same = send("a", "K").await;
    assert_eq!((same.status, &same.headers["location"]), (StatusCode::SEE_OTHER, &first.headers["location"]));
    let other = send("b", "K").await;
    is_page(&other, StatusCode::CONFLICT, "this one was not saved");
    assert!(other.text.contains("Saved") && other.text.contains(" is better than "), "the stored answer is shown");
    assert!(!other.text.contains("class=\"answer\""), "the buttons that were refused: {}", other.text);
    assert!(other.text.contains("<q>firm</q>") && other.text.contains("compare?change="), "{}", other.text);
    assert_eq!(service.feedback(study).await.len(), before + 1);
    service.stop().await;
}

#[tokio::test]
async fn second_answer_of_the_same_person_is_refused_until_the_first_is_retracted() {
    let (_folder, service) = service().await;
    let (study, a, b) = finished(&service).await;
    let path = format!("/studies/{study}/compare");
    let key = |number: u32| format!("01890000-0000-7000-8000-{number:012}");
    let send = async |pair: &str, answer: &str, number: u32| {
        let body = format!("{pair}&answer={answer}&source=clinician&author=K&note=&key={}", key(number));
        service.post_text(&path, FORM, &body).await
    };
    let (ahead, turned) = (format!("a={a}&b={b}"), format!("a={b}&b={a}"));
    let before = service.feedback(study).await.len();
    let first = send(&ahead, "a", 1).await;
    assert_eq!(first.status, StatusCode::SEE_OTHER);
    // A second answer from another tab, with the gaits swapped, and by pressing the button again.
    for (pair, answer, number) in [(&ahead, "b", 2), (&turned, "a", 3), (&ahead, "cannot_tell", 4), (&ahead, "b", 2)] {
        let second = send(pair, answer, number).await;
        is_page(&second, StatusCode::CONFLICT, "in another tab or window");
        assert!(second.text.contains("Saved") && second.text.contains(" is better than "), "{}", second.text);
    }
    let rest = json!({"trial_a": b, "trial_b": a, "answer": "no_difference", "author": "K"});
    let rest = service.post(&format!("/api/v1/studies/{study}/preferences"), &rest).await;
    assert!(rest.status == StatusCode::CONFLICT && rest.text.contains("Retract that answer first"), "{}", rest.text);
    assert_eq!(service.feedback(study).await.len(), before + 1);
    let saved = first.headers["location"].to_str().unwrap().split("saved=").nth(1).unwrap().to_owned();
    let back = format!("saved={saved}&author=K&reason=slip");
    let retracted = service.post_text(&format!("/studies/{study}/retract"), FORM, &back).await;
    assert_eq!(retracted.status, StatusCode::SEE_OTHER);
    assert_eq!(send(&turned, "a", 5).await.status, StatusCode::SEE_OTHER, "the retracted answer is not in the way");
    // Another person may answer, and a safety report is always accepted.
    let other = format!("{ahead}&answer=b&source=clinician&author=L&note=&key={}", key(6));
    assert_eq!(service.post_text(&path, FORM, &other).await.status, StatusCode::SEE_OTHER);
    assert_eq!(send(&ahead, "unsafe_a", 7).await.status, StatusCode::SEE_OTHER);
    service.stop().await;
}

#[tokio::test]
async fn finished_study_offers_each_pair_of_different_gaits_until_it_is_answered() {
    let (_folder, service) = service().await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let path = format!("/studies/{study}/compare");
    let offered = async || {
        let page = service.fetch(&path).await.text;
        let pair = page.split_once("data-answer=\"").and_then(|(_, rest)| rest.split_once('"'));
        (pair.and_then(|(pair, _)| pair.split_once(' ')).map(|(a, b)| (a.to_owned(), b.to_owned())), page.clone())
    };
    let mut seen = Vec::new();
    let last = loop {
        let (Some((a, b)), _) = offered().await else { break seen.len() };
        assert!(!seen.contains(&(a.clone(), b.clone())), "offered again: {a} {b}");
        seen.push((a.clone(), b.clone()));
        let key = format!("01890000-0000-7000-8000-{:012}", seen.len());
        let body = format!("a={a}&b={b}&answer=a&source=clinician&author=K&note=&key={key}");
        assert_eq!(service.post_text(&path, FORM, &body).await.status, StatusCode::SEE_OTHER);
    };
    assert!(last > 0);
    let (_, page) = offered().await;
    assert!(
        page.contains("All pairs of different gaits have been answered") && page.contains("Answers so far"),
        "{page}"
    );
    assert!(!page.contains("class=\"answer\"") && page.contains("compare?change="), "{page}");
    // Another person can still choose two gaits, and a person who undoes is back at them.
    let (a, b) = seen.pop().unwrap();
    let body = format!("a={a}&b={b}&answer=b&source=clinician&author=L&note=&key=01890000-0000-7000-8000-000000000999");
    let saved = service.post_text(&path, FORM, &body).await.headers["location"].to_str().unwrap().to_owned();
    let form = format!("saved={}&author=L", saved.split("saved=").nth(1).unwrap());
    let undone = service.post_text(&format!("/studies/{study}/undo"), FORM, &form).await;
    let page = service.fetch(undone.headers["location"].to_str().unwrap()).await.text;
    assert!(page.contains("(retracted)") && page.contains(&format!("data-answer=\"{a} {b}\"")), "{page}");
    service.stop().await;
}

#[tokio::test]
async fn answers_of_others_are_shown_beside_the_own_answer() {
    let (_folder, service) = service().await;
    let (study, a, b) = finished(&service).await;
    let give = format!("/api/v1/studies/{study}/preferences");
    let said = |author: &str, answer: &str| json!({"trial_a": a, "trial_b": b, "answer": answer, "author": author});
    let first = service.post(&give, &said("S01", "a")).await.json();
    assert_eq!(first["other_answers"], json!([]));
    assert_eq!(service.post(&give, &said("S01", "a")).await.status, StatusCode::CONFLICT, "the same person again");
    let other = json!({"trial_a": b, "trial_b": a, "answer": "a", "author": "K"});
    assert_eq!(service.post(&give, &other).await.json()["other_answers"].as_array().unwrap().len(), 1);

    let body = format!("a={a}&b={b}&answer=no_difference&source=clinician&author=L&note=&key={UNKNOWN}");
    let sent = service.post_text(&format!("/studies/{study}/compare"), FORM, &body).await;
    let page = service.fetch(sent.headers["location"].to_str().unwrap()).await.text;
    assert!(page.contains("S01 also answered this comparison: trial") && page.contains("K also answered"), "{page}");
    service.stop().await;
}

#[tokio::test]
async fn comparison_page_shows_both_gaits_and_keeps_the_input() {
    let (_folder, service) = service().await;
    let (study, a, b) = finished(&service).await;
    let path = format!("/studies/{study}/compare");
    let page = service.fetch(&format!("{path}?a={a}&b={b}")).await;
    for holds in [
        format!("href=\"/trials/{a}\""),
        format!("href=\"/trials/{b}\""),
        "First is better".into(),
        "second: trial".into(),
    ] {
        assert!(page.text.contains(&holds), "{holds}");
    }
    assert_eq!(page.text.matches("<svg class=\"chart\"").count(), 7, "torso and six joints");
    let unprocessable = StatusCode::UNPROCESSABLE_ENTITY;
    let nobody = format!("a={a}&b={b}&answer=b&source=clinician&author=+&note=both+limp&key={UNKNOWN}");
    let refused = service.post_text(&path, FORM, &nobody).await;
    is_page(&refused, unprocessable, "1 to 80 printable characters");
    for kept in ["value=\"b\" aria-current=\"true\"", "value=\"clinician\" selected", "both limp</textarea>"] {
        assert!(refused.text.contains(kept), "{kept}");
    }
    let none = format!("a={a}&b={b}&source=clinician&author=K&note=&key={UNKNOWN}");
    is_page(&service.post_text(&path, FORM, &none).await, unprocessable, "one of the answers on the form");
    let itself = format!("a={a}&b={a}&answer=b&source=clinician&author=K&note=&key={UNKNOWN}");
    is_page(&service.post_text(&path, FORM, &itself).await, unprocessable, "compared with itself");
    is_page(&service.fetch(&format!("{path}?a={a}&b={a}")).await, StatusCode::OK, "are the same. Choose two different");
    is_page(&service.fetch(&format!("{path}?a={a}&b={UNKNOWN}")).await, unprocessable, UNKNOWN);
    let (_, other, _) = finished(&service).await;
    is_page(&service.fetch(&format!("{path}?a={other}&b={b}")).await, unprocessable, "a trial of this study");
    service.stop().await;
}

#[tokio::test]
async fn study_without_answers_has_no_best_action() {
    let (_folder, service) = service().await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (4, AnswerSource::People)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let page = service.fetch(&format!("/studies/{study}")).await.text;
    assert!(
        page.contains("No answers from people yet")
            && !page.contains("best action so far")
            && !page.contains(">recommended<")
    );
    let trials = service.trials(study).await;
    let (new, old) = (trials[trials.len() - 1].id, trials[trials.len() - 2].id);
    let body = json!({"trial_a": new, "trial_b": old, "answer": "a"});
    service.post(&format!("/api/v1/studies/{study}/preferences"), &body).await;
    let page = service.fetch(&format!("/studies/{study}")).await.text;
    assert!(!page.contains("No answers from people yet") && page.contains("best action so far"));
    service.stop().await;
}

#[tokio::test]
async fn cancelled_trial_does_not_count_as_progress() {
    let folder = tempfile::tempdir().unwrap();
    let slow = Analytic::slow(Duration::from_millis(20));
    let service = Service::start(&folder.path().join("a.db"), slow, 1).await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for_trials(study, 1).await;
    while !service.trials(study).await.iter().any(|trial| trial.number == 2 && trial.state == TrialState::Running) {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    service.post(&format!("/api/v1/studies/{study}/stop"), &json!({})).await;
    service.wait_for(study, &[StudyState::Stopped]).await;
    let trials = service.trials(study).await;
    let results = trials.iter().filter(|trial| trial.state.is_result()).count();
    assert!(results < trials.len(), "one was cancelled");
    let page = service.fetch(&format!("/studies/{study}")).await.text;
    assert!(page.contains(&format!("{results} of 3 trials")), "{page}");
    assert!(page.contains(&format!("value=\"{results}\"")) && page.contains("without a result"));
    service.stop().await;
}

#[tokio::test]
async fn best_line_starts_at_the_first_gait_with_parallel_trials() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::slow(Duration::from_millis(2)), 3).await;
    for number in [3, 9] {
        let study = service.study(|new| (new.number_of_trials, new.parallel_trials) = (number, 3)).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        let history = service.fetch(&format!("/api/v1/studies/{study}/history")).await.items();
        let history = history.as_array().unwrap();
        let order: Vec<_> = service
            .feedback(study)
            .await
            .iter()
            .filter_map(|row| match row.content {
                gaitwright_store::feedback::FeedbackContent::Label { trial, .. } => Some(trial),
                _ => None,
            })
            .collect();
        let trials = service.trials(study).await;
        let state = |id: &TrialId| trials.iter().find(|trial| trial.id == *id).unwrap().state;
        let first = order.iter().position(|id| state(id) == TrialState::Converged).unwrap();
        let begins = history.iter().find(|milestone| milestone["gait_rmse_rad"].is_number()).unwrap();
        assert_eq!((&begins["iteration"], &begins["trial_id"]), (&json!(first + 1), &json!(order[first])));
        assert_eq!(history.last().unwrap()["iteration"], json!(number));
        let iterations: Vec<_> = history.iter().map(|milestone| milestone["iteration"].as_u64()).collect();
        assert!(iterations.is_sorted_by(|a, b| a < b), "{iterations:?}");
        // The best trial after some results is one of these results.
        for milestone in history {
            let there = usize::try_from(milestone["iteration"].as_u64().unwrap()).unwrap();
            let best = milestone["trial_id"].as_str().unwrap();
            assert!(order[..there].iter().any(|id| id.to_string() == best), "{milestone}");
        }
    }
    service.stop().await;
}

#[tokio::test]
async fn gait_page_explains_its_lines() {
    let (_folder, service) = service().await;
    let (study, a, _) = finished(&service).await;
    let page = service.fetch(&format!("/trials/{a}")).await.text;
    for name in ["DS2", "DS3", "SS2", "SS1"] {
        assert!(page.contains(&format!("<dt>{name}</dt>")), "{name} is explained");
    }
    // Phases of an eighth of the stride each have no room for their names: shades and lines say where they begin.
    assert!(page.contains("class=\"span\"") && page.contains("class=\"mark\""));
    assert!(page.contains("</i>1 cost</span>"), "the phases of the solve are marked");
    let page = service.fetch(&format!("/studies/{study}")).await.text;
    assert!(page.contains("reference gait: ") && page.contains("paper-1</a> (1.727 m"));
    service.stop().await;
}

#[tokio::test]
async fn study_list_has_further_pages() {
    let (_folder, service) = service().await;
    for seed in 0..103 {
        service.study(|new| (new.seed, new.start, new.name) = (seed, false, Some(format!("number {seed}.")))).await;
    }
    let first = service.fetch("/").await.text;
    assert!(first.contains("number 102.") && first.contains("number 3.") && !first.contains("number 2."));
    let next = first.split("href=\"/?after=").nth(1).unwrap().split('"').next().unwrap();
    let second = service.fetch(&format!("/?after={next}")).await.text;
    assert!(second.contains("number 2.") && second.contains("number 0.") && !second.contains("number 3."));
    assert!(second.contains("Newest studies") && !second.contains("Older studies"));
    // Sorted by a column, the second page continues where the first one ends.
    let shown = async |path: &str| service.fetch(path).await.text.replace("&#38;", "&").replace("&amp;", "&");
    let newest = shown("/").await;
    let head = "aria-sort=\"descending\"><a href=\"/?sort=created_at&order=ascending\">Created";
    assert!(newest.contains(head), "{newest}");
    let first = shown("/?sort=name&order=ascending").await;
    let names = |page: &str| -> Vec<String> {
        let table = page.split("class=\"studies\"").nth(1).unwrap();
        table
            .split("number ")
            .skip(1)
            .map(|rest| rest.split('.').next().unwrap().to_owned())
            .filter(|n| n.len() < 4)
            .collect()
    };
    let next = first.split("rel=\"next\"").next().unwrap().rsplit("href=\"").next().unwrap().split('"').next().unwrap();
    let second = shown(next).await;
    let mut sorted: Vec<String> = (0..103).map(|number: u32| number.to_string()).collect();
    sorted.sort_by_key(|number| format!("{number}."));
    let mut found = names(&first);
    found.extend(names(&second));
    found.dedup();
    assert_eq!(found, sorted);
    let by_name = service.fetch("/api/v1/studies?sort=-name&limit=2").await;
    let both =
        |page: &serde_json::Value| page.as_array().unwrap().iter().map(|s| s["name"].clone()).collect::<Vec<_>>();
    assert_eq!(both(&by_name.items()), ["number 99.", "number 98."]);
    let cursor = by_name.json()["next"].as_str().unwrap().to_owned();
    let after = service.fetch(&format!("/api/v1/studies?sort=-name&limit=2&cursor={cursor}")).await;
    assert_eq!(both(&after.items()), ["number 97.", "number 96."]);
    for path in ["/?sort=seed", "/api/v1/studies?sort=seed"] {
        assert_eq!(service.fetch(path).await.status, StatusCode::UNPROCESSABLE_ENTITY, "{path}");
    }
    service.stop().await;
}

#[tokio::test]
async fn refused_study_form_names_the_field_by_its_label_and_opens_it() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    let form = |changed: &str| {
        let given = format!("{changed}&");
        let rest = ["number_of_trials=3", "seed=1", "tuned_a1=on", "values_a1=859.4,1146", "tuned_a3=on"];
        let rest: Vec<&str> =
            rest.into_iter().filter(|field| !given.starts_with(field.split_once('=').unwrap().0)).collect();
        format!("{changed}&subject={subject}&muscles=on&answer_source=gait_rmse&parallel_trials=1&{}", rest.join("&"))
    };
    for (changed, field, said) in [
        ("lengthscale_a1=-5", "lengthscale_a1", "\u{201c}Lengthscale of a1\u{201d} is -5; it must be "),
        ("lengthscale_a3=0", "lengthscale_a3", "\u{201c}Lengthscale of a3\u{201d} is 0; it must be 0.001 to 2000"),
        ("values_a1=859.4,x", "values_a1", "\u{201c}Values of a1\u{201d} is "),
        ("number_of_trials=many", "number_of_trials", "\u{201c}Number of trials\u{201d} is "),
        ("seed=x", "seed", "\u{201c}Seed\u{201d} is "),
        ("height_m=1.7", "height_m", "\u{201c}Height, m\u{201d} is "),
    ] {
        let refused = service.post_text("/studies/new", FORM, &form(changed)).await;
        is_page(&refused, StatusCode::UNPROCESSABLE_ENTITY, said);
        let before =
            refused.text.split(" aria-invalid=\"true\" aria-describedby=\"refused\" autofocus").next().unwrap();
        assert_ne!(before.len(), refused.text.len(), "{field} is marked");
        assert!(before.rsplit("name=\"").next().unwrap().starts_with(&format!("{field}\"")), "{changed}: {field}");
        // If the field is in a collapsed section, the section is open.
        let folded = before.matches("<details").count() > before.matches("</details>").count();
        assert!(!folded || before.rsplit("<details").next().unwrap().split('>').next().unwrap().contains(" open"));
    }
    service.stop().await;
}

#[tokio::test]
async fn angles_of_bounds_are_degrees_on_pages_and_radians_in_rest() {
    let (_folder, service) = service().await;
    let form = service.fetch("/studies/new").await.text;
    for shown in
        ["torso lean, °", "value=\"0, 5.73, 11.46, 17.19, 22.92, 28.65\"", "value=\"859.4, 1146\"", "0 to 57.3°"]
    {
        assert!(form.contains(shown), "{shown}: {form}");
    }
    assert!(!form.contains("rad/s"), "{form}");
    let subject = service.subject().await;
    let bounds = "tuned_a6=on&values_a6=5.73;+0.2+rad,+17.19°&lengthscale_a6=5.73&fixed_a1=1146";
    let body =
        format!("subject={subject}&muscles=off&answer_source=gait_rmse&parallel_trials=1&number_of_trials=2&seed=1");
    let study = made(&service.post_text("/studies/new", FORM, &format!("{body}&{bounds}")).await);
    let plan = service.get(study).await.plan;
    let tuned = &plan.search_space.dimensions()[0];
    assert_eq!(
        (tuned.values.as_slice(), tuned.lengthscale, plan.base_bounds.a1),
        ([0.1, 0.2, 0.3].as_slice(), 0.1, 20.0)
    );
    let beyond = service.post_text("/studies/new", FORM, &format!("{body}&tuned_a6=on&values_a6=5,70")).await;
    is_page(&beyond, StatusCode::UNPROCESSABLE_ENTITY, "\u{201c}Values of a6\u{201d} is 70; it must be 0 to 57.3°.");
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = service.trials(study).await[0].clone();
    let lean =
        [(0.1, "5.73"), (0.2, "11.5"), (0.3, "17.2")].into_iter().find(|(rad, _)| *rad == trial.action.a6).unwrap().1;
    for page in [format!("/studies/{study}"), format!("/trials/{}", trial.id)] {
        let shown = service.fetch(&page).await.text;
        assert!(shown.contains(&format!("<td class=\"number\">{lean}</td>")), "{page}: {shown}");
        assert!(shown.contains("torso lean, °") && !shown.contains("torso lean, rad"), "{page}");
    }
    service.stop().await;
}

#[tokio::test]
async fn angle_without_unit_that_may_be_radians_is_refused_with_both_meanings() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    let body = format!("{STUDY}&subject={subject}&number_of_trials=1&seed=1&values_a5=0,0.02");
    let doubtful = format!("{body}&tuned_a6=on&values_a6=0,.3&lengthscale_a6=5.73&fixed_a1=80");
    let refused = service.post_text("/studies/new", FORM, &doubtful).await;
    is_page(&refused, StatusCode::UNPROCESSABLE_ENTITY, "2 fields need correcting");
    for says in [
        "Values of a6: .3 has no unit. Did you mean 17.2° (.3 rad)? If you mean .3 degrees, write .3°.",
        "Fixed value of a1: 80 has no unit. Did you mean 4584 °/s (80 rad/s)?",
        "name=\"values_a6\" value=\"0,.3\"",
    ] {
        assert!(refused.text.contains(says), "{says}: {}", refused.text);
    }
    let clear = "&tuned_a6=on&values_a6=0.3°,0.5+deg,0.1+rad&lengthscale_a6=0.01+rad&fixed_a1=80+°/s";
    let study = made(&service.post_text("/studies/new", FORM, &format!("{body}{clear}")).await);
    let plan = service.get(study).await.plan;
    let lean = plan.search_space.dimensions().iter().find(|dimension| dimension.name == "a6").unwrap();
    let degrees: Vec<f64> = lean.values.iter().map(|value| (value.to_degrees() * 1e3).round() / 1e3).collect();
    assert_eq!(degrees, [0.3, 0.5, 5.73]);

    // What the form of a clone fills in is accepted unchanged.
    let clone = service.fetch(&format!("/studies/new?like={study}")).await.text;
    let filled_in = |field: &str| {
        let input = clone.split(&format!("name=\"{field}\" value=\"")).nth(1).unwrap();
        format!("&{field}={}", input.split('"').next().unwrap().replace(' ', "+"))
    };
    let typed: String = ["values_a6", "lengthscale_a6", "fixed_a1"].map(filled_in).concat();
    assert!(typed.contains("0.3°") && typed.contains("80+°/s"), "{typed}");
    let again = made(&service.post_text("/studies/new", FORM, &format!("{body}&tuned_a6=on{typed}")).await);
    let again = service.get(again).await.plan;
    assert_eq!((again.search_space, again.base_bounds), (plan.search_space, plan.base_bounds));
    service.stop().await;
}

#[tokio::test]
async fn comparison_of_studies_with_answers_of_people_leads_with_these_answers() {
    let (_folder, service) = service().await;
    let people = service.study(|new| (new.number_of_trials, new.answer_source) = (4, AnswerSource::People)).await;
    let other = service.study(|new| new.number_of_trials = 3).await;
    for (study, state) in [(people, StudyState::Waiting), (other, StudyState::Finished)] {
        service.wait_for(study, &[state]).await;
    }
    let path = format!("/studies/compare?study={people}&study={other}");
    let before = service.fetch(&path).await.text;
    assert!(before.contains("no gait is recommended yet") && before.contains("Gait RMSE answers every comparison"));
    let trials = service.trials(people).await;
    let (new, old) = (trials[trials.len() - 1].id, trials[trials.len() - 2].id);
    for author in ["K", "L"] {
        let body = json!({"trial_a": new, "trial_b": old, "answer": "a", "author": author});
        let given = service.post(&format!("/api/v1/studies/{people}/preferences"), &body).await;
        assert_eq!(given.status, StatusCode::CREATED, "{}", given.text);
    }
    let after = service.fetch(&path).await.text;
    let place = |text: &str| after.find(text).unwrap_or_else(|| panic!("{text}: {after}"));
    assert!(place("about this gait") < place(": utility of the recommended gait</h3>"));
    assert!(place(": utility of the recommended gait</h3>") < place("Gait RMSE of the best action by iteration</h3>"));
    service.stop().await;
}

#[tokio::test]
async fn several_studies_are_compared_in_one_chart_and_one_table() {
    let (_folder, service) = service().await;
    let mut studies = Vec::new();
    for number in 1..=7 {
        let study = service.study(|new| (new.number_of_trials, new.seed) = (2, number)).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        studies.push(study);
    }
    let address = |studies: &[StudyId]| {
        let chosen: Vec<String> = studies.iter().map(|study| format!("study={study}")).collect();
        format!("/studies/compare?{}", chosen.join("&"))
    };
    // A study that is named twice counts once.
    let page = service.fetch(&address(&[studies[0], studies[1], studies[2], studies[0]])).await.text;
    let head = page.split("class=\"sides\"").nth(1).unwrap().split("</thead>").next().unwrap();
    assert_eq!(head.matches("<a href=\"/studies/").count(), 3, "{head}");
    assert!(!page.contains("class=\"gait-walker\""), "three gaits do not walk side by side");
    // Every recommended gait is in the sentence, the one closest to the reference gait first.
    let sentence = page.split("Closest to the reference gait: ").nth(1).unwrap().split("</p>").next().unwrap();
    let rmse = sentence.split("Gait RMSE ").skip(1).map(|rest| rest.split(' ').next().unwrap().parse::<f64>().unwrap());
    let rmse: Vec<f64> = rmse.collect();
    assert!(rmse.len() == 3 && rmse.is_sorted(), "{sentence}");
    let file = page.split("/figures/").nth(1).unwrap().split('"').next().unwrap().replace(".svg", ".csv");
    let file = service.fetch(&format!("/api/v1/studies/{}/figures/{file}", studies[0])).await;
    assert_eq!(file.status, StatusCode::OK, "{}", file.text);
    for study in &studies[..3] {
        assert!(file.text.contains(&service.get(*study).await.plan.name), "{}", file.text);
    }
    let most = service.fetch(&address(&studies[..6])).await;
    assert_eq!(most.status, StatusCode::OK, "{}", most.text);
    let refused = service.fetch(&address(&studies)).await;
    is_page(&refused, StatusCode::UNPROCESSABLE_ENTITY, "At most 6 studies can be compared; 7 are chosen.");
    assert_eq!(refused.text.matches("name=\"study\"").count(), 7, "the form is there: {}", refused.text);
    assert_eq!(refused.text.matches(" checked").count(), 7, "{}", refused.text);
    service.stop().await;
}

#[tokio::test]
async fn new_study_of_a_subject_preselects_the_subject() {
    let (_folder, service) = service().await;
    let new = json!({"pseudonym": "S07", "height_m": 1.7, "body_mass_kg": 70});
    let subject = service.post("/api/v1/subjects", &new).await.json()["id"].as_str().unwrap().to_owned();
    let link = format!("/studies/new?subject={subject}");
    assert!(service.fetch(&format!("/subjects/{subject}")).await.text.contains(&link));
    let form = service.fetch(&link).await.text;
    assert!(form.contains(&format!("value=\"{subject}\" selected")), "{form}");
    assert_eq!(
        form.split("name=\"subject\"").nth(1).unwrap().split("</select>").next().unwrap().matches(" selected").count(),
        1
    );
    service.stop().await;
}

#[tokio::test]
async fn signed_in_user_reports_a_gait_in_their_own_name() {
    let (_folder, service) = callers::service().await;
    let study = service.study(|new| new.number_of_trials = 1).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = format!("/trials/{}", service.trials(study).await[0].id);
    let clinician = signed_in(&service, Role::Clinician).await;
    let page = send(&service, &clinician, &Method::GET, &trial, FORM, "").await.text;
    assert!(page.contains("Reported by a clinician") && !page.contains("id=\"reporter\""), "{page}");
    let sent = send(&service, &clinician, &Method::POST, &format!("{trial}/safety-report"), FORM, "note=fell").await;
    assert_eq!(sent.status, StatusCode::SEE_OTHER, "{}", sent.text);
    let page = send(&service, &clinician, &Method::GET, &trial, FORM, "").await.text;
    assert!(page.contains("unsafe</a> by a clinician"), "{page}");
    service.stop().await;
}

#[tokio::test]
async fn refused_forms_name_fields_by_their_labels() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    let long = "x".repeat(2001);
    for (path, form, expected) in [
        (
            "correct",
            "height_m=17.2&body_mass_kg=70&reason=r&before=0".to_owned(),
            "\u{201c}Height, m\u{201d} is 17.2; it must be 1.4 to 2.2.",
        ),
        (
            "correct",
            "height_m=1.72&body_mass_kg=70&reason=&before=0".to_owned(),
            "\u{201c}Reason\u{201d} must be 1 to 2000 characters",
        ),
        (
            "correct",
            format!("height_m=1.72&body_mass_kg=70&reason={long}&before=0"),
            "\u{201c}Reason\u{201d} must be at most 2000 characters long.",
        ),
    ] {
        let refused = service.post_text(&format!("/subjects/{subject}/{path}"), FORM, &form).await;
        is_page(&refused, StatusCode::UNPROCESSABLE_ENTITY, expected);
    }
    let other = "pseudonym=S08&height_m=17.2&body_mass_kg=70";
    let refused = service.post_text("/subjects", FORM, other).await;
    is_page(&refused, StatusCode::UNPROCESSABLE_ENTITY, "\u{201c}Height, m\u{201d} is 17.2; it must be 1.4 to 2.2.");
    let other = "name=x&format=csv&recording=y&strikes=ends&height_m=tall";
    let refused = service.post_text("/reference-gaits", FORM, other).await;
    is_page(
        &refused,
        StatusCode::UNPROCESSABLE_ENTITY,
        "\u{201c}Height of the measured person, m\u{201d} is \u{201c}tall\u{201d}; it must be a number in metres, such as 1.75, or feet and inches, such as \
         5 ft 9 in.",
    );
    service.stop().await;
}

#[tokio::test]
async fn script_trial_without_a_gait_offers_no_gait() {
    let (_folder, service) = service().await;
    let study = service.study(|new| (new.evaluation, new.number_of_trials) = (Evaluation::Script, 1)).await;
    let trial = service.post(&format!("/api/v1/studies/{study}/ask"), &json!({})).await.json();
    let trial = trial["id"].as_str().unwrap();
    let told = json!({"label": "converged", "gait_rmse_rad": 0.21});
    assert_eq!(service.post(&format!("/api/v1/trials/{trial}/tell"), &told).await.status, StatusCode::OK);
    service.wait_for(study, &[StudyState::Finished]).await;
    for page in [format!("/studies/{study}"), format!("/trials/{trial}")] {
        let shown = service.fetch(&page).await.text;
        assert!(shown.contains("the gait itself is not stored here"), "{shown}");
        for offered in
            ["Watch this gait", "/gait.csv", "/controller.json", "/certify", "This gait has no certificate yet"]
        {
            assert!(!shown.contains(offered), "{page}: {offered}");
        }
        // Every offered link exists.
        let links = shown
            .split("href=\"")
            .skip(1)
            .map(|rest| rest.replace("&#38;", "&").replace("&amp;", "&"))
            .map(|rest| rest.split(['"', '#']).next().unwrap().to_owned());
        let is_text = |link: &String| ![".png", "/archive"].iter().any(|other| link.contains(other));
        let links: Vec<String> = links.filter(|link| link.starts_with('/') && is_text(link)).collect();
        assert!(links.len() > 5, "{page}: {links:?}");
        for link in links {
            let status = service.fetch(&link).await.status;
            assert!(status.is_success() || status.is_redirection(), "{page}: {link}: {status}");
        }
    }
    assert_eq!(
        service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await.json()["certifying"],
        json!(false)
    );
    service.stop().await;
}

#[tokio::test]
async fn ended_study_is_extended_on_its_page() {
    let (_folder, service) = service().await;
    let (study, _, _) = finished(&service).await;
    let page = service.fetch(&format!("/studies/{study}")).await.text;
    assert!(page.contains("min=\"6\"") && !page.contains("value=\"stop\""), "{page}");
    let path = format!("/studies/{study}/do");
    let same = service.post_text(&path, FORM, "transition=extend&number_of_trials=5").await;
    is_page(&same, StatusCode::UNPROCESSABLE_ENTITY, "\u{201c}Number of trials\u{201d} is 5; it must be 6 to 10000.");
    is_page(
        &service.post_text(&path, FORM, "transition=extend").await,
        StatusCode::UNPROCESSABLE_ENTITY,
        "\u{201c}Number of trials\u{201d} must be a whole number.",
    );
    assert_eq!(
        service.post_text(&path, FORM, "transition=extend&number_of_trials=7").await.status,
        StatusCode::SEE_OTHER
    );
    service.wait_for_trials(study, 7).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    service.stop().await;
}

#[tokio::test]
async fn refused_user_and_token_forms_keep_the_input_and_show_the_error_at_its_field() {
    let (_folder, service) = service().await;
    let send = async |body: &str| service.post_text("/users", FORM, body).await;
    assert!(send("button=add_user&name=K1&role=clinician").await.status.is_success());
    let taken = send("button=add_user&name=K1&role=administrator").await;
    is_page(&taken, StatusCode::CONFLICT, "A user named");
    for kept in [
        "name=\"name\" value=\"K1\" required maxlength=\"80\" autocomplete=\"off\" aria-invalid=\"true\" aria-describedby=\"refused\"",
        "value=\"administrator\" selected",
        "id=\"refused\"",
    ] {
        assert!(taken.text.contains(kept), "{kept}: {}", taken.text);
    }
    let refused = send("button=make_token&name=treadmill&days=soon&run=on").await;
    is_page(
        &refused,
        StatusCode::UNPROCESSABLE_ENTITY,
        "\u{201c}Expires after, days\u{201d} is \u{201c}soon\u{201d}; it must be",
    );
    for kept in ["value=\"treadmill\"", "value=\"soon\"", "name=\"run\" checked"] {
        assert!(refused.text.contains(kept), "{kept}: {}", refused.text);
    }
    assert!(!refused.text.contains("name=\"read\" checked"), "{}", refused.text);
    assert_eq!(refused.text.matches("aria-invalid").count(), 1);
    assert!(!refused.text.contains("gait_"), "no secret");
    let nothing = send("button=make_token&name=treadmill&days=").await;
    is_page(&nothing, StatusCode::UNPROCESSABLE_ENTITY, "\u{201c}Scopes\u{201d} must be one or more of");
    service.stop().await;
}

/// The fields of the form for a new study, without subject.
const STUDY: &str = "muscles=off&answer_source=people&parallel_trials=1&tuned_a5=on&device=&reference_gait=";

/// The study that a redirect leads to.
#[track_caller]
fn made(answer: &Answer) -> StudyId {
    assert_eq!(answer.status, StatusCode::SEE_OTHER, "{}", answer.text);
    answer.headers["location"].to_str().unwrap().rsplit('/').next().unwrap().parse().unwrap()
}

#[tokio::test]
async fn study_form_reports_every_refused_field_and_keeps_what_was_chosen() {
    let (_folder, service) = service().await;
    let body = format!(
        "{STUDY}&subject=new&pseudonym=&height_m=173&body_mass_kg=65,7&number_of_trials=0&seed=-1&values_a5=0,high"
    );
    let refused = service.post_text("/studies/new", FORM, &body).await;
    is_page(&refused, StatusCode::UNPROCESSABLE_ENTITY, "6 fields need correcting");
    for says in [
        "\u{201c}Pseudonym\u{201d} must be",
        "Did you mean 1.73 m?",
        "Did you mean 65.7 kg?",
        "\u{201c}Number of trials\u{201d} is 0",
        "\u{201c}Seed\u{201d}",
        "\u{201c}Values of a5\u{201d}",
    ] {
        assert!(refused.text.contains(says), "{says}: {}", refused.text);
    }
    for kept in
        ["value=\"people\" checked", "value=\"173\" inputmode=\"decimal\"", "value=\"65,7\"", "value=\"0,high\""]
    {
        assert!(refused.text.contains(kept), "{kept}: {}", refused.text);
    }
    assert_eq!(refused.text.matches(" autofocus").count(), 1);
    assert!(refused.text.contains("<svg class=\"chart\""), "the chosen reference gait stays");
    assert_eq!(service.fetch("/api/v1/studies").await.items(), json!([]));
    service.stop().await;
}

#[tokio::test]
async fn height_and_mass_are_accepted_in_customary_units() {
    let (_folder, service) = service().await;
    let body =
        format!("{STUDY}&subject=new&pseudonym=S7&height_m=5+ft+8+in&body_mass_kg=145+lb&number_of_trials=1&seed=1");
    let study = made(&service.post_text("/studies/new", FORM, &body).await);
    let body = service.get(study).await.plan.body;
    assert_eq!((body.height_m, body.body_mass_kg), (1.727, 65.77));
    service.stop().await;
}

#[tokio::test]
async fn subject_form_reports_every_refused_field() {
    let (_folder, service) = service().await;
    let refused =
        service.post_text("/subjects", FORM, "pseudonym=a%40b&height_m=tall&body_mass_kg=20&notes=quiet").await;
    is_page(&refused, StatusCode::UNPROCESSABLE_ENTITY, "a code assigned by the site");
    for says in ["\u{201c}Height, m\u{201d}", "\u{201c}Body mass, kg\u{201d}", "quiet</textarea>", "value=\"tall\""] {
        assert!(refused.text.contains(says), "{says}: {}", refused.text);
    }
    service.stop().await;
}

#[tokio::test]
async fn taken_pseudonym_is_reported_with_the_other_refused_fields() {
    let (_folder, service) = service().await;
    service.subject().await;
    let add = async |rest: &str| service.post_text("/subjects", FORM, &format!("pseudonym=paper-1&{rest}")).await;
    let refused = add("height_m=180&body_mass_kg=x").await;
    is_page(&refused, StatusCode::UNPROCESSABLE_ENTITY, "3 fields need correcting");
    for says in ["Choose another pseudonym", "Did you mean 1.8 m?", "\u{201c}Body mass, kg\u{201d}", "value=\"180\""] {
        assert!(refused.text.contains(says), "{says}: {}", refused.text);
    }
    is_page(&add("height_m=1.8&body_mass_kg=70").await, StatusCode::CONFLICT, "Choose another pseudonym");
    service.stop().await;
}

#[tokio::test]
async fn every_form_reports_all_refused_fields_at_once() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    let study = service.study(|new| new.number_of_trials = 1).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    service.study(|new| (new.number_of_trials, new.name) = (1, Some("Other".to_owned()))).await;
    let device = service.fetch("/api/v1/devices").await.items()[0].clone();
    let values: Vec<String> = gait_optimizer::Device::FIELDS.iter().map(|field| format!("{}=-3", field.name)).collect();
    // A page escapes apostrophes.
    let fields = gait_optimizer::Device::FIELDS.map(|field| field.meaning.replace('\'', "&#39;"));
    for (path, form, says) in [
        (
            "/reference-gaits".to_owned(),
            "name=&format=csv&recording=&height_m=180&body_mass_kg=x&heel_strikes_s=q&button=import".to_owned(),
            vec![
                "5 fields need correcting",
                "\u{201c}Name\u{201d} must be",
                "Did you mean 1.8 m?",
                "\u{201c}Body mass, kg\u{201d} is \u{201c}x\u{201d}",
                "\u{201c}Times of right heel strikes, s\u{201d} is \u{201c}q\u{201d}",
                "<li>File contents",
            ],
        ),
        (
            format!("/devices/{}", device["id"].as_str().unwrap()),
            format!("name=&{}", values.join("&")),
            ["21 fields need correcting", "\u{201c}Name\u{201d}"]
                .into_iter()
                .chain(fields.iter().map(String::as_str))
                .collect(),
        ),
        (
            format!("/subjects/{subject}/correct"),
            "height_m=17.2&body_mass_kg=700&reason=&before=0".to_owned(),
            vec![
                "3 fields need correcting",
                "\u{201c}Height, m\u{201d}",
                "\u{201c}Body mass, kg\u{201d}",
                "\u{201c}Reason\u{201d}",
            ],
        ),
        (
            format!("/subjects/{subject}/muscles"),
            "sol_max_force_n=strong&ta_max_force_n=-5".to_owned(),
            vec!["2 fields need correcting", "soleus: ", "tibialis anterior: ", "value=\"strong\" placeholder"],
        ),
        (
            format!("/studies/{study}/details"),
            format!("button=save&name=other&tags={}&notes=kept", "t".repeat(41)),
            vec![
                "2 fields need correcting",
                "for example \u{201c}other (2)\u{201d}",
                "\u{201c}Tags\u{201d}",
                "kept</textarea>",
            ],
        ),
    ] {
        let refused = service.post_text(&path, FORM, &form).await;
        for holds in says {
            is_page(&refused, StatusCode::UNPROCESSABLE_ENTITY, holds);
        }
        assert!(refused.text.contains("aria-invalid=\"true\" aria-describedby=\"refused\" autofocus"), "{path}");
    }
    service.stop().await;
}

#[tokio::test]
async fn names_of_studies_differ_by_more_than_capitals_at_every_way_in() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    let new = |name: &str| json!({"subject_id": subject, "number_of_trials": 1, "muscles": false, "name": name});
    let first = service.post("/api/v1/studies", &new("Sample study")).await;
    assert_eq!(first.status, StatusCode::CREATED, "{}", first.text);
    let study = first.json()["id"].as_str().unwrap().to_owned();
    let other = service.post("/api/v1/studies", &new("Another")).await.json()["id"].as_str().unwrap().to_owned();
    let twin = json!({"name": " sample  STUDY"});
    for refused in [
        service.post("/api/v1/studies", &new("sample STUDY ")).await,
        service.post(&format!("/api/v1/studies/{other}/clone"), &twin).await,
        service
            .send(
                Request::patch(format!("/api/v1/studies/{other}"))
                    .header("content-type", "application/json")
                    .body(Body::from(twin.to_string()))
                    .unwrap(),
            )
            .await,
    ] {
        assert_eq!((refused.status, &refused.json()["field"]), (StatusCode::UNPROCESSABLE_ENTITY, &json!("name")));
    }
    let sample = made(&service.post_text("/studies/sample", FORM, "").await);
    assert_eq!(service.get(sample).await.plan.name, "Sample study (2)");
    let clone = |of: &str| format!("/api/v1/studies/{of}/clone");
    for name in ["Sample study (clone)", "Sample study (clone) (2)"] {
        assert_eq!(service.post(&clone(&study), &json!({})).await.json()["name"], name);
    }
    let renamed = "button=save&name=SAMPLE+study&tags=&notes=";
    let own = service.post_text(&format!("/studies/{study}/details"), FORM, renamed).await;
    assert_eq!(own.status, StatusCode::SEE_OTHER, "a study can change the capitals of its own name");
    service.stop().await;
}

#[tokio::test]
async fn study_is_renamed_tagged_found_and_archived() {
    let (_folder, service) = service().await;
    let study = service.study(|new| new.number_of_trials = 2).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let other = service.study(|new| (new.number_of_trials, new.name) = (1, Some("Other".to_owned()))).await;
    service.wait_for(other, &[StudyState::Finished]).await;
    let details = format!("/studies/{study}/details");
    let form = "button=save&name=Visit+2&tags=treadmill,+pilot,pilot&notes=shoes%0D%0Anew";
    let saved = service.post_text(&details, FORM, form).await;
    assert_eq!(saved.headers["location"], format!("{details}?saved=true"));
    let confirmed = service.fetch(&format!("{details}?saved=true")).await.text;
    assert!(confirmed.contains("<p class=\"notice good\" role=\"status\">Saved.</p>"));
    let stored = service.get(study).await;
    assert_eq!((stored.plan.name.as_str(), stored.tags.join(" ")), ("Visit 2", "pilot treadmill".to_owned()));
    assert_eq!(stored.notes, "shoes\nnew");
    let lists = async |query: &str| {
        let page = service.fetch(&format!("/{query}")).await.text;
        [study, other].map(|id| page.contains(&format!("<a href=\"/studies/{id}\">")))
    };
    assert_eq!(lists("").await, [true, true]);
    let rest = async |query: &str| {
        let listed = service.fetch(&format!("/api/v1/studies{query}")).await.items();
        [study, other].map(|id| listed.as_array().unwrap().iter().any(|found| found["id"] == id.to_string()))
    };
    for query in ["?text=visit", "?text=SHOES", "?tag=pilot", "?text=treadm&state=finished"] {
        assert_eq!((lists(query).await, rest(query).await), ([true, false], [true, false]), "{query}");
    }
    assert_eq!(lists("?state=not_started").await, [false, false]);
    assert_eq!(lists("?text=%25").await, [false, false], "no wildcard");
    is_page(&service.fetch("/?state=lost").await, StatusCode::UNPROCESSABLE_ENTITY, "a state from the list");

    let taken = service.post_text(&details, FORM, "button=save&name=Other&tags=&notes=kept").await;
    is_page(&taken, StatusCode::UNPROCESSABLE_ENTITY, "for example \u{201c}Other (2)\u{201d}");
    assert!(taken.text.contains("kept</textarea>"), "{}", taken.text);
    let long = format!("button=save&name=x&tags={}&notes=", "t".repeat(41));
    is_page(&service.post_text(&details, FORM, &long).await, StatusCode::UNPROCESSABLE_ENTITY, "\u{201c}Tags\u{201d}");

    let archived = service.post_text(&details, FORM, "button=archive").await;
    assert_eq!((archived.status, &archived.headers["location"]), (StatusCode::SEE_OTHER, &saved.headers["location"]));
    let confirmed = service.fetch(&details).await.text;
    assert!(confirmed.contains("Archived <time") && confirmed.contains("value=\"restore\""), "{confirmed}");
    assert_eq!((lists("").await, lists("?archived=yes").await), ([false, true], [true, false]));
    assert_eq!((rest("").await, rest("?archived=true").await), ([false, true], [true, false]));
    assert!(service.fetch(&format!("/studies/{study}")).await.status.is_success(), "it is still there");
    assert_eq!(service.post_text(&details, FORM, "button=restore").await.status, StatusCode::SEE_OTHER);
    assert_eq!(lists("").await, [true, true]);
    service.stop().await;
}

#[tokio::test]
async fn running_study_cannot_be_archived() {
    let (_folder, service) = service().await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (4, AnswerSource::People)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let refused = service.post_text(&format!("/studies/{study}/details"), FORM, "button=archive").await;
    is_page(&refused, StatusCode::CONFLICT, "A study that has not ended cannot be archived");
    assert!(service.get(study).await.archived_at.is_none());
    service.stop().await;
}

#[tokio::test]
async fn heights_and_masses_have_the_units_that_the_browser_prefers() {
    let (_folder, service) = service().await;
    let study = service.study(|new| new.number_of_trials = 1).await;
    let chosen = service.post_text("/units", FORM, "units=customary").await;
    assert_eq!((chosen.status, &chosen.headers["location"]), (StatusCode::SEE_OTHER, &"/subjects".parse().unwrap()));
    let kept = callers::cookie_of(&chosen, "gaitwright_units");
    let subject = service.subject().await;
    for (path, si, customary) in [
        ("/subjects".to_owned(), "<td class=\"number\">65.7</td>", "<td class=\"number\">145 lb</td>"),
        (format!("/subjects/{subject}"), "65.7 kg (145 lb)", "145 lb (65.7 kg)"),
        (format!("/studies/{study}"), "(1.727 m, 65.7 kg)", "(5 ft 8 in, 145 lb)"),
        ("/studies/new".to_owned(), "paper-1 (1.727 m, 65.7 kg)", "paper-1 (5 ft 8 in, 145 lb)"),
        ("/reference-gaits".to_owned(), "paper-1 (1.727 m, 65.7 kg)", "paper-1 (5 ft 8 in, 145 lb)"),
    ] {
        for (units, shown, other) in [("", si, customary), (kept.as_str(), customary, si)] {
            let request = Request::builder().uri(&path).header("cookie", format!("gaitwright_units={units}"));
            let page = service.send(request.body(Body::empty()).unwrap()).await.text;
            assert!(page.contains(shown) && !page.contains(other), "{path} in {units}: {page}");
        }
    }
    let refused = service.post_text("/units", FORM, "units=furlongs").await;
    assert!(refused.status.is_client_error() && !refused.headers.contains_key("set-cookie"), "{}", refused.status);
    service.stop().await;
}

#[tokio::test]
async fn clone_has_the_set_up_of_its_study_with_relaxed_bounds() {
    let (_folder, service) = service().await;
    let study = service
        .study(|new| {
            (new.number_of_trials, new.seed, new.priority, new.solve_seconds_budget) = (3, 7, 4, Some(500.0));
            new.base_bounds.a6 = 0.25;
        })
        .await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let form = service.fetch(&format!("/studies/new?like={study}&relax=a7%3D35")).await;
    is_page(&form, StatusCode::OK, "with relaxed <a href=\"#bounds\">bounds</a>");
    for filled in
        ["name=\"seed\" value=\"7\"", "name=\"values_a7\" value=\"35, 50\"", "name=\"number_of_trials\" value=\"3\""]
    {
        assert!(form.text.contains(filled), "{filled}");
    }
    let subject = service.subject().await;
    let body = format!("{STUDY}&subject={subject}&number_of_trials=1&seed=8&values_a5=0,0.02&like={study}");
    let clone = service.get(made(&service.post_text("/studies/new", FORM, &body).await)).await.plan;
    assert_eq!((clone.seed, clone.priority, clone.solve_seconds_budget), (8, 4, Some(500.0)), "the rest is copied");
    is_page(&service.fetch(&format!("/studies/new?like={UNKNOWN}")).await, StatusCode::NOT_FOUND, "does not exist");
    is_page(
        &service.fetch(&format!("/studies/new?like={study}&relax=a7%3D900")).await,
        StatusCode::UNPROCESSABLE_ENTITY,
        "5 to 68",
    );
    service.stop().await;
}

#[tokio::test]
async fn equal_names_are_refused_or_numbered_without_naming_hidden_studies() {
    let (_folder, service) = callers::service().await;
    let admin = signed_in(&service, Role::Administrator).await;
    let clinician = signed_in(&service, Role::Clinician).await;
    let subject = service.subject().await;
    let body = |name: &str, extra: &str| {
        format!("{STUDY}&subject={subject}&number_of_trials=1&seed=1&values_a5=0,0.02&name={name}{extra}")
    };
    let send_as =
        async |who: &callers::As, body: &str| send(&service, who, &Method::POST, "/studies/new", FORM, body).await;
    let secret = made(&send_as(&admin, &body("Secret", "&restricted=on")).await);
    let clone = format!("/studies/new?like={secret}");
    assert_eq!(send(&service, &admin, &Method::GET, &clone, "", "").await.status, StatusCode::OK);
    is_page(
        &send(&service, &clinician, &Method::GET, &clone, "", "").await,
        StatusCode::NOT_FOUND,
        "This study does not exist",
    );
    let like = format!("&like={secret}");
    is_page(&send_as(&clinician, &body("Copy", &like)).await, StatusCode::NOT_FOUND, "This study does not exist");
    made(&send_as(&admin, &body("Open", "")).await);
    is_page(&send_as(&admin, &body("Secret", "")).await, StatusCode::UNPROCESSABLE_ENTITY, "Secret (2)");
    is_page(&send_as(&clinician, &body("Open", "")).await, StatusCode::UNPROCESSABLE_ENTITY, "Open (2)");
    made(&send_as(&clinician, &body("Secret", "")).await);
    let first = made(&send_as(&clinician, &body("", "")).await);
    let second = made(&send_as(&clinician, &body("", "")).await);
    let name = service.get(first).await.plan.name;
    assert_eq!(service.get(second).await.plan.name, format!("{name} (2)"), "a default name is numbered");
    service.stop().await;
}

#[tokio::test]
async fn empty_record_offers_a_sample_study() {
    let (_folder, service) = service().await;
    assert!(service.fetch("/").await.text.contains("action=\"/studies/sample\""));
    let study = made(&service.post_text("/studies/sample", FORM, "").await);
    service.wait_for(study, &[StudyState::Finished]).await;
    assert_eq!(service.get(study).await.plan.name, "Sample study");
    assert!(!service.fetch("/").await.text.contains("action=\"/studies/sample\""));
    service.stop().await;
}

#[tokio::test]
async fn withdrawal_needs_confirmation_and_the_subject_is_offered_no_more() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    let page = format!("/subjects/{subject}/withdraw");
    let refused = service.post_text(&page, FORM, "reason=moved+away").await;
    is_page(&refused, StatusCode::CONFLICT, "First tick the box");
    assert!(refused.text.contains("value=\"moved away\""), "the reason is kept");
    let option = format!("<option value=\"{subject}\"");
    assert!(service.fetch("/studies/new").await.text.contains(&option));
    let done = service.post_text(&page, FORM, "reason=moved+away&confirmed=yes").await;
    assert_eq!(done.status, StatusCode::SEE_OTHER);
    for page in ["/studies/new", "/reference-gaits"] {
        assert!(!service.fetch(page).await.text.contains(&option), "{page}");
    }
    assert!(service.fetch("/subjects").await.text.contains("consent withdrawn"));
    let form = service.fetch(&format!("/studies/new?subject={subject}")).await.text;
    let select = form.split_once("<select id=\"subject\"").unwrap().1.split_once("</select>").unwrap().0;
    assert!(form.contains("withdrew consent and cannot have new studies"), "{form}");
    assert_eq!(select.matches(" selected").count(), 1, "{select}");
    assert!(select.contains("<option value=\"\" selected>Choose a subject"), "{select}");
    service.stop().await;
}

#[tokio::test]
async fn navigation_marks_the_present_page() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    for (path, marked) in [
        ("/".to_owned(), "href=\"/\" aria-current=\"page\""),
        ("/studies/new".to_owned(), "href=\"/studies/new\" aria-current=\"page\""),
        ("/lab".to_owned(), "href=\"/lab\" aria-current=\"page\""),
        (format!("/subjects/{subject}"), "href=\"/subjects\" aria-current=\"true\""),
        ("/system".to_owned(), "href=\"/system\" aria-current=\"page\""),
    ] {
        let page = service.fetch(&path).await.text;
        let navigation = page.split("<nav aria-label=\"Main\">").nth(1).unwrap().split("</nav>").next().unwrap();
        assert!(navigation.contains(marked), "{path}: {navigation}");
        assert_eq!(navigation.matches("aria-current").count(), 1, "{path}");
    }
    service.stop().await;
}
