//! The access log: every view and export of subject data and every refusal leaves a row.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::Router;
use axum::body::Body;
use axum::http::{Method, Request, StatusCode, header};
use axum::middleware::map_request;
use axum::routing::{any, get};
use gaitwright_http::access_log_layer::NO_SUBJECT_DATA;
use gaitwright_http::{openapi, with_layers};
use gaitwright_service::access::{Right, Role};
use gaitwright_store::access_log::{self, Access, AccessKind, AccessRow, Tally};
use gaitwright_store::audit::Actor;
use gaitwright_store::seals::{self, SealCheck};
use gaitwright_store::studies::StudyState;
use gaitwright_store::{StudyId, commit, now};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::callers::{self, As, FORM, send, signed_in, token};
use gaitwright_tests::cli;
use gaitwright_tests::page_routes;
use gaitwright_tests::service::{Service, for_localhost};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use tempfile::TempDir;
use tower::ServiceExt;

const ANY_ID: &str = "01890000-0000-7000-8000-000000000000";

/// Every route that is read: pages as the router lists them, operations as the description does.
fn read_routes() -> BTreeSet<String> {
    let all = page_routes::all().into_iter().chain(operations());
    all.filter(|(method, _)| *method == Method::GET).map(|(_, path)| path).collect()
}

/// Every operation of the description, as method and path.
fn operations() -> Vec<(Method, String)> {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let paths = document["paths"].as_object().unwrap().iter();
    let of_path = |(path, item): (&String, &Value)| {
        let methods = item.as_object().unwrap().keys().filter_map(|name| name.to_uppercase().parse::<Method>().ok());
        let known = |method: &Method| [Method::GET, Method::POST, Method::PUT, Method::PATCH].contains(method);
        methods.filter(known).map(|method| (method, path.clone())).collect::<Vec<_>>()
    };
    paths.flat_map(of_path).collect()
}

/// A path of a route.
fn path_of(route: &str) -> String {
    let path = route.replace("{id}", ANY_ID).replace("{code}", "secret").replace("{side}", "first");
    path.replace("{link}", "secret").replace("{file}", "a.svg").replace("{name}", "conflict")
}

async fn rows(service: &Service) -> Vec<AccessRow> {
    service.access.log.write(&service.store, true).await.unwrap();
    stored(service).await
}

async fn stored(service: &Service) -> Vec<AccessRow> {
    access_log::page(&mut service.store.read().await.unwrap(), "", None, None, 1000).await.unwrap()
}

async fn with_study() -> (TempDir, Service, StudyId) {
    let (folder, service) = callers::service().await;
    let study = service.study(|new| new.number_of_trials = 2).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    (folder, service, study)
}

#[tokio::test]
async fn every_view_of_subject_data_is_logged() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let routes = read_routes();
    assert!(routes.len() > 70, "{routes:?}");
    for known in NO_SUBJECT_DATA {
        assert!(
            !["subject", "stud", "trial", "lab", "rate", "blind"].iter().any(|word| known.contains(word)),
            "{known}"
        );
    }
    // A response of the route is logged, whatever its handler does.
    let mut all = Router::new();
    for route in &routes {
        all = all.route(route, get(async || "shown"));
    }
    let router = with_layers(all, service.state()).layer(map_request(for_localhost));
    for route in &routes {
        let path = path_of(route);
        let answer = router.clone().oneshot(Request::get(&path).body(Body::empty()).unwrap()).await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK, "{path}");
    }
    let noted: BTreeSet<String> = rows(&service).await.into_iter().map(|row| row.route).collect();
    for route in routes {
        let expected = !NO_SUBJECT_DATA.contains(&route.as_str());
        assert_eq!(noted.contains(&route), expected, "{route}");
    }
    assert!(rows(&service).await.iter().all(|row| !row.object.contains("secret")), "a secret is in the log");
    service.stop().await;
}

#[tokio::test]
async fn every_change_that_returns_subject_data_is_logged() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let changes: Vec<_> = operations().into_iter().filter(|(method, _)| *method != Method::GET).collect();
    assert!(changes.len() > 45, "{changes:?}");
    let mut all = Router::new();
    for route in changes.iter().map(|(_, route)| route).collect::<BTreeSet<_>>() {
        all = all.route(route, any(async || "shown"));
    }
    let router = with_layers(all, service.state()).layer(map_request(for_localhost));
    for (method, route) in &changes {
        let request = Request::builder().method(method).uri(path_of(route)).body(Body::empty()).unwrap();
        assert_eq!(router.clone().oneshot(request).await.unwrap().status(), StatusCode::OK, "{method} {route}");
    }
    let noted: BTreeSet<(String, String)> =
        rows(&service).await.into_iter().map(|row| (row.method, row.route)).collect();
    for (method, route) in changes {
        let expected = !NO_SUBJECT_DATA.contains(&route.as_str());
        assert_eq!(noted.contains(&(method.to_string(), route.clone())), expected, "{method} {route}");
    }
    service.stop().await;
}

#[tokio::test]
async fn token_without_read_right_is_logged_when_a_change_returns_a_study() {
    let (_folder, service, study) = with_study().await;
    let runs = token(&service, &[Right::Run]).await;
    let subject = service.subject().await;
    let path = format!("/api/v1/studies/{study}");
    assert_eq!(send(&service, &runs, &Method::GET, &path, FORM, "").await.status, StatusCode::FORBIDDEN);
    let json = "application/json";
    let changed = send(&service, &runs, &Method::PATCH, &path, json, r#"{"priority": 3}"#).await;
    assert!(changed.status == StatusCode::OK && changed.json()["subject_id"] == subject.to_string());
    let cloned = send(&service, &runs, &Method::POST, &format!("{path}/clone"), json, "{}").await;
    assert_eq!(cloned.status, StatusCode::CREATED, "{}", cloned.text);
    let body = r#"{"pseudonym": "P2", "height_m": 1.8, "body_mass_kg": 70}"#;
    let added = send(&service, &runs, &Method::POST, "/api/v1/subjects", json, body).await;
    let added = Some(added.json()["id"].as_str().unwrap().parse().unwrap());
    let views = rows(&service).await.into_iter().filter(|row| row.kind == AccessKind::View);
    let views: Vec<_> = views.map(|row| (row.method, row.actor, row.study_id, row.subject_id)).collect();
    let seen = |method: &str, study, subject| (method.to_owned(), "token [Run]".to_owned(), study, subject);
    for view in
        [seen("PATCH", Some(study), Some(subject)), seen("POST", Some(study), Some(subject)), seen("POST", None, added)]
    {
        assert!(views.contains(&view), "{view:?} of {views:?}");
    }
    assert_eq!(views.len(), 3, "{views:?}");
    service.stop().await;
}

#[tokio::test]
async fn log_rows_name_caller_object_and_subject() {
    let (_folder, service, study) = with_study().await;
    let (clinician, admin) =
        (signed_in(&service, Role::Clinician).await, signed_in(&service, Role::Administrator).await);
    let script = token(&service, &[Right::Rate]).await;
    let subject = service.subject().await;
    let trial = service.trials(study).await[0].id;
    let fetch = async |who: &As, path: &str| send(&service, who, &Method::GET, path, FORM, "").await;
    for _ in 0..3 {
        assert_eq!(fetch(&clinician, &format!("/subjects/{subject}")).await.status, StatusCode::OK);
    }
    for path in [format!("/trials/{trial}"), format!("/studies/{study}"), format!("/api/v1/trials/{trial}/gait")] {
        assert_eq!(fetch(&clinician, &path).await.status, StatusCode::OK, "{path}");
    }
    // The row of an export is on the disk before the response is sent.
    let csv = format!("/api/v1/studies/{study}/trials.csv");
    for (who, method, path) in [
        (&clinician, Method::GET, csv.clone()),
        (&admin, Method::GET, format!("/api/v1/studies/{study}/archive")),
        (&admin, Method::POST, "/api/v1/backups".to_owned()),
    ] {
        let answer = send(&service, who, &method, &path, "application/json", "").await;
        assert!(answer_is_success(answer.status), "{path}: {}", answer.status);
        let newest = stored(&service).await.into_iter().find(|row| row.kind == AccessKind::Export).unwrap();
        assert_eq!(newest.object, path);
    }
    assert_eq!(fetch(&As::Token("gait_nothing".to_owned()), &csv).await.status, StatusCode::UNAUTHORIZED);
    assert_eq!(fetch(&script, &csv).await.status, StatusCode::FORBIDDEN);
    service.post_text("/sign-in", FORM, "name=nobody&password=wrong").await;
    fetch(&As::Nobody, "/health").await;
    // A study that the caller may not see is not found.
    let (access, json) = (format!("/api/v1/studies/{study}/access"), "application/json");
    let restricted = send(&service, &admin, &Method::PUT, &access, json, r#"{"restricted": true}"#).await;
    assert_eq!(restricted.status, StatusCode::OK, "{}", restricted.text);
    let hidden = format!("/studies/{study}?tab=hidden");
    assert_eq!(fetch(&clinician, &hidden).await.status, StatusCode::NOT_FOUND);

    let rows = rows(&service).await;
    let of = |kind: AccessKind, start: &str| {
        rows.iter().filter(|row| row.kind == kind && row.object.starts_with(start)).collect::<Vec<_>>()
    };
    let subject_views = of(AccessKind::View, "/subjects/");
    assert!(subject_views.len() == 1 && subject_views[0].times == 3, "{subject_views:?}");
    assert_eq!(
        (subject_views[0].subject_id, subject_views[0].actor.as_str()),
        (Some(subject), "clinician a clinician")
    );
    for start in ["/trials/", "/studies/", "/api/v1/trials/"] {
        let views = of(AccessKind::View, start);
        assert!(
            views.len() == 1 && views[0].subject_id == Some(subject) && views[0].study_id == Some(study),
            "{start}"
        );
    }
    let refused = of(AccessKind::Refused, &csv);
    let who: BTreeSet<(&str, u16)> = refused.iter().map(|row| (row.actor.as_str(), row.status)).collect();
    assert_eq!(who, BTreeSet::from([("an anonymous visitor", 401), ("token [Rate]", 403)]), "{refused:?}");
    assert_eq!(of(AccessKind::Refused, "/sign-in").len(), 1);
    let hidden = of(AccessKind::Refused, &hidden);
    assert!(hidden.len() == 1 && hidden[0].status == 404 && hidden[0].subject_id == Some(subject), "{hidden:?}");
    assert!(rows.iter().all(|row| row.route != "/health"));

    // Administrators search it, by page and by program.
    let found = fetch(&admin, &format!("/api/v1/access-log?subject_id={subject}&text=EXPORT")).await.items();
    assert_eq!(found.as_array().unwrap().len(), 2, "{found}");
    let page = fetch(&admin, &format!("/access-log?subject={subject}&text=trials.csv")).await;
    assert!(page.status == StatusCode::OK && page.text.contains("trials.csv") && page.text.contains("paper-1"));
    assert_eq!(fetch(&clinician, "/api/v1/access-log").await.status, StatusCode::FORBIDDEN);
    service.stop().await;
}

#[tokio::test]
async fn every_spelling_of_an_identifier_every_refused_form_and_every_second_subject_is_logged() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let first = service.study(|new| new.number_of_trials = 2).await;
    let described = json!({"pseudonym": "S09", "height_m": 1.7, "body_mass_kg": 66});
    let other = service.post("/api/v1/subjects", &described).await.json()["id"].as_str().unwrap().to_owned();
    let second = service.study(|new| (new.number_of_trials, new.subject_id) = (2, other.parse().unwrap())).await;
    for study in [first, second] {
        service.wait_for(study, &[StudyState::Finished]).await;
    }
    let own = service.get(first).await.plan.subject_id.to_string();
    let [upper, simple] = [first.to_string().to_uppercase(), first.to_string().replace('-', "")];
    let padding = "p".repeat(400);
    let encoded = format!("{first}%2C{}", second.to_string().replace('-', "%2d"));
    let pages = [
        (format!("/api/v1/studies/{upper}"), 1),
        (format!("/api/v1/studies/{simple}"), 1),
        (format!("/api/v1/studies/%7B{first}%7D/trials.csv"), 1),
        (format!("/studies/compare?pad={padding}&study={first}&study={second}"), 2),
        (format!("/api/v1/study-comparison?ids={encoded}"), 2),
    ];
    for (path, subjects) in &pages {
        let before = rows(&service).await.len();
        let answer = service.fetch(path).await;
        assert_eq!(answer.status, StatusCode::OK, "{path}: {}", answer.text);
        let all = rows(&service).await;
        let found: BTreeSet<_> =
            all[..all.len() - before].iter().map(|row| row.subject_id.map(|id| id.to_string())).collect();
        let expected = [&own, &other].into_iter().take(*subjects).map(|id| Some(id.clone())).collect();
        assert_eq!(found, expected, "{path}");
    }
    let before = rows(&service).await.len();
    let refused = service.post_text(&format!("/studies/{second}/lab"), FORM, "trial_a=x&trial_b=y").await;
    assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY);
    let all = rows(&service).await;
    assert_eq!(all.len(), before + 1);
    assert_eq!(
        (all[0].kind, all[0].subject_id.map(|id| id.to_string()), all[0].status),
        (AccessKind::View, Some(other), 422)
    );
    service.stop().await;
}

fn answer_is_success(status: StatusCode) -> bool {
    status.is_success()
}

#[tokio::test]
async fn views_are_logged_within_seconds() {
    let (_folder, service, study) = with_study().await;
    let clinician = signed_in(&service, Role::Clinician).await;
    send(&service, &clinician, &Method::GET, &format!("/studies/{study}"), FORM, "").await;
    for _ in 0..100 {
        if stored(&service).await.iter().any(|row| row.object == format!("/studies/{study}")) {
            service.stop().await;
            return;
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
    }
    panic!("the view was not written");
}

#[tokio::test]
async fn access_log_is_append_only_and_pruned_by_age_only() {
    let (_folder, service, study) = with_study().await;
    let mut writer = service.store.write().await.unwrap();
    for days in [400, 399, 10] {
        let at = now().plus_seconds(-86_400 * days);
        let tally = Tally { first_at: at, last_at: at, times: 1 };
        access_log::append(&mut writer, &[(view(study, &format!("{days} days")), tally)]).await.unwrap();
    }
    commit(writer).await.unwrap();
    for sql in ["delete from access_log", "update access_log set actor = 'nobody'"] {
        let mut writer = service.store.write().await.unwrap();
        assert!(sqlx::query(sql).execute(&mut **writer).await.is_err(), "{sql}");
    }
    let mut writer = service.store.write().await.unwrap();
    assert_eq!(access_log::prune(&mut writer, &Actor::program(), 365, 100).await.unwrap(), 2);
    assert_eq!(access_log::prune(&mut writer, &Actor::program(), 365, 100).await.unwrap(), 0);
    commit(writer).await.unwrap();
    let left: Vec<String> = stored(&service).await.into_iter().map(|row| row.object).collect();
    assert_eq!(left, ["10 days"]);
    let check = seals::verify(&mut service.store.read().await.unwrap()).await.unwrap();
    assert!(matches!(check, SealCheck::Intact { .. }), "{check:?}");
    service.stop().await;
}

fn view(study: StudyId, object: &str) -> Access {
    Access {
        kind: AccessKind::View,
        actor: "clinician K".to_owned(),
        address: "192.0.2.7".to_owned(),
        method: "GET".to_owned(),
        route: "/studies/{id}".to_owned(),
        object: object.to_owned(),
        status: 200,
        named: vec![study.to_string()],
    }
}

#[tokio::test]
async fn command_line_export_and_backup_are_logged_while_the_service_runs() {
    let (folder, service, study) = with_study().await;
    let run = |words: &str| {
        let arguments: Vec<&str> = words.split(' ').collect();
        let output = cli::run(env!("CARGO_BIN_EXE_gaitwright-cli"), folder.path(), &arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    run(&format!("export {study} s.gait --database a.db"));
    run("backup copy.db --database a.db");
    let rows = rows(&service).await;
    let of = |command: &str| rows.iter().find(|row| row.route == command).unwrap();
    let export = of("gaitwright export");
    assert_eq!(
        (export.kind, export.study_id, export.actor.as_str()),
        (AccessKind::Export, Some(study), "command line")
    );
    assert_eq!(of("gaitwright backup").object, "the whole record");
    let again = stored(&service).await.len();
    service.access.log.write(&service.store, true).await.unwrap();
    assert_eq!(stored(&service).await.len(), again, "each is taken once");
    service.stop().await;
}

#[tokio::test]
async fn corrected_height_and_mass_apply_to_new_studies_only() {
    let (_folder, service, study) = with_study().await;
    let admin = signed_in(&service, Role::Administrator).await;
    let subject = service.subject().await;
    let trial = service.trials(study).await[0].id;
    let fetch = async |path: String| send(&service, &admin, &Method::GET, &path, FORM, "").await;
    let problem =
        async |trial| fetch(format!("/api/v1/trials/{trial}/problem.json")).await.json()["problem"]["subject"].clone();
    let before = problem(trial).await;
    let correct = async |body: &str| {
        let path = format!("/api/v1/subjects/{subject}/corrections");
        send(&service, &admin, &Method::POST, &path, "application/json", body).await
    };
    let unknown = r#"{"height_m": 17, "body_mass_kg": 70, "reason": "r"}"#;
    assert_eq!(correct(unknown).await.status, StatusCode::UNPROCESSABLE_ENTITY);
    let blank = r#"{"height_m": 1.7, "body_mass_kg": 70, "reason": " "}"#;
    assert_eq!(correct(blank).await.status, StatusCode::UNPROCESSABLE_ENTITY);
    let right = r#"{"height_m": 1.75, "body_mass_kg": 71.5, "reason": "misread the scale"}"#;
    assert_eq!(correct(right).await.status, StatusCode::CREATED);
    assert_eq!(correct(right).await.status, StatusCode::CONFLICT, "nothing would change");

    let shown = fetch(format!("/api/v1/subjects/{subject}")).await.json();
    assert_eq!((&shown["height_m"], &shown["body_mass_kg"]), (&1.75.into(), &71.5.into()));
    assert_eq!(problem(trial).await, before, "a study keeps the numbers that it was made with");
    // Also for trials to come.
    let extend = format!("/api/v1/studies/{study}/extend");
    send(&service, &admin, &Method::POST, &extend, "application/json", r#"{"number_of_trials": 3}"#).await;
    service.wait_for_trials(study, 3).await;
    assert_eq!(problem(service.trials(study).await[2].id).await, before);
    let new = service.study(|new| new.number_of_trials = 1).await;
    service.wait_for_trials(new, 1).await;
    let after = problem(service.trials(new).await[0].id).await;
    assert_eq!((&after["height_m"], &after["body_mass_kg"]), (&1.75.into(), &71.5.into()));

    let form = "height_m=1.76&body_mass_kg=71.5&reason=measured+again&before=1";
    let page = format!("/subjects/{subject}/correct");
    assert_eq!(send(&service, &admin, &Method::POST, &page, FORM, form).await.status, StatusCode::SEE_OTHER);
    let twice = send(&service, &admin, &Method::POST, &page, FORM, form).await;
    assert!(
        twice.status == StatusCode::CONFLICT && twice.text.contains("corrected after this form was loaded"),
        "{}",
        twice.text
    );
    let page = fetch(format!("/subjects/{subject}")).await.text;
    assert!(page.contains("misread the scale") && page.contains("1.76 m"), "{page}");
    let trail = fetch("/api/v1/audit?limit=1".to_owned()).await;
    let audit = fetch("/audit?text=subject.correct".to_owned()).await.text;
    let as_shown = fetch("/audit?text=subject%3A%20correct".to_owned()).await.text;
    assert!(as_shown.contains("misread the scale") && as_shown.contains("<td>subject: correct</td>"), "{as_shown}");
    assert!(audit.contains("misread the scale") && trail.headers[header::CONTENT_TYPE] == "application/json");
    service.stop().await;
}
