//! Every form of the pages answers an entry that it refuses with itself, and names the fields: all of them at once, by
//! their labels, never on a bare page of an error.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Method, Request, StatusCode, header};
use gaitwright_service::access::Role;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::callers::{self, FORM, send, signed_in};
use gaitwright_tests::measured::electromyogram;
use gaitwright_tests::page_routes;
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};

/// An entry that no field accepts: control characters belong neither to a number nor to a name or a note.
const NONSENSE: &str = "%07%07";

/// Routes without a field that a person fills in, with the reason.
const WITHOUT_FIELDS: [(&str, &str); 18] = [
    ("/studies/{id}/atlas", "one button"),
    ("/studies/new/check", "answers the script of the form of a new study with the same sentences"),
    ("/studies/sample", "a button"),
    ("/studies/{id}/undo", "a button"),
    ("/trials/{id}/certify", "a button"),
    ("/trials/{id}/explain", "a button"),
    ("/trials/{id}/relaxed-trial", "a button for each relaxation"),
    ("/rate/{id}", "a button"),
    ("/rate/pair/{code}/retract", "a button"),
    ("/lab/{id}/retract", "a button"),
    ("/jobs/{id}/cancel", "a button"),
    ("/units", "a list of two units"),
    ("/system/backup", "a button"),
    ("/sign-in/{link}", "a button"),
    ("/sign-out", "a button"),
    ("/account/sessions", "a button"),
    // Both have a test of their own below, because they need users.
    ("/sign-in", "must not say which of the two entries is wrong"),
    ("/account", "asks for the password of the session"),
];

/// A form, and what it says of a refused entry.
struct Form {
    route: &'static str,
    path: String,
    /// The hidden fields, the chosen entries and the button.
    chosen: String,
    /// The fields that a person fills in.
    fields: &'static [&'static str],
    /// The labels that the page names if all of these are empty. None if the form accepts that.
    empty: &'static [&'static str],
    /// The labels that it names if all of them are nonsense.
    nonsense: &'static [&'static str],
}

/// The notice with the reasons.
fn notice(answer: &Answer) -> String {
    // The answering pages have a notice of their own.
    let mut starts = ["id=\"refused\"", "role=\"alert\""].into_iter();
    let notice = starts.find_map(|start| answer.text.split(start).nth(1)).unwrap_or_default();
    notice.split("</div>").next().unwrap().split("<form").next().unwrap().to_owned()
}

/// Fault of the response to a refused entry, if any.
fn fault(form: &Form, answer: &Answer, labels: &[&str]) -> Option<String> {
    if ![StatusCode::UNPROCESSABLE_ENTITY, StatusCode::CONFLICT].contains(&answer.status) {
        let heading = answer.text.split("<main").nth(1).unwrap_or(&answer.text);
        return Some(format!("{} {heading:.600}", answer.status));
    }
    if !answer.text.contains(&format!("action=\"{}\"", form.path)) {
        let heading = answer.text.split("<main").nth(1).unwrap_or(&answer.text);
        return Some(format!("the form is not shown: {heading:.600}"));
    }
    let notice = notice(answer);
    let label = labels.iter().find(|label| !notice.contains(**label))?;
    Some(format!("{label} is not named in {notice}"))
}

/// The address of a route without a form of its own here.
fn with_names(route: &str, names: &[(&str, String)]) -> String {
    let Some((start, name)) = names.iter().find(|(start, _)| route.starts_with(start)) else {
        assert!(!route.contains('{'), "{route}: say which object its address names");
        return route.to_owned();
    };
    route.replacen(start, &start.replace("{id}", name).replace("{code}", name).replace("{link}", name), 1)
}

/// Sends a form without a single entry, from the page `/page`.
async fn send_from_page(service: &Service, path: &str) -> Answer {
    let request = Request::post(path).header(header::CONTENT_TYPE, FORM).header(header::HOST, "localhost");
    let request = request.header(header::REFERER, "http://localhost/page?of=1").body(Body::empty()).unwrap();
    service.send(request).await
}

/// Why a response is not a complete page of the site; `None` if it is one, or is a redirect or JSON.
fn bare(answer: &Answer) -> Option<String> {
    if answer.status == StatusCode::SEE_OTHER || answer.content_type().starts_with("application/json") {
        return None;
    }
    let text = &answer.text;
    // Pages of raters and for signing in have no navigation.
    let parts = ["<!doctype html>", "href=\"/static/gaitwright.css\"", "<main", "<h1", "</html>"];
    let has_layout = parts.iter().all(|part| text.contains(part));
    // Every other status shows the page of the form itself.
    let leads_back = answer.status != StatusCode::BAD_REQUEST || text.contains("href=\"/page?of=1\"");
    let names_fields = text.contains("form field") || text.contains("missing field");
    let is_page = answer.content_type().starts_with("text/html") && has_layout;
    (!is_page || names_fields || !leads_back).then(|| format!("{} {text:.3000}", answer.status))
}

fn id(value: &Value) -> &str {
    value["id"].as_str().unwrap()
}

#[tokio::test]
async fn every_form_answers_refused_entries_with_itself_and_names_every_field() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (6, AnswerSource::Both)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let mut trials = service.trials(study).await;
    trials.retain(|trial| trial.state == TrialState::Converged);
    let (one, two, three) = (trials[0].id, trials[1].id, trials[2].id);
    let api = format!("/api/v1/studies/{study}");
    let made = async |path: &str, body: &Value| {
        let answer = service.post(path, body).await;
        assert!(answer.status.is_success(), "{path}: {}", answer.text);
        answer.json()
    };
    let subject = service.subject().await;
    let device = service.fetch("/api/v1/devices").await.items()[0].clone();
    let preference = made(&format!("{api}/preferences"), &json!({"trial_a": one, "trial_b": two, "answer": "a"})).await;
    let plan = json!({"trial_a": one, "trial_b": two});
    let session = made(&format!("{api}/lab-sessions"), &plan).await;
    let session = format!("/lab-sessions/{}", id(&session));
    let tablet = session.replace("/lab-sessions/", "/lab/");
    let walked = made(&format!("{api}/lab-sessions"), &plan).await;
    let walked = format!("/lab-sessions/{}", id(&walked));
    for walk in 1..=3 {
        made(&format!("/api/v1{walked}/walks"), &json!({"walk": walk})).await;
    }
    let emg = json!({"walk": 1, "recording": electromyogram(1.0), "reading": {"heel_strike_column": "heel"}});
    made(&format!("/api/v1{walked}/measurement-files/emg"), &emg).await;
    let human = service.study(|new| (new.number_of_trials, new.answer_source) = (4, AnswerSource::People)).await;
    service.wait_for(human, &[StudyState::Waiting]).await;
    let pair = made(&format!("/api/v1/studies/{human}/blind-pairs/next"), &json!({})).await["pair"].clone();
    let pair = format!("/rate/pair/{}", pair["code"].as_str().unwrap());
    let report = json!({"note": "stumbled"});
    let report = made(&format!("/api/v1/trials/{three}/safety-reports"), &report).await;
    let of_study = |end: &str| format!("/studies/{study}{end}");
    let of_subject = |end: &str| format!("/subjects/{subject}{end}");
    let gait = |end: &str| format!("/trials/{one}{end}");
    let key = trials[0].id;
    let names = [
        ("/studies/{id}", study.to_string()),
        ("/trials/{id}", one.to_string()),
        ("/rate/{id}", human.to_string()),
        ("/rate/pair/{code}", pair.rsplit('/').next().unwrap().to_owned()),
        ("/lab/{id}", tablet.rsplit('/').next().unwrap().to_owned()),
        ("/jobs/{id}", one.to_string()),
        ("/sign-in/{link}", "nothing".to_owned()),
    ];

    let forms = [
        Form {
            route: "/studies/new",
            path: "/studies/new".to_owned(),
            chosen:
                "subject=new&muscles=off&answer_source=people&parallel_trials=1&tuned_a5=on&device=&reference_gait="
                    .to_owned(),
            fields: &["pseudonym", "height_m", "body_mass_kg", "number_of_trials", "name", "seed"],
            empty: &["Pseudonym", "Height, m", "Body mass, kg", "Number of trials"],
            nonsense: &["Pseudonym", "Height, m", "Body mass, kg", "Number of trials", "Name", "Seed"],
        },
        Form {
            route: "/studies/{id}/details",
            path: of_study("/details"),
            chosen: "button=save".to_owned(),
            fields: &["name", "tags", "notes"],
            empty: &["Name"],
            nonsense: &["Name", "Tags", "Notes"],
        },
        Form {
            route: "/studies/{id}/do",
            path: of_study("/do"),
            chosen: "transition=extend".to_owned(),
            fields: &["number_of_trials"],
            empty: &["Number of trials"],
            nonsense: &["Number of trials"],
        },
        Form {
            route: "/studies/{id}/compare",
            path: of_study("/compare"),
            chosen: format!("a={one}&b={three}&answer=a&source=clinician&key={key}"),
            fields: &["author", "note"],
            empty: &["Name or code"],
            nonsense: &["Name or code"],
        },
        Form {
            route: "/studies/{id}/retract",
            path: of_study("/retract"),
            chosen: format!("saved={}", id(&preference)),
            fields: &["author", "reason"],
            empty: &["Your name or code"],
            nonsense: &["Your name or code"],
        },
        Form {
            route: "/studies/{id}/members",
            path: of_study("/members"),
            chosen: "button=invite".to_owned(),
            fields: &["name"],
            empty: &["Name or code of the rater"],
            nonsense: &["Name or code of the rater"],
        },
        Form {
            route: "/subjects",
            path: "/subjects".to_owned(),
            chosen: "units=si".to_owned(),
            fields: &["pseudonym", "height_m", "body_mass_kg", "notes"],
            empty: &["Pseudonym", "Height, m", "Body mass, kg"],
            nonsense: &["Pseudonym", "Height, m", "Body mass, kg", "Notes"],
        },
        Form {
            route: "/subjects/{id}/consent",
            path: of_subject("/consent"),
            chosen: "after=0".to_owned(),
            fields: &["form"],
            empty: &["Signed consent form"],
            nonsense: &["Signed consent form"],
        },
        Form {
            route: "/subjects/{id}/withdraw",
            path: of_subject("/withdraw"),
            chosen: "confirmed=yes".to_owned(),
            fields: &["reason"],
            empty: &["Reason, or"],
            nonsense: &["Reason, or"],
        },
        Form {
            route: "/subjects/{id}/correct",
            path: of_subject("/correct"),
            chosen: "units=si&before=0".to_owned(),
            fields: &["height_m", "body_mass_kg", "reason"],
            empty: &["Height, m", "Body mass, kg", "Reason"],
            nonsense: &["Height, m", "Body mass, kg", "Reason"],
        },
        Form {
            route: "/subjects/{id}/muscles",
            path: of_subject("/muscles"),
            chosen: String::new(),
            fields: &["sol_max_force_n", "ta_max_force_n"],
            empty: &[],
            nonsense: &["soleus", "tibialis anterior"],
        },
        Form {
            route: "/devices/{id}",
            path: format!("/devices/{}", id(&device)),
            chosen: String::new(),
            fields: &["name"],
            empty: &["Name"],
            nonsense: &["Name"],
        },
        Form {
            route: "/trials/{id}/execution-report",
            path: gait("/execution-report"),
            chosen: String::new(),
            fields: &["number_of_simulated_walks", "seed"],
            empty: &["Number of simulated walks on each kind of ground", "Seed"],
            nonsense: &["Number of simulated walks on each kind of ground", "Seed"],
        },
        Form {
            route: "/trials/{id}/safety-report",
            path: gait("/safety-report"),
            chosen: String::new(),
            fields: &["author", "note"],
            empty: &["Your name or code"],
            nonsense: &["Your name or code", "What happened"],
        },
        Form {
            route: "/trials/{id}/safety-review",
            path: format!("/trials/{three}/safety-review"),
            chosen: format!("reports={}", id(&report)),
            fields: &["decision", "author", "reason"],
            empty: &["Decision", "Your name or code", "Reason"],
            nonsense: &["Decision", "Your name or code", "Reason"],
        },
        Form {
            route: "/reference-gaits",
            path: "/reference-gaits".to_owned(),
            chosen: "format=csv&strikes=kinematics&units=si".to_owned(),
            fields: &["name", "height_m", "body_mass_kg", "recording", "heel_strikes_s"],
            empty: &["Name", "File contents"],
            nonsense: &["Name", "Height of the measured person, m", "Body mass, kg", "File contents"],
        },
        Form {
            route: "/studies/{id}/lab",
            path: of_study("/lab"),
            chosen: String::new(),
            fields: &["trial_a", "trial_b", "notes"],
            empty: &["Gait A"],
            nonsense: &["Gait A"],
        },
        Form {
            route: "/lab-sessions/{id}/close",
            path: format!("{session}/close"),
            chosen: String::new(),
            fields: &["note"],
            empty: &[],
            nonsense: &["Note"],
        },
        Form {
            route: "/lab-sessions/{id}/unblind",
            path: format!("{session}/unblind"),
            chosen: String::new(),
            fields: &["note"],
            empty: &["Reason"],
            nonsense: &["Reason"],
        },
        Form {
            route: "/lab-sessions/{id}/measurement-files/emg",
            path: format!("{walked}/measurement-files/emg"),
            chosen: "walk=1&format=csv".to_owned(),
            fields: &["rate_hz", "recording", "heel_strikes_s", "rejected_strides"],
            empty: &["File contents"],
            nonsense: &["Sampling rate, Hz", "Right heel strikes, s", "Rejected strides"],
        },
        Form {
            route: "/lab-sessions/{id}/measurement-files/joint-angles",
            path: format!("{walked}/measurement-files/joint-angles"),
            chosen: "walk=1&format=csv".to_owned(),
            fields: &["cutoff_hz", "recording"],
            empty: &["File contents"],
            nonsense: &["Low-pass cut-off, Hz", "File contents"],
        },
        Form {
            route: "/lab-sessions/{id}/process",
            path: format!("{walked}/process"),
            chosen: String::new(),
            fields: &["band_low_hz", "band_high_hz", "envelope_hz", "order"],
            empty: &["Band-pass from, Hz", "Band-pass to, Hz", "Low-pass cut-off, Hz", "Filter order"],
            nonsense: &["Band-pass from, Hz", "Band-pass to, Hz", "Low-pass cut-off, Hz", "Filter order"],
        },
        Form {
            route: "/lab/{id}",
            path: tablet.clone(),
            chosen: "walk=1&complete=yes".to_owned(),
            fields: &["note"],
            empty: &[],
            nonsense: &["Note"],
        },
        Form {
            route: "/lab/{id}/answer",
            path: format!("{}/answer", walked.replace("/lab-sessions/", "/lab/")),
            chosen: "number=1&answer=first".to_owned(),
            fields: &["note"],
            empty: &[],
            nonsense: &["What the subject noticed"],
        },
        Form {
            route: "/rate/pair/{code}",
            path: pair,
            chosen: "answer=first".to_owned(),
            fields: &["note"],
            empty: &[],
            nonsense: &["Note"],
        },
        Form {
            route: "/users",
            path: "/users".to_owned(),
            chosen: "button=make_token".to_owned(),
            fields: &["name", "days"],
            empty: &["Purpose", "Scopes"],
            nonsense: &["Purpose", "Expires after, days", "Scopes"],
        },
        Form {
            route: "/users",
            path: "/users".to_owned(),
            chosen: "button=add_user".to_owned(),
            fields: &["name", "role"],
            empty: &["Name or code", "Role"],
            nonsense: &["Name or code", "Role"],
        },
    ];

    // The nonsense first: an accepted empty entry changes what the page shows.
    let mut faults = Vec::new();
    for (entry, what) in [(Some(NONSENSE), "nonsense"), (Some(""), "empty"), (None, "missing")] {
        for form in &forms {
            let labels = if what == "nonsense" { form.nonsense } else { form.empty };
            // Without the field for an author, a safety report is in the name of the user.
            let is_complete = what == "missing" && form.route == "/trials/{id}/safety-report";
            if labels.is_empty() || is_complete {
                continue;
            }
            let typed = |field: &&str| entry.map(|entry| format!("{field}={entry}"));
            let typed: Vec<String> = form.fields.iter().filter_map(typed).collect();
            let body = format!("{}&{}", form.chosen, typed.join("&"));
            let answer = service.post_text(&form.path, FORM, body.trim_start_matches('&')).await;
            faults.extend(fault(form, &answer, labels).map(|fault| format!("{}, {what}: {fault}", form.route)));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n\n"));
    let known = |route: &str| {
        forms.iter().any(|form| form.route == route) || WITHOUT_FIELDS.iter().any(|(without, _)| *without == route)
    };
    let posts: Vec<String> =
        page_routes::all().into_iter().filter(|(method, _)| *method == Method::POST).map(|(_, path)| path).collect();
    assert!(posts.len() > 35, "{posts:?}");
    for route in &posts {
        assert!(known(route), "{route}: add its form here, or to WITHOUT_FIELDS with the reason");
    }
    for (without, _) in WITHOUT_FIELDS {
        assert!(posts.iter().any(|route| route == without), "{without} is no form");
    }
    for route in &posts {
        let form = forms.iter().find(|form| form.route == route);
        let path = form.map_or_else(|| with_names(route, &names), |form| form.path.clone());
        let answer = send_from_page(&service, &path).await;
        faults.extend(bare(&answer).map(|fault| format!("{route} without a body: {fault}")));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n\n"));
    service.stop().await;
}

#[tokio::test]
async fn form_without_an_entry_of_its_page_leads_back_to_that_page_and_nowhere_else() {
    let (_folder, service) = callers::service().await;
    let person = signed_in(&service, Role::Clinician).await;
    let subject = service.subject().await;
    let sent = async |referer: &str| {
        let request = Request::post(format!("/subjects/{subject}/consent")).header(header::CONTENT_TYPE, FORM);
        let request = request.header(header::HOST, "localhost").header(header::REFERER, referer);
        service.send(callers::of(&person, request).body(Body::from("form=signed")).unwrap()).await
    };
    let answer = sent(&format!("http://localhost/subjects/{subject}")).await;
    assert_eq!(answer.status, StatusCode::BAD_REQUEST, "{}", answer.text);
    assert!(answer.text.contains("The form was not sent completely, and nothing was changed."), "{}", answer.text);
    assert!(answer.text.contains(&format!("<a href=\"/subjects/{subject}\">Back to the form</a>")), "{}", answer.text);
    for foreign in ["http://elsewhere.example/subjects", "http://localhost//elsewhere.example", "nonsense"] {
        let answer = sent(foreign).await;
        assert!(!answer.text.contains("Back to the form") && !answer.text.contains("elsewhere"), "{}", answer.text);
    }
    service.stop().await;
}

#[tokio::test]
async fn account_form_names_both_fields_and_sign_in_neither() {
    let (_folder, service) = callers::service().await;
    let person = signed_in(&service, Role::Clinician).await;
    let set = send(&service, &person, &Method::POST, "/account", FORM, "password=correct+horse+battery").await;
    assert_eq!(set.status, StatusCode::OK, "{}", set.text);
    let person = callers::As::Session(callers::cookie_of(&set, "gaitwright_session"));
    let refused = send(&service, &person, &Method::POST, "/account", FORM, "present=wrong&password=short").await;
    assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", refused.text);
    let said = notice(&refused);
    assert!(said.contains("The current password is wrong.") && said.contains("New password"), "{said}");
    let wrong = send(&service, &callers::As::Nobody, &Method::POST, "/sign-in", FORM, "name=a+clinician&password=no");
    let wrong = wrong.await;
    assert_eq!(wrong.status, StatusCode::UNAUTHORIZED);
    let said = notice(&wrong);
    assert!(said.contains("Wrong name or password.") && !said.contains("\u{201c}"), "{said}");
    assert!(!wrong.text.contains("aria-invalid") && wrong.text.contains("action=\"/sign-in\""), "{}", wrong.text);
    service.stop().await;
}
