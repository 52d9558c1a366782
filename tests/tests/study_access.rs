//! Access to studies: raters access those they are assigned to, staff access open studies, and members access
//! restricted ones.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Method, Request, StatusCode, header};
use gaitwright_http::openapi;
use gaitwright_service::access::{Right, Role};
use gaitwright_store::members::MemberKind;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_store::{StudyId, audit};
use gaitwright_tests::callers::{As, FORM, member, send, service, signed_in, token};
use gaitwright_tests::measured::joint_angles;
use gaitwright_tests::page_routes;
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::time::Duration;
use tempfile::TempDir;
use tower::ServiceExt;

const JSON: &str = "application/json";
const UNKNOWN: &str = "01890000-0000-7000-8000-000000000000";
const NAME: &str = "stiff ankle of B7";

/// A restricted study with something of every kind that an address can name, and an administrator.
struct Closed {
    _folder: TempDir,
    service: Service,
    admin: As,
    study: StudyId,
    /// By the start of the address: what stands for `{id}` or `{code}` there.
    names: BTreeMap<&'static str, String>,
}

async fn post(service: &Service, who: &As, path: &str, body: &Value) -> Value {
    change(service, who, &Method::POST, path, body).await
}

async fn put(service: &Service, who: &As, path: &str, body: &Value) -> Value {
    change(service, who, &Method::PUT, path, body).await
}

async fn change(service: &Service, who: &As, method: &Method, path: &str, body: &Value) -> Value {
    let answer = send(service, who, method, path, JSON, &body.to_string()).await;
    assert!(answer.status.is_success(), "{path}: {} {}", answer.status, answer.text);
    answer.json()
}

impl Closed {
    async fn new() -> Self {
        let (folder, service) = service().await;
        let admin = signed_in(&service, Role::Administrator).await;
        let set_up = |new: &mut gaitwright_service::studies::study_plan::NewStudy| {
            (new.name, new.answer_source, new.number_of_trials) = (Some(NAME.to_owned()), AnswerSource::Both, 30);
        };
        let study = service.study(set_up).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        let trials = service.trials(study).await;
        let gaits: Vec<_> = trials.iter().filter(|trial| trial.state == TrialState::Converged).collect();
        let (a, b) = (gaits[0].id, gaits[1].id);
        let api = format!("/api/v1/studies/{study}");
        let assessment = json!({"trial_a": a, "trial_b": gaits[2].id, "answer": "cannot_tell"});
        let assessment = post(&service, &admin, &format!("{api}/assessments"), &assessment).await;
        let pair = json!({"trial_a": a, "trial_b": b, "answer": "a"});
        let preference = post(&service, &admin, &format!("{api}/preferences"), &pair).await;
        let suggestion = json!({"over": b, "bounds": gaits[2].action});
        let suggestion = post(&service, &admin, &format!("{api}/suggestions"), &suggestion).await;
        let session = json!({"trial_a": a, "trial_b": b});
        let session = post(&service, &admin, &format!("{api}/lab-sessions"), &session).await;
        let session = session["id"].as_str().unwrap().to_owned();
        post(&service, &admin, &format!("/api/v1/lab-sessions/{session}/walks"), &json!({"walk": 1})).await;
        let measured = json!({"walk": 1, "recording": joint_angles()});
        let brought = post(
            &service,
            &admin,
            &format!("/api/v1/lab-sessions/{session}/measurement-files/joint-angles"),
            &measured,
        )
        .await;
        member(&service, study, MemberKind::User, "a administrator").await;
        put(&service, &admin, &format!("{api}/access"), &json!({"restricted": true})).await;
        let listed = send(&service, &admin, &Method::GET, &format!("{api}/members"), "", "").await.items();
        let id = |value: &Value| value["id"].as_str().unwrap().to_owned();
        let names = BTreeMap::from([
            ("studies", study.to_string()),
            ("rate", study.to_string()),
            ("trials", a.to_string()),
            ("jobs", format!("solve-{a}")),
            ("preferences", id(&preference)),
            ("assessments", id(&assessment)),
            ("suggestions", id(&suggestion)),
            ("lab-sessions", session.clone()),
            ("lab", session),
            ("measurement-files", id(&brought)),
            ("study-members", id(&listed[0])),
        ]);
        Self { _folder: folder, service, admin, study, names }
    }

    /// Every caller with rights who is not a member.
    async fn outsiders(&self) -> Vec<(As, &'static str, MemberKind, String)> {
        let mut all = Vec::new();
        for (role, name) in [(Role::Clinician, "a clinician"), (Role::Rater, "a rater")] {
            all.push((signed_in(&self.service, role).await, name, MemberKind::User, name.to_owned()));
        }
        for right in [Right::Read, Right::Run, Right::Answer, Right::Rate] {
            let name = format!("{:?}", [right]);
            all.push((token(&self.service, &[right]).await, right.as_str(), MemberKind::Token, name));
        }
        all
    }
}

/// Addresses of the whole service, which reveal no study.
const SHARED: [&str; 7] = ["backups", "subjects", "devices", "reference-gaits", "users", "tokens", "sessions"];
/// The same of pages.
const SHARED_PAGES: [&str; 3] = ["subjects", "devices", "reference-gaits"];

/// Every operation of the description and every page that names something of a study: method, address with placeholders,
/// and the start that says what it names.
fn entry_points() -> Vec<(Method, String, String)> {
    let mut all = Vec::new();
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    for (path, item) in document["paths"].as_object().unwrap() {
        let start = path.split('/').nth(3).unwrap_or_default();
        if !path.contains("{id}") || SHARED.contains(&start) {
            continue;
        }
        for method in item.as_object().unwrap().keys() {
            all.push((method.to_uppercase().parse().unwrap(), path.clone(), start.to_owned()));
        }
    }
    for (method, path) in page_routes::all() {
        let start = path.split('/').nth(1).unwrap().to_owned();
        if path.contains("{id}") && !SHARED_PAGES.contains(&start.as_str()) {
            all.push((method, path, start));
        }
    }
    all
}

/// Status and text of an answer, without the identifiers of what was asked for and of the request.
fn without_identifiers(answer: &Answer, id: &str) -> (StatusCode, String) {
    let request = answer.headers["x-request-id"].to_str().unwrap();
    (answer.status, answer.text.replace(id, "ID").replace(request, "REQUEST"))
}

/// Calls an entry point with a body that it may refuse.
async fn call(service: &Service, who: &As, method: &Method, path: &str, id: &str) -> Answer {
    let address = path.replace("{id}", id).replace("{file}", "rmse.csv");
    let (kind, body) = if path.starts_with("/api/") { (JSON, "{}") } else { (FORM, "") };
    send(service, who, method, &address, kind, if *method == Method::GET { "" } else { body }).await
}

/// The newest row of the audit trail.
async fn newest_act(service: &Service) -> String {
    let rows = audit::page(&mut service.store.read().await.unwrap(), "", None, 1).await.unwrap();
    format!("{} {}", rows[0].seq, rows[0].change)
}

#[tokio::test]
async fn every_entry_point_reports_a_restricted_study_as_unknown_to_non_members() {
    let closed = Closed::new().await;
    let outsiders = closed.outsiders().await;
    let before = newest_act(&closed.service).await;
    let entry_points = entry_points();
    assert!(entry_points.len() > 100, "{}", entry_points.len());
    let mut refused = BTreeMap::new();
    for (method, path, start) in &entry_points {
        let what = || panic!("{path}: add what it names to `names`, or add it to `SHARED`");
        let id = closed.names.get(start.as_str()).unwrap_or_else(what);
        for (who, name, ..) in &outsiders {
            let there = call(&closed.service, who, method, path, id).await;
            let unknown = if path.contains("/jobs/") { format!("solve-{UNKNOWN}") } else { UNKNOWN.to_owned() };
            let nowhere = call(&closed.service, who, method, path, &unknown).await;
            let said = format!("{method} {path} as {name}: {} {}", there.status, there.text);
            assert!(matches!(there.status, StatusCode::NOT_FOUND | StatusCode::FORBIDDEN), "{said}");
            assert_eq!(without_identifiers(&there, id), without_identifiers(&nowhere, &unknown), "{said}");
            *refused.entry(*name).or_insert(0) += usize::from(there.status == StatusCode::NOT_FOUND);
        }
    }
    // Callers with the right are refused because of the study, not for lack of a right.
    assert!(refused.values().all(|count| *count > 0) && refused["a clinician"] > 90, "{refused:?}");
    assert_eq!(newest_act(&closed.service).await, before, "nothing was changed");

    // The same callers as members: every entry point that their rights cover accepts them.
    for (_, _, kind, name) in &outsiders {
        member(&closed.service, closed.study, *kind, name).await;
    }
    for (method, path, start) in entry_points.iter().filter(|(method, ..)| *method == Method::GET) {
        for (who, name, ..) in &outsiders {
            if path.ends_with("/events") {
                continue;
            }
            let there = call(&closed.service, who, method, path, &closed.names[start.as_str()]).await;
            let unknown = if path.contains("/jobs/") { format!("solve-{UNKNOWN}") } else { UNKNOWN.to_owned() };
            let nowhere = call(&closed.service, who, method, path, &unknown).await;
            let said = format!("{method} {path} as {name}: {} {}", there.status, there.text);
            let same =
                without_identifiers(&there, &closed.names[start.as_str()]) == without_identifiers(&nowhere, UNKNOWN);
            assert_eq!(same, there.status == StatusCode::FORBIDDEN, "{said}");
        }
    }
    closed.service.stop().await;
}

#[tokio::test]
async fn studies_of_a_subject_who_withdrew_cannot_be_changed_except_by_removing_members() {
    let closed = Closed::new().await;
    let (service, admin, study) = (&closed.service, &closed.admin, closed.study);
    let subject = service.subject().await;
    post(service, admin, &format!("/api/v1/subjects/{subject}/withdraw"), &json!({"reason": "moved away"})).await;
    let before = newest_act(service).await;
    let changing = entry_points().into_iter().filter(|(method, ..)| *method != Method::GET);
    let removal = ["/api/v1/study-members/{id}/remove", "/studies/{id}/members"];
    let mut refused = 0;
    for (method, path, start) in changing.filter(|(_, path, _)| !removal.contains(&path.as_str())) {
        let answer = call(service, admin, &method, &path, &closed.names[start.as_str()]).await;
        assert_eq!(answer.status, StatusCode::CONFLICT, "{method} {path}: {}", answer.text);
        assert!(answer.text.contains("withdrew consent"), "{method} {path}: {}", answer.text);
        refused += 1;
    }
    assert!(refused > 40, "{refused}");
    let page = format!("/studies/{study}/members");
    for form in ["button=add&who=user+a+administrator", "button=restrict", "button=open", "button=invite&name=R7"] {
        let answer = send(service, admin, &Method::POST, &page, FORM, form).await;
        assert_eq!(answer.status, StatusCode::CONFLICT, "{form}: {}", answer.text);
    }
    assert_eq!(newest_act(service).await, before, "nothing was changed");
    // The page offers only what is possible.
    let shown = send(service, admin, &Method::GET, &page, "", "").await.text;
    assert!(shown.contains("value=\"remove\"") && shown.contains("withdrew consent"), "{shown}");
    for act in ["add", "open", "restrict", "invite"] {
        assert!(!shown.contains(&format!("value=\"{act}\"")), "{act}: {shown}");
    }

    let listed = send(service, admin, &Method::GET, &format!("/api/v1{page}"), "", "").await.items();
    let remove = format!("/api/v1/study-members/{}/remove", listed[0]["id"].as_str().unwrap());
    post(service, admin, &remove, &json!({})).await;
    assert!(newest_act(service).await.ends_with("study.member_end"));
    closed.service.stop().await;
}

#[tokio::test]
async fn members_are_removed_on_the_page_of_a_study_whose_subject_withdrew() {
    let closed = Closed::new().await;
    let (service, admin, study) = (&closed.service, &closed.admin, closed.study);
    let withdraw = format!("/api/v1/subjects/{}/withdraw", service.subject().await);
    post(service, admin, &withdraw, &json!({"reason": "moved away"})).await;
    let page = format!("/studies/{study}/members");
    let form = format!("button=remove&member={}", closed.names["study-members"]);
    let answer = send(service, admin, &Method::POST, &page, FORM, &form).await;
    assert_eq!(answer.status, StatusCode::SEE_OTHER, "{}", answer.text);
    let listed = send(service, admin, &Method::GET, &format!("/api/v1{page}"), "", "").await.items();
    assert!(listed.as_array().unwrap().is_empty(), "{listed}");
    closed.service.stop().await;
}

/// Checks that an object in a query string, at `{}`, is refused like one that does not exist.
async fn hides_as_unknown(service: &Service, who: &As, path: &str, id: &str) {
    let there = send(service, who, &Method::GET, &path.replace("{}", id), "", "").await;
    let nowhere = send(service, who, &Method::GET, &path.replace("{}", UNKNOWN), "", "").await;
    assert_eq!(there.status, StatusCode::NOT_FOUND, "{path}: {}", there.text);
    assert_eq!(without_identifiers(&there, id), without_identifiers(&nowhere, UNKNOWN), "{path}");
}

#[tokio::test]
async fn lists_show_a_restricted_study_to_members_only() {
    let closed = Closed::new().await;
    let service = &closed.service;
    let open = service.study(|new| new.number_of_trials = 2).await;
    service.wait_for(open, &[StudyState::Finished]).await;
    let outsiders = closed.outsiders().await;
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let subject = service.subject().await;
    let mut lists: Vec<String> =
        document["paths"].as_object().unwrap().keys().filter(|path| !path.contains('{')).cloned().collect();
    lists.extend(
        ["/", "/studies/compare", "/subjects", "/rate", "/lab", "/devices", "/reference-gaits", "/system"]
            .map(Into::into),
    );
    lists.extend([format!("/subjects/{subject}"), format!("/studies/{open}/figures")]);
    let secrets = [NAME.to_owned(), closed.study.to_string(), closed.study.short(), closed.names["lab"].clone()];
    let shown = async |who: &As| {
        let mut shown = Vec::new();
        for path in &lists {
            let answer = send(service, who, &Method::GET, path, "", "").await;
            if secrets.iter().any(|secret| answer.text.contains(secret)) {
                shown.push(path.clone());
            }
        }
        shown
    };
    for (who, name, ..) in &outsiders {
        assert_eq!(shown(who).await, Vec::<String>::new(), "{name}");
    }
    let everywhere = shown(&closed.admin).await;
    for path in ["/", "/api/v1/studies", "/studies/compare", "/lab"] {
        assert!(everywhere.contains(&path.to_owned()), "{path}: {everywhere:?}");
    }
    member(service, closed.study, MemberKind::User, "a clinician").await;
    let mut to_member = shown(&outsiders[0].0).await;
    // For administrators alone.
    to_member.extend(["/api/v1/audit", "/api/v1/access-log"].map(str::to_owned));
    to_member.sort();
    let mut everywhere = everywhere;
    everywhere.sort();
    assert_eq!(to_member, everywhere);

    // Studies and trials in the query string are not accessible either.
    let (other, who) = (open, &outsiders.iter().find(|(_, name, ..)| *name == "read").unwrap().0);
    let study = closed.study;
    for path in [
        format!("/api/v1/study-comparison?ids={other},{{}}"),
        format!("/studies/compare?study={other}&study={{}}"),
        format!("/studies/{other}/figures?other={{}}"),
        format!("/api/v1/studies/{other}/figures/rmse.csv?other={{}}"),
    ] {
        hides_as_unknown(service, who, &path, &study.to_string()).await;
    }
    let trial = service.trials(open).await[0].id;
    for path in [
        format!("/trials/{trial}?other={{}}"),
        format!("/api/v1/trials/{trial}/figures/angles-left-hip.csv?other={{}}"),
    ] {
        hides_as_unknown(service, who, &path, &closed.names["trials"]).await;
    }
    closed.service.stop().await;
}

/// A study that asks people, and a rater who is not assigned to it.
async fn asking() -> (TempDir, Service, StudyId, As) {
    let (folder, service) = service().await;
    let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 6)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let rater = signed_in(&service, Role::Rater).await;
    (folder, service, study, rater)
}

#[tokio::test]
async fn rater_accesses_assigned_studies_only_until_removed() {
    let (_folder, service, study, rater) = asking().await;
    let clinician = signed_in(&service, Role::Clinician).await;
    let next = format!("/api/v1/studies/{study}/blind-pairs/next");
    let list = send(&service, &rater, &Method::GET, "/rate", "", "").await;
    assert!(list.text.contains("You are not assigned to a study yet. Ask"), "{}", list.text);
    assert_eq!(send(&service, &rater, &Method::POST, &next, JSON, "{}").await.status, StatusCode::NOT_FOUND);
    let page = send(&service, &rater, &Method::POST, &format!("/rate/{study}"), FORM, "").await;
    assert_eq!(page.status, StatusCode::NOT_FOUND);

    // A clinician who runs the study assigns the rater.
    let members = format!("/api/v1/studies/{study}/members");
    let new = json!({"kind": "user", "name": "a rater"});
    let added = post(&service, &clinician, &members, &new).await;
    let again = send(&service, &clinician, &Method::POST, &members, JSON, &new.to_string()).await;
    assert_eq!(again.status, StatusCode::CONFLICT, "{}", again.text);
    let nobody = json!({"kind": "user", "name": "R9"}).to_string();
    let unknown = send(&service, &clinician, &Method::POST, &members, JSON, &nobody).await;
    assert_eq!((unknown.status, unknown.json()["field"].clone()), (StatusCode::UNPROCESSABLE_ENTITY, json!("name")));
    let list = send(&service, &rater, &Method::GET, "/rate", "", "").await;
    assert!(list.text.contains(&format!("/rate/{study}")), "{}", list.text);
    let pair = post(&service, &rater, &next, &json!({})).await;
    let code = pair["pair"]["code"].as_str().unwrap().to_owned();
    let addresses = [
        (Method::GET, format!("/api/v1/blind-pairs/{code}/motions/first")),
        (Method::GET, format!("/api/v1/blind-pairs/{code}/motions/second")),
        (Method::GET, format!("/rate/pair/{code}")),
    ];
    for (method, path) in &addresses {
        assert_eq!(send(&service, &rater, method, path, "", "").await.status, StatusCode::OK, "{path}");
    }

    // A removed rater cannot access the open pair either.
    let remove = format!("/api/v1/study-members/{}/remove", added["id"].as_str().unwrap());
    post(&service, &clinician, &remove, &json!({})).await;
    let twice = send(&service, &clinician, &Method::POST, &remove, JSON, "{}").await;
    assert_eq!(twice.status, StatusCode::CONFLICT, "{}", twice.text);
    let (answer, body) = (format!("/api/v1/blind-pairs/{code}/answer"), r#"{"answer": "first"}"#);
    let form = format!("/rate/pair/{code}");
    for (method, path) in &addresses {
        assert_eq!(send(&service, &rater, method, path, "", "").await.status, StatusCode::NOT_FOUND, "{path}");
    }
    assert_eq!(send(&service, &rater, &Method::POST, &answer, JSON, body).await.status, StatusCode::NOT_FOUND);
    let sent = send(&service, &rater, &Method::POST, &form, FORM, "answer=first").await;
    assert_eq!(sent.status, StatusCode::NOT_FOUND);
    let back = send(&service, &rater, &Method::POST, &format!("{form}/retract"), FORM, "").await;
    assert_eq!(back.status, StatusCode::NOT_FOUND);
    let saved = send(&service, &rater, &Method::GET, &format!("/rate?saved={code}"), "", "").await;
    assert_eq!(saved.status, StatusCode::NOT_FOUND);

    // After a new assignment, the pair is accessible again.
    member(&service, study, MemberKind::User, "a rater").await;
    post(&service, &rater, &answer, &json!({"answer": "first"})).await;
    service.stop().await;
}

#[tokio::test]
async fn clinician_who_restricts_a_study_stays_a_member_and_its_clone_is_restricted_too() {
    let (_folder, service, study, _) = asking().await;
    let clinician = signed_in(&service, Role::Clinician).await;
    let script = token(&service, &[Right::Read]).await;
    let path = format!("/api/v1/studies/{study}");
    let status = async |who: &As, path: &str| send(&service, who, &Method::GET, path, "", "").await.status;
    assert_eq!(status(&script, &path).await, StatusCode::OK);
    let access = put(&service, &clinician, &format!("{path}/access"), &json!({"restricted": true})).await;
    assert_eq!(access, json!({"restricted": true}));
    let members = send(&service, &clinician, &Method::GET, &format!("{path}/members"), "", "").await.items();
    assert_eq!(members[0]["name"], "a clinician");
    assert_eq!(status(&script, &path).await, StatusCode::NOT_FOUND);
    assert_eq!(status(&clinician, &path).await, StatusCode::OK);

    member(&service, study, MemberKind::User, "a rater").await;
    let clone = post(&service, &clinician, &format!("{path}/clone"), &json!({})).await;
    let clone = format!("/api/v1/studies/{}", clone["id"].as_str().unwrap());
    assert_eq!(status(&script, &clone).await, StatusCode::NOT_FOUND);
    let members = send(&service, &clinician, &Method::GET, &format!("{clone}/members"), "", "").await.items();
    let names: Vec<_> = members.as_array().unwrap().iter().map(|member| &member["name"]).collect();
    assert_eq!(names, [&json!("a clinician")], "raters are not copied");
    let access = send(&service, &clinician, &Method::GET, &format!("{clone}/access"), "", "").await.json();
    assert_eq!(access["restricted"], true);

    put(&service, &clinician, &format!("{path}/access"), &json!({"restricted": false})).await;
    assert_eq!(status(&script, &path).await, StatusCode::OK);
    service.stop().await;
}

#[tokio::test]
async fn event_stream_of_a_removed_member_ends() {
    let (_folder, service, study, _) = asking().await;
    let admin = signed_in(&service, Role::Administrator).await;
    let As::Session(secret) = signed_in(&service, Role::Clinician).await else { panic!("a session") };
    let added = member(&service, study, MemberKind::User, "a clinician").await;
    let path = format!("/api/v1/studies/{study}");
    put(&service, &admin, &format!("{path}/access"), &json!({"restricted": true})).await;
    let request = Request::get(format!("{path}/events"))
        .header(header::COOKIE, format!("gaitwright_session={secret}"))
        .body(Body::empty())
        .unwrap();
    let stream = service.router().oneshot(request).await.unwrap();
    assert_eq!(stream.status(), StatusCode::OK);
    let read = tokio::spawn(axum::body::to_bytes(stream.into_body(), 1 << 20));
    tokio::time::sleep(Duration::from_millis(200)).await;
    assert!(!read.is_finished(), "the stream stays open for a member");
    post(&service, &admin, &format!("/api/v1/study-members/{}/remove", added.id), &json!({})).await;
    let ended = tokio::time::timeout(Duration::from_secs(10), read).await;
    assert!(ended.is_ok(), "the stream goes on");
    service.stop().await;
}

#[tokio::test]
async fn rater_is_invited_with_assignment_and_link_in_one_step() {
    let (_folder, service, study, _) = asking().await;
    let (admin, clinician) =
        (signed_in(&service, Role::Administrator).await, signed_in(&service, Role::Clinician).await);
    let invite = format!("/api/v1/studies/{study}/invitations");
    let by_clinician = send(&service, &clinician, &Method::POST, &invite, JSON, r#"{"name": "R7"}"#).await;
    assert_eq!(by_clinician.status, StatusCode::FORBIDDEN);
    let staff = send(&service, &admin, &Method::POST, &invite, JSON, r#"{"name": "a clinician"}"#).await;
    assert_eq!(staff.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", staff.text);
    for _ in 0..2 {
        let invited = post(&service, &admin, &invite, &json!({"name": "R7"})).await;
        let link = invited["path"].as_str().unwrap();
        let entered = send(&service, &As::Nobody, &Method::POST, link, FORM, "").await;
        let rater = gaitwright_tests::callers::session_of(&entered);
        let list = send(&service, &rater, &Method::GET, "/rate", "", "").await;
        assert!(list.text.contains(&format!("/rate/{study}")), "{}", list.text);
    }

    // The same on the page; a clinician assigns and removes there.
    let page = format!("/studies/{study}/members");
    let shown = send(&service, &admin, &Method::POST, &page, FORM, "button=invite&name=R8").await;
    assert!(shown.text.contains("R8 is assigned") && shown.text.contains("/sign-in/"), "{}", shown.text);
    let refused = send(&service, &clinician, &Method::POST, &page, FORM, "button=invite&name=R9").await;
    assert_eq!(refused.status, StatusCode::FORBIDDEN);
    let added = send(&service, &clinician, &Method::POST, &page, FORM, "button=add&who=user+a+rater").await;
    assert_eq!(added.status, StatusCode::SEE_OTHER, "{}", added.text);
    let listed = send(&service, &clinician, &Method::GET, &format!("/api/v1{page}"), "", "").await.items();
    let names: Vec<_> = listed.as_array().unwrap().iter().map(|member| &member["name"]).collect();
    assert_eq!(names, ["R7", "R8", "a rater"]);
    let remove = format!("button=remove&member={}", listed[2]["id"].as_str().unwrap());
    let removed = send(&service, &clinician, &Method::POST, &page, FORM, &remove).await;
    assert_eq!(removed.status, StatusCode::SEE_OTHER, "{}", removed.text);
    let shown = send(&service, &clinician, &Method::GET, &page, "", "").await;
    assert!(shown.text.contains("R8") && !shown.text.contains("aria-label=\"Remove a rater\""), "{}", shown.text);
    service.stop().await;
}

#[tokio::test]
async fn study_created_as_restricted_is_never_open() {
    let (_folder, service) = service().await;
    let clinician = signed_in(&service, Role::Clinician).await;
    let other = token(&service, &[Right::Read, Right::Run]).await;
    let subject = service.subject().await;
    let body = json!({"subject_id": subject, "start": false, "restricted": true});
    let made = post(&service, &clinician, "/api/v1/studies", &body).await;
    let form = format!(
        "muscles=on&answer_source=gait_rmse&number_of_trials=1&parallel_trials=1&seed=1&tuned_a5=on&reference_gait=&restricted=on\
         &subject={subject}"
    );
    let sent = send(&service, &clinician, &Method::POST, "/studies/new", FORM, &form).await;
    let by_form = sent.headers["location"].to_str().unwrap().rsplit('/').next().unwrap().to_owned();
    for study in [made["id"].as_str().unwrap(), &by_form] {
        let address = format!("/api/v1/studies/{study}");
        assert_eq!(send(&service, &clinician, &Method::GET, &address, "", "").await.status, StatusCode::OK);
        assert_eq!(send(&service, &other, &Method::GET, &address, "", "").await.status, StatusCode::NOT_FOUND);
        let access = send(&service, &clinician, &Method::GET, &format!("{address}/access"), "", "").await.json();
        let members = send(&service, &clinician, &Method::GET, &format!("{address}/members"), "", "").await.items();
        assert_eq!((&access["restricted"], members.as_array().unwrap().len()), (&json!(true), 1), "{members}");
    }
    service.stop().await;
}

/// A finished study in which people may answer, and its first three gaits.
async fn answered_by_people(service: &Service) -> (StudyId, Vec<String>) {
    let mixed = |new: &mut gaitwright_service::studies::study_plan::NewStudy| {
        (new.answer_source, new.number_of_trials) = (AnswerSource::Both, 30);
    };
    let study = service.study(mixed).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let gaits = trials.iter().filter(|trial| trial.state == TrialState::Converged).take(3);
    (study, gaits.map(|trial| trial.id.to_string()).collect())
}

#[tokio::test]
async fn person_answers_a_pair_once_under_any_spelling_of_the_name() {
    let (_folder, service) = service().await;
    let script = token(&service, &[Right::Read, Right::Answer]).await;
    let clinician = signed_in(&service, Role::Clinician).await;
    let (study, gaits) = answered_by_people(&service).await;
    let address = format!("/api/v1/studies/{study}/preferences");
    let answer = |author: Option<&str>, source: &str| {
        json!({"trial_a": gaits[0], "trial_b": gaits[1], "answer": "a", "source": source, "author": author}).to_string()
    };
    for (author, status) in [
        ("Bob Lee", StatusCode::CREATED),
        ("bob lee", StatusCode::CONFLICT),
        ("BOB  LEE", StatusCode::CONFLICT),
        ("\u{c9}mile", StatusCode::CREATED),
        ("\u{e9}mile", StatusCode::CONFLICT),
    ] {
        let sent = send(&service, &script, &Method::POST, &address, JSON, &answer(Some(author), "subject")).await;
        assert_eq!(sent.status, status, "{author}: {}", sent.text);
    }
    // A signed-in user cannot answer under another name.
    let other = send(&service, &clinician, &Method::POST, &address, JSON, &answer(Some("Ada"), "clinician")).await;
    assert_eq!(other.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", other.text);
    let own = send(&service, &clinician, &Method::POST, &address, JSON, &answer(None, "clinician")).await;
    assert_eq!(own.status, StatusCode::CREATED, "{}", own.text);
    service.stop().await;
}

#[tokio::test]
async fn trial_of_another_study_looks_unknown() {
    let (_folder, service) = service().await;
    let clinician = signed_in(&service, Role::Clinician).await;
    let (study, gaits) = answered_by_people(&service).await;
    let (_, foreign) = answered_by_people(&service).await;
    let api = format!("/api/v1/studies/{study}");
    let told = async |id: &str| {
        let mut all = Vec::new();
        for (path, body) in [
            ("preferences", json!({"trial_a": gaits[0], "trial_b": id, "answer": "a"})),
            ("assessments", json!({"trial_a": gaits[0], "trial_b": id, "answer": "cannot_tell"})),
            ("lab-sessions", json!({"trial_a": gaits[0], "trial_b": id})),
            ("suggestions", json!({"over": id, "bounds": {"a6": 0.2}})),
        ] {
            let answer =
                send(&service, &clinician, &Method::POST, &format!("{api}/{path}"), JSON, &body.to_string()).await;
            assert!(answer.status.is_client_error(), "{path}: {}", answer.text);
            all.push(without_identifiers(&answer, id));
        }
        all
    };
    assert_eq!(told(&foreign[0]).await, told(UNKNOWN).await);
    service.stop().await;
}
