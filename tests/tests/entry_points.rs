//! Every entry point through which a gait reaches a person or a device applies the same rules.
//!
//! The entry points are taken from the description of the REST interface, the page router and the commands. An entry
//! point that is not classified here fails the test. Every classified one is then called under every condition in which
//! it must refuse.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright_http::openapi;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::feedback::Source;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::{NewTrial, TrialState};
use gaitwright_store::{StudyId, TrialId, blind_pairs, commit, lab_sessions};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::page_routes;
use gaitwright_tests::service::{Answer, Service};
use gaitwright_tests::sources;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use tempfile::TempDir;

const FORM: &str = "application/x-www-form-urlencoded";

/// Use of a gait by an entry point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum EntryPoint {
    /// A preference between two gaits that somebody chose.
    Preference,
    /// A note that two gaits cannot be told apart: it skips the pair.
    Note,
    /// Bounds that would have been better than a trial: a preference for the gait of these bounds.
    Suggestion,
    /// A rater's answer to a pair that the service drew.
    RaterAnswer,
    /// Showing a rater a pair.
    RaterPair,
    /// The plan of a lab session.
    Plan,
    /// The record of a walk.
    Walk,
    /// The answer of a subject about two walks.
    WalkAnswer,
    /// A controller file of a trial.
    ControllerFile,
    /// A controller file of a walk.
    WalkFile,
    /// Bounds to take.
    Recommendation,
    /// None of these, with the reason.
    None(&'static str),
}

/// A condition in which an entry point must refuse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Rule {
    /// One of the two gaits was reported as unsafe.
    Safety,
    /// One of the two gaits has no certificate.
    Certificate,
    /// The subject withdrew.
    Withdrawal,
    /// The same person has already answered.
    Duplicate,
    /// Both trials gave the same gait, or are the same trial.
    EqualGaits,
    /// One of the two trials has no converged gait.
    NotConverged,
}

const RULES: [Rule; 6] =
    [Rule::Safety, Rule::Certificate, Rule::Withdrawal, Rule::Duplicate, Rule::EqualGaits, Rule::NotConverged];

const READS: EntryPoint = EntryPoint::None("shows or exports recorded data; no walk or answer follows from it");
const RETRACTS: EntryPoint = EntryPoint::None("retracts an answer");
const UNDOES: EntryPoint = EntryPoint::None("undoes an answer; `undo.rs` holds its rules");
const RUNS: EntryPoint = EntryPoint::None("runs solves, certifications or simulations; no person answers");
const SETS_UP: EntryPoint = EntryPoint::None("sets up subjects, devices, references, users or the service");

/// Use of a gait by an operation; `None` if neither this function nor a file classifies it.
fn entry_point_of(operation: &str) -> Option<EntryPoint> {
    Some(match operation {
        "post /api/v1/studies/{id}/preferences" | "post /studies/{id}/compare" => EntryPoint::Preference,
        "post /api/v1/studies/{id}/assessments" => EntryPoint::Note,
        "post /api/v1/blind-pairs/{code}/answer" | "post /rate/pair/{code}" => EntryPoint::RaterAnswer,
        "post /api/v1/studies/{id}/blind-pairs/next" | "post /rate/{id}" => EntryPoint::RaterPair,
        "post /api/v1/studies/{id}/lab-sessions" | "post /studies/{id}/lab" => EntryPoint::Plan,
        "post /api/v1/lab-sessions/{id}/walks" | "post /lab/{id}" => EntryPoint::Walk,
        "post /api/v1/lab-sessions/{id}/answers" | "post /lab/{id}/answer" => EntryPoint::WalkAnswer,
        "get /api/v1/trials/{id}/controller.json" => EntryPoint::ControllerFile,
        "get /api/v1/lab-sessions/{id}/controller.json" => EntryPoint::WalkFile,
        "get /api/v1/studies/{id}/recommendation" | "get /api/v1/studies/{id}/recommendation.csv" => {
            EntryPoint::Recommendation
        }
        "post /api/v1/studies/{id}/suggestions" => EntryPoint::Suggestion,
        "post /api/v1/trials/{id}/safety-reports" | "post /trials/{id}/safety-report" => {
            EntryPoint::None("closes a gait; `safety_review.rs` holds its rules")
        }
        "post /api/v1/trials/{id}/safety-reviews" | "post /trials/{id}/safety-review" => {
            EntryPoint::None("decides about a report; `safety_review.rs` holds its rules")
        }
        "post /api/v1/preferences/{id}/retract"
        | "post /api/v1/suggestions/{id}/retract"
        | "post /api/v1/assessments/{id}/retract"
        | "post /studies/{id}/retract"
        | "post /api/v1/lab-sessions/{id}/retract-answer"
        | "post /lab/{id}/retract"
        | "post /rate/pair/{code}/retract" => RETRACTS,
        "post /api/v1/preferences/{id}/undo" | "post /api/v1/assessments/{id}/undo" | "post /studies/{id}/undo" => {
            UNDOES
        }
        "post /api/v1/studies/{id}/ask" | "post /api/v1/trials/{id}/tell" => {
            EntryPoint::None("the lab evaluates a trial by itself; values, and no person's answer")
        }
        _ if operation.starts_with("get ") => return reads(operation),
        _ if [
            "/certif",
            "/explain",
            "/explanation",
            "/execution-report",
            "/relaxed-trial",
            "/cancel",
            "/retry",
            "/emg-results",
            "/process",
            "/measurement-files",
        ]
        .iter()
        .any(|part| operation.contains(part)) =>
        {
            RUNS
        }
        _ => return set_up(operation),
    })
}

/// GET operations that return nothing to walk with.
const READ: &str = include_str!("entry_points/reads.txt");

fn reads(operation: &str) -> Option<EntryPoint> {
    READ.lines().any(|line| line == operation).then_some(READS)
}

/// Operations that set something up, each by name.
fn set_up(operation: &str) -> Option<EntryPoint> {
    const KNOWN: &str = include_str!("entry_points/set_up.txt");
    KNOWN.lines().any(|line| line == operation).then_some(SETS_UP)
}

/// Every operation of the REST interface and every page.
fn operations() -> Vec<String> {
    let mut all = Vec::new();
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    for (path, item) in document["paths"].as_object().unwrap() {
        all.extend(item.as_object().unwrap().keys().map(|method| format!("{method} {path}")));
    }
    let pages = page_routes::all().into_iter();
    all.extend(pages.map(|(method, path)| format!("{} {path}", method.as_str().to_lowercase())));
    all
}

/// A service with a study that waits for an answer about its first two gaits, one of which is newer.
struct Scene {
    _folder: TempDir,
    service: Service,
    study: StudyId,
    /// Two different converged gaits; nobody has compared them.
    pair: (TrialId, TrialId),
    /// A trial without a gait.
    without_gait: TrialId,
    /// A converged trial with the very gait of the first of the pair.
    equal: TrialId,
}

impl Scene {
    async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
        let study = service.study(|new| (new.number_of_trials, new.answer_source) = (24, AnswerSource::Both)).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        let trials = service.trials(study).await;
        let converged: Vec<_> = trials.iter().filter(|trial| trial.state == TrialState::Converged).collect();
        let without_gait = trials.iter().find(|trial| trial.state == TrialState::NotConverged).unwrap().id;
        let (first, second) = (converged[0], converged[1]);
        // Exactly equal results, as with two values of a bound that the gait does not reach.
        let equal = converged[2].id;
        let scene = Self { _folder: folder, service, study, pair: (first.id, second.id), without_gait, equal };
        let report = serde_json::to_string(first.report.as_ref().unwrap()).unwrap();
        scene.by_hand("drop trigger trials_result_fixed").await;
        scene.by_hand(&format!("update trials set report = '{report}' where id = '{equal}'")).await;
        scene
    }

    async fn by_hand(&self, sql: &str) {
        let mut writer = self.service.store.write().await.unwrap();
        sqlx::query(sqlx::AssertSqlSafe(sql.to_owned())).execute(&mut **writer).await.unwrap();
        gaitwright_store::commit(writer).await.unwrap();
    }

    /// The number of rows of each table that an entry point may write.
    async fn rows(&self) -> BTreeMap<&'static str, i64> {
        let mut reader = self.service.store.read().await.unwrap();
        let mut counts = BTreeMap::new();
        for table in [
            "feedback",
            "assessments",
            "blind_pairs",
            "blind_pair_answers",
            "lab_sessions",
            "lab_session_steps",
            "lab_answers",
        ] {
            let sql = sqlx::AssertSqlSafe(format!("select count(*) from {table}"));
            counts.insert(table, sqlx::query_scalar(sql).fetch_one(&mut **reader).await.unwrap());
        }
        counts
    }

    async fn post(&self, path: &str, body: &Value) -> Answer {
        let answer = self.service.post(path, body).await;
        assert!(answer.status.is_success(), "{path}: {}", answer.text);
        answer
    }

    /// Makes a condition true for `pair`, and returns the pair to call the entry point with.
    async fn violate(&self, rule: Rule) -> (TrialId, TrialId) {
        let (first, second) = self.pair;
        match rule {
            Rule::Safety => {
                let report = json!({"trial_a": first, "trial_b": self.equal, "answer": "unsafe_a", "author": "S"});
                self.post(&format!("/api/v1/studies/{}/assessments", self.study), &report).await;
                (first, second)
            }
            Rule::Certificate => {
                self.service.stop_passing_gaits().await;
                self.by_hand("drop trigger certificates_no_delete").await;
                self.by_hand(&format!("delete from certificates where trial_id = '{first}'")).await;
                (first, second)
            }
            Rule::Withdrawal => {
                let subject = self.service.subject().await;
                self.post(&format!("/api/v1/subjects/{subject}/consents"), &json!({"form": "1"})).await;
                self.post(&format!("/api/v1/subjects/{subject}/withdraw"), &json!({"reason": "asked to"})).await;
                (first, second)
            }
            Rule::Duplicate => {
                let given = json!({"trial_a": second, "trial_b": first, "answer": "a", "author": "K"});
                self.post(&format!("/api/v1/studies/{}/preferences", self.study), &given).await;
                (first, second)
            }
            Rule::EqualGaits => (first, self.equal),
            Rule::NotConverged => (first, self.without_gait),
        }
    }

    /// A session with the pair, after this number of walks.
    async fn session(&self, walks: u8) -> String {
        let body = json!({"trial_a": self.pair.0, "trial_b": self.pair.1});
        let planned = self.post(&format!("/api/v1/studies/{}/lab-sessions", self.study), &body).await.json();
        let id = planned["id"].as_str().unwrap().to_owned();
        for walk in 1..=walks {
            self.post(&format!("/api/v1/lab-sessions/{id}/walks"), &json!({"walk": walk})).await;
        }
        id
    }
}

/// Calls an entry point for a pair; `session`: a lab session of the pair.
async fn call(scene: &Scene, operation: &str, pair: (TrialId, TrialId), session: &str) -> Answer {
    let (a, b) = pair;
    let (service, study) = (&scene.service, scene.study);
    let key = "01890000-0000-7000-8000-000000000009";
    match operation {
        "post /api/v1/studies/{id}/preferences" => {
            let body = json!({"trial_a": a, "trial_b": b, "answer": "a", "author": "K"});
            service.post(&format!("/api/v1/studies/{study}/preferences"), &body).await
        }
        "post /studies/{id}/compare" => {
            let body = format!("a={a}&b={b}&answer=a&source=clinician&author=K&note=&key={key}");
            service.post_text(&format!("/studies/{study}/compare"), FORM, &body).await
        }
        "post /api/v1/studies/{id}/assessments" => {
            let body = json!({"trial_a": a, "trial_b": b, "answer": "cannot_tell", "author": "K"});
            service.post(&format!("/api/v1/studies/{study}/assessments"), &body).await
        }
        "post /api/v1/studies/{id}/suggestions" => {
            let trials = service.trials(study).await;
            let bounds = trials.iter().find(|trial| trial.id == b).unwrap().action;
            let body = json!({"over": a, "bounds": bounds, "author": "K"});
            service.post(&format!("/api/v1/studies/{study}/suggestions"), &body).await
        }
        "post /api/v1/studies/{id}/lab-sessions" => {
            service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &json!({"trial_a": a, "trial_b": b})).await
        }
        "post /studies/{id}/lab" => {
            service.post_text(&format!("/studies/{study}/lab"), FORM, &format!("trial_a={a}&trial_b={b}&notes=")).await
        }
        "post /api/v1/lab-sessions/{id}/walks" => {
            service.post(&format!("/api/v1/lab-sessions/{session}/walks"), &json!({"walk": 2})).await
        }
        "post /lab/{id}" => service.post_text(&format!("/lab/{session}"), FORM, "walk=2&note=&complete=yes").await,
        "get /api/v1/trials/{id}/controller.json" => {
            service.fetch(&format!("/api/v1/trials/{a}/controller.json")).await
        }
        "get /api/v1/lab-sessions/{id}/controller.json" => {
            service.fetch(&format!("/api/v1/lab-sessions/{session}/controller.json?walk=2")).await
        }
        other => panic!("this test has no request for {other}"),
    }
}

/// Whether a rule applies to an entry point; the reason if it cannot be broken there.
fn expected(entry_point: EntryPoint, rule: Rule) -> Result<(), &'static str> {
    match (entry_point, rule) {
        (EntryPoint::Plan | EntryPoint::Walk | EntryPoint::ControllerFile | EntryPoint::WalkFile, Rule::Duplicate) => {
            Err("the same gaits may be walked with again")
        }
        (EntryPoint::Walk | EntryPoint::WalkFile, Rule::EqualGaits | Rule::NotConverged) => {
            Err("a session with such a pair cannot be planned")
        }
        (EntryPoint::ControllerFile, Rule::EqualGaits) => Err("a file is of one gait"),
        _ => Ok(()),
    }
}

#[test]
fn every_route_is_classified() {
    let unknown: Vec<String> =
        operations().into_iter().filter(|operation| entry_point_of(operation).is_none()).collect();
    assert!(unknown.is_empty(), "classify these in tests/tests/entry_points.rs:\n{}", unknown.join("\n"));
}

#[test]
fn unknown_get_route_fails_until_it_is_classified() {
    for new in ["get /api/v1/trials/{id}/controller.bin", "get /lab/{id}/walk.json", "get /api/v1/studies/{id}/best"] {
        assert_eq!(entry_point_of(new), None, "{new}");
    }
    let known = operations();
    for line in READ.lines() {
        assert!(known.iter().any(|operation| operation == line), "{line} is not an operation");
        assert!(
            !line.contains("controller") && !line.contains("recommendation"),
            "{line} hands out a gait to walk with"
        );
    }
}

/// Relation of each command to people and devices.
const COMMANDS: [(&str, &str); 25] = [
    ("convert", "makes tables and pictures of a gait file, and nothing for a device"),
    ("import", "writes the rows of an archive after checking them: `archives.rs` holds its rules"),
    ("signing-key", "makes a key to sign archives"),
    ("audit", "reads the record"),
    ("backup", "copies the record"),
    ("body", "prints the values of a body"),
    ("certify", "certifies a gait file"),
    ("config", "shows settings"),
    ("doctor", "checks machine, settings and record, and changes nothing"),
    ("emg", "processes a recording"),
    ("export", "writes an archive"),
    ("help", "explains commands"),
    ("openapi", "prints the description"),
    ("prune", "drops old trajectories"),
    ("reference", "makes a reference of a recording"),
    ("reproduce", "runs automatic studies"),
    ("restore", "puts a copy in place of a record"),
    ("serve", "serves the entry points that the other tests call"),
    ("simulate", "simulates walks with a gait file"),
    ("solve", "solves for a gait file"),
    ("sweep", "solves for gait files"),
    ("atlas", "solves for a table"),
    ("tune", "runs an automatic study"),
    ("users", "makes sign-in links"),
    ("worker", "solves jobs"),
];

#[test]
fn every_command_is_classified() {
    let help = std::process::Command::new(env!("CARGO_BIN_EXE_gaitwright-cli")).arg("--help").output().unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    let listed = help.split("Commands:").nth(1).unwrap().split("Options:").next().unwrap();
    // A longer description continues on a line that is indented further.
    let first_lines = listed.lines().filter_map(|line| line.strip_prefix("  ")).filter(|line| !line.starts_with(' '));
    let commands: Vec<&str> = first_lines.filter_map(|line| line.split_whitespace().next()).collect();
    assert!(commands.len() > 15, "{help}");
    for command in commands {
        assert!(COMMANDS.iter().any(|(known, _)| *known == command), "classify the command {command:?} in this file");
    }
}

#[tokio::test]
async fn every_entry_point_applies_every_rule() {
    let entry_points: Vec<(String, EntryPoint)> = operations()
        .into_iter()
        .filter_map(|operation| entry_point_of(&operation).map(|entry_point| (operation, entry_point)))
        .filter(|(_, entry_point)| {
            matches!(
                entry_point,
                EntryPoint::Preference
                    | EntryPoint::Note
                    | EntryPoint::Suggestion
                    | EntryPoint::Plan
                    | EntryPoint::Walk
                    | EntryPoint::ControllerFile
                    | EntryPoint::WalkFile
            )
        })
        .collect();
    assert!(entry_points.len() >= 10, "{entry_points:?}");
    let mut matrix = Vec::new();
    for (operation, entry_point) in &entry_points {
        // If no rule is broken, the call succeeds: otherwise a refusal could have another reason.
        let scene = Scene::new().await;
        let session = scene.session(1).await;
        let accepted = call(&scene, operation, scene.pair, &session).await;
        // The export finds, after the rules have passed, that the analytic solver's gaits do not fit the walker.
        let is_accepted =
            accepted.status.is_success() || accepted.status.is_redirection() || accepted.text.contains("contact_rows");
        assert!(is_accepted, "{operation}: {} {}", accepted.status, accepted.text);
        scene.service.stop().await;
        for rule in RULES {
            if let Err(why) = expected(*entry_point, rule) {
                matrix.push(format!("{operation:50} {rule:?}: does not apply ({why})"));
                continue;
            }
            let scene = Scene::new().await;
            let session = scene.session(1).await;
            let mut pair = scene.violate(rule).await;
            if (*entry_point, rule) == (EntryPoint::ControllerFile, Rule::NotConverged) {
                pair = (pair.1, pair.0);
            }
            let before = scene.rows().await;
            let refused = call(&scene, operation, pair, &session).await;
            assert!(
                matches!(refused.status, StatusCode::CONFLICT | StatusCode::UNPROCESSABLE_ENTITY),
                "{operation} with {rule:?}: {} {}",
                refused.status,
                refused.text
            );
            assert!(!refused.text.contains("contact_rows"), "{operation} with {rule:?}: {}", refused.text);
            assert_eq!(scene.rows().await, before, "{operation} with {rule:?} changes nothing");
            matrix.push(format!("{operation:50} {rule:?}: refused"));
            scene.service.stop().await;
        }
    }
    assert!(matrix.iter().filter(|row| row.ends_with("refused")).count() >= 40, "{}", matrix.join("\n"));
}

/// A rater's pair and answer under a rule that is broken after the pair was drawn.
#[tokio::test]
async fn pair_cannot_be_answered_after_a_rule_excludes_it() {
    for (rule, statuses) in [
        (Rule::Safety, [StatusCode::CONFLICT, StatusCode::OK]),
        (Rule::Certificate, [StatusCode::CONFLICT, StatusCode::OK]),
        (Rule::Withdrawal, [StatusCode::CONFLICT, StatusCode::CONFLICT]),
    ] {
        let scene = Rated::new().await;
        let code = scene.code().await;
        scene.close(rule).await;
        let before = scene.service.feedback(scene.study).await.len();
        let answer = format!("/api/v1/blind-pairs/{code}/answer");
        let refused = scene.service.post(&answer, &json!({"answer": "first"})).await;
        assert_eq!(refused.status, statuses[0], "{rule:?}: {}", refused.text);
        assert_eq!(scene.service.feedback(scene.study).await.len(), before, "{rule:?}");
        let next = scene.service.post(&format!("/api/v1/studies/{}/blind-pairs/next", scene.study), &json!({})).await;
        assert_eq!(next.status, statuses[1], "{rule:?}: {}", next.text);
        assert!(next.status != StatusCode::OK || next.json()["pair"]["code"] != json!(code), "{rule:?}: {}", next.text);
        scene.service.stop().await;
    }
}

/// A study of people with a pair to rate.
struct Rated {
    _folder: TempDir,
    service: Service,
    study: StudyId,
}

impl Rated {
    async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
        let study = service.study(|new| (new.number_of_trials, new.answer_source) = (6, AnswerSource::People)).await;
        service.wait_for(study, &[StudyState::Waiting]).await;
        Self { _folder: folder, service, study }
    }

    async fn code(&self) -> String {
        let next =
            self.service.post(&format!("/api/v1/studies/{}/blind-pairs/next", self.study), &json!({})).await.json();
        next["pair"]["code"].as_str().unwrap().to_owned()
    }

    async fn close(&self, rule: Rule) {
        let trials = self.service.trials(self.study).await;
        let gaits: Vec<TrialId> =
            trials.iter().filter(|trial| trial.state == TrialState::Converged).map(|trial| trial.id).collect();
        match rule {
            Rule::Safety => {
                let report = json!({"trial_a": gaits[0], "trial_b": gaits[1], "answer": "unsafe_both", "author": "S"});
                self.service.post(&format!("/api/v1/studies/{}/assessments", self.study), &report).await;
            }
            Rule::Certificate => {
                // Nobody certifies it again before the answer comes.
                let mut writer = self.service.store.write().await.unwrap();
                for sql in ["drop trigger certificates_no_delete", "drop trigger gaits_no_delete"] {
                    let _ = sqlx::query(sqlx::AssertSqlSafe(sql.to_owned())).execute(&mut **writer).await;
                }
                sqlx::query("delete from certificates").execute(&mut **writer).await.unwrap();
                sqlx::query("delete from gaits").execute(&mut **writer).await.unwrap();
                gaitwright_store::commit(writer).await.unwrap();
            }
            Rule::Withdrawal => {
                let subject = self.service.subject().await;
                self.service.post(&format!("/api/v1/subjects/{subject}/consents"), &json!({"form": "1"})).await;
                self.service.post(&format!("/api/v1/subjects/{subject}/withdraw"), &json!({"reason": "asked"})).await;
            }
            other => panic!("{other:?} is not for raters"),
        }
    }
}

#[tokio::test]
async fn person_answers_a_pair_either_blind_or_open_but_not_both() {
    for blind_first in [true, false] {
        let scene = Rated::new().await;
        let code = scene.code().await;
        let shown = blind_pairs::of_study(&mut scene.service.store.read().await.unwrap(), scene.study).await.unwrap();
        let (a, b) = shown[0].trials();
        let blind = format!("/api/v1/blind-pairs/{code}/answer");
        let open = format!("/api/v1/studies/{}/preferences", scene.study);
        let (said, chosen) = (json!({"answer": "first"}), json!({"trial_a": b, "trial_b": a, "answer": "a"}));
        let (first, second) =
            if blind_first { ((&blind, &said), (&open, &chosen)) } else { ((&open, &chosen), (&blind, &said)) };
        let given = scene.service.post(first.0, first.1).await;
        assert!(given.status.is_success(), "{}", given.text);
        let rows_before = scene.service.feedback(scene.study).await.len();
        let refused = scene.service.post(second.0, second.1).await;
        assert_eq!(refused.status, StatusCode::CONFLICT, "{}: {}", second.0, refused.text);
        assert!(refused.text.contains("has already answered this comparison"), "{}", refused.text);
        // Nor through the form, nor as a note or a suggestion.
        let form = format!(
            "a={a}&b={b}&answer=b&source=clinician&author={}&note=&key=01890000-0000-7000-8000-000000000008",
            shown[0].rater
        );
        let page = scene.service.post_text(&format!("/studies/{}/compare", scene.study), FORM, &form).await;
        assert!(!page.status.is_server_error(), "{}", page.text);
        let note = json!({"trial_a": a, "trial_b": b, "answer": "cannot_tell"});
        let noted = scene.service.post(&format!("/api/v1/studies/{}/assessments", scene.study), &note).await;
        assert_eq!(noted.status, StatusCode::CONFLICT, "{}", noted.text);
        let bounds = scene.service.trials(scene.study).await.into_iter().find(|trial| trial.id == a).unwrap().action;
        let suggested = json!({"over": b, "bounds": bounds});
        let suggested = scene.service.post(&format!("/api/v1/studies/{}/suggestions", scene.study), &suggested).await;
        assert_eq!(suggested.status, StatusCode::CONFLICT, "{}", suggested.text);
        let rows = scene.service.feedback(scene.study).await;
        let of_people = |from: usize| {
            rows[from..].iter().filter(|row| row.source != Source::Evaluation && row.source != Source::GaitRmse).count()
        };
        assert_eq!(of_people(rows_before), 0, "blind first: {blind_first}");
        let next =
            scene.service.post(&format!("/api/v1/studies/{}/blind-pairs/next", scene.study), &json!({})).await.json();
        assert_ne!(next["pair"]["code"], json!(code), "the pair is not shown again");
        scene.service.stop().await;
    }
}

#[tokio::test]
async fn answer_about_a_gait_reported_as_unsafe_is_stored_and_not_learned() {
    let scene = Scene::new().await;
    let session = scene.session(3).await;
    scene.violate(Rule::Safety).await;
    let before = scene.service.feedback(scene.study).await.len();
    scene.post(&format!("/api/v1/lab-sessions/{session}/answers"), &json!({"number": 1, "answer": "first"})).await;
    scene.post(&format!("/api/v1/lab-sessions/{session}/unblind"), &json!({"reason": "done"})).await;
    assert_eq!(scene.service.feedback(scene.study).await.len(), before, "nothing reaches the learner");
    let rows = lab_sessions::of_study(&mut scene.service.store.read().await.unwrap(), scene.study).await.unwrap();
    assert!(rows[0].answer().is_some(), "what was said stays in the record");
    let audit = scene.service.fetch("/api/v1/audit").await.text;
    assert!(audit.contains("lab_session.answer_not_used"), "{audit}");
    scene.service.stop().await;
}

/// The recommendation names walkable gaits only.
#[tokio::test]
async fn recommendation_excludes_unsafe_and_uncertified_gaits() {
    for rule in [Rule::Safety, Rule::Certificate, Rule::Withdrawal] {
        let scene = Scene::new().await;
        let recommended = format!("/api/v1/studies/{}/recommendation", scene.study);
        let best: TrialId =
            scene.service.fetch(&recommended).await.json()["trial_id"].as_str().unwrap().parse().unwrap();
        let other = if scene.pair.1 == best { scene.pair.0 } else { scene.pair.1 };
        let closed =
            Scene { pair: (best, other), equal: if scene.equal == best { scene.pair.0 } else { scene.equal }, ..scene };
        closed.violate(rule).await;
        let after = closed.service.fetch(&recommended).await;
        assert!(
            after.status == StatusCode::CONFLICT || after.json()["trial_id"] != json!(best),
            "{rule:?}: {}",
            after.text
        );
        closed.service.stop().await;
    }
}

#[test]
fn one_function_writes_the_learner_log_and_one_writes_trials() {
    let mut writers = Vec::new();
    let mut appenders = Vec::new();
    let mut planners = Vec::new();
    for (name, text) in sources::of_server() {
        let flat = text.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase();
        if flat.contains("into feedback ") || flat.contains("into feedback(") {
            writers.push(name.clone());
        }
        if text.contains("feedback::append(") || text.contains("feedback::{append") {
            appenders.push(name.clone());
        }
        if text.contains("trials::insert(") || text.contains("trials::{insert") {
            planners.push(name);
        }
    }
    assert_eq!(writers, ["store/src/feedback/mod.rs"], "SQL that writes the table");
    assert_eq!(appenders, ["service/src/studies/feedback_log.rs"], "callers of the function that writes it");
    assert_eq!(planners, ["service/src/studies/snapshot.rs"], "callers of the function that writes trials");
}

/// A trial that a study could plan next, with the snapshot that it follows from.
struct Plan {
    snapshot: StudySnapshot,
    trial: NewTrial,
}

impl Plan {
    async fn of(scene: &Rated) -> Self {
        let study = scene.service.get(scene.study).await;
        let snapshot = StudySnapshot::read(&mut scene.service.store.read().await.unwrap(), study).await.unwrap();
        let last = snapshot.trials.last().unwrap();
        let trial = NewTrial {
            number: last.number + 1,
            action_index: last.action_index,
            action: last.action,
            reason: "as asked".to_owned(),
            best_before: None,
            warm_started_from: None,
        };
        Self { snapshot, trial }
    }

    /// Whether the plan can be written. The change is dropped, so that it leaves no trace.
    async fn is_written(&self, scene: &Rated) -> bool {
        let mut writer = scene.service.store.write().await.unwrap();
        self.snapshot.write_trial(&mut writer, &self.trial).await.unwrap().is_some()
    }
}

#[tokio::test]
async fn plan_made_before_an_answer_is_not_written() {
    let scene = Rated::new().await;
    let code = scene.code().await;
    let plan = Plan::of(&scene).await;
    assert!(plan.is_written(&scene).await);
    let answer = format!("/api/v1/blind-pairs/{code}/answer");
    let answered = scene.service.post(&answer, &json!({"answer": "first"})).await;
    assert!(answered.status.is_success(), "{}", answered.text);
    assert!(!plan.is_written(&scene).await);
    scene.service.stop().await;
}

#[tokio::test]
async fn plan_made_before_a_safety_report_is_not_written() {
    let scene = Rated::new().await;
    let plan = Plan::of(&scene).await;
    assert!(plan.is_written(&scene).await);
    let feedback = scene.service.feedback(scene.study).await.len();
    scene.close(Rule::Safety).await;
    assert_eq!(scene.service.feedback(scene.study).await.len(), feedback, "both unsafe: nothing reaches the learner");
    assert!(!plan.is_written(&scene).await, "although no answer arrived");
    scene.service.stop().await;
}

#[tokio::test]
async fn plan_made_before_another_trial_is_not_written() {
    let scene = Rated::new().await;
    let plan = Plan::of(&scene).await;
    assert!(plan.is_written(&scene).await);
    let mut writer = scene.service.store.write().await.unwrap();
    plan.snapshot.write_trial(&mut writer, &plan.trial).await.unwrap().expect("the plan is current");
    commit(writer).await.unwrap();
    // A later number, so that only the check of the snapshot can refuse it.
    let late = Plan { trial: NewTrial { number: plan.trial.number + 1, ..plan.trial.clone() }, ..plan };
    assert!(!late.is_written(&scene).await);
    scene.service.stop().await;
}
