//! Archives are untrusted: forgeries are refused with a reason, archives that would exhaust the memory are refused
//! early, and data that cannot be checked is marked.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_optimizer::{Gait, GaitFigures, Mesh};
use gaitwright_service::studies::archive::{self, SigningKey};
use gaitwright_store::archived_row::Row;
use gaitwright_store::studies::{FeedbackMode, StudyState};
use gaitwright_store::{Store, StudyId, now};
use gaitwright_tests::archives::{exported, import, import_trusting};
use gaitwright_tests::cli;
use gaitwright_tests::consistent_gaits::Consistent;
use gaitwright_tests::service::Service;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// A study with answers of every kind, its service and its archive.
async fn study() -> (TempDir, Service, StudyId, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Consistent::default(), 1).await;
    let study = service.study(|new| (new.trial_budget, new.feedback_mode) = (8, FeedbackMode::Mixed)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let good: Vec<_> = trials.iter().filter(|t| t.state.as_str() == "converged").map(|t| t.id).collect();
    for (path, body) in [
        ("preferences", json!({"trial_a": good[0], "trial_b": good[1], "answer": "b", "author": "K"})),
        ("preferences", json!({"trial_a": good[2], "trial_b": good[0], "answer": "no_difference", "author": "K"})),
        ("assessments", json!({"first": good[1], "second": good[2], "answer": "unsafe_first", "author": "K"})),
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

/// The rows of an archive, each with its table.
#[derive(Clone)]
struct Rows(Vec<(String, Value)>);

impl Rows {
    fn of(file: &[u8]) -> Self {
        let start = file.iter().position(|byte| *byte == b'\n').unwrap() + 1;
        let text = String::from_utf8(zstd::decode_all(&file[start..]).unwrap()).unwrap();
        let lines = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
        Self(
            lines
                .filter(|line| line.get("row").is_some())
                .map(|mut line| (line["table"].as_str().unwrap().to_owned(), line["row"].take()))
                .collect(),
        )
    }

    /// An archive of these rows, as made by a forger who knows the format.
    fn packed(&self) -> Vec<u8> {
        let mut lines = String::new();
        for (table, row) in &self.0 {
            let known: Result<Row, _> = serde_json::from_value(row.clone());
            let sha256 = known.map_or_else(|_| "0".repeat(64), |row| row.sha256());
            lines += &json!({"table": table, "sha256": sha256, "row": row}).to_string();
            lines.push('\n');
        }
        let end = json!({"end": {"rows": self.0.len(), "sha256": hex::encode(Sha256::digest(&lines))}});
        framed(&format!("{lines}{end}\n"))
    }

    fn table(&mut self, table: &str) -> Vec<&mut Value> {
        self.0.iter_mut().filter(|(name, _)| name == table).map(|(_, row)| row).collect()
    }

    fn first(&mut self, table: &str) -> &mut Value {
        self.table(table).into_iter().next().unwrap_or_else(|| panic!("no row of {table}"))
    }

    /// Adds a row after the last one of its table.
    fn add(&mut self, table: &str, row: Value) {
        let last = self.0.iter().rposition(|(name, _)| name == table).map_or(self.0.len(), |place| place + 1);
        self.0.insert(last, (table.to_owned(), row));
    }

    fn copy(&mut self, table: &str, change: impl FnOnce(&mut Value)) {
        let mut row = self.first(table).clone();
        change(&mut row);
        self.add(table, row);
    }
}

/// An archive with this content.
fn framed(content: &str) -> Vec<u8> {
    [b"gaitwright study 4\n", &zstd::encode_all(content.as_bytes(), 3).unwrap()[..]].concat()
}

fn sha256(text: &[u8]) -> String {
    hex::encode(Sha256::digest(text))
}

fn blob(bytes: &[u8]) -> Value {
    json!({"hexadecimal": hex::encode(zstd::encode_all(bytes, 3).unwrap())})
}

fn text_of(cell: &Value) -> String {
    let bytes = hex::decode(cell["hexadecimal"].as_str().unwrap()).unwrap();
    String::from_utf8(zstd::decode_all(&bytes[..]).unwrap()).unwrap()
}

/// Changes the JSON document in a text column.
fn within(row: &mut Value, column: &str, change: impl FnOnce(&mut Value)) {
    let mut document: Value = serde_json::from_str(row[column].as_str().unwrap()).unwrap();
    change(&mut document);
    row[column] = document.to_string().into();
}

/// Changes the gait in a row of gaits, and its hash with it.
fn gait(row: &mut Value, change: impl FnOnce(&mut Value)) {
    let mut document: Value = serde_json::from_str(&text_of(&row["gait"])).unwrap();
    change(&mut document);
    let text = document.to_string();
    row["gait"] = blob(text.as_bytes());
    row["gait_sha256"] = sha256(text.as_bytes()).into();
}

/// Changes a definition, its hash and the name beside it.
fn definition(row: &mut Value, change: impl FnOnce(&mut Value)) {
    within(row, "definition", change);
    let text = row["definition"].as_str().unwrap().to_owned();
    row["sha256"] = sha256(text.as_bytes()).into();
    let document: Value = serde_json::from_str(&text).unwrap();
    row["name"] = document["name"].clone();
}

/// Changes the report of the first converged trial wherever it occurs.
fn in_reports(rows: &mut Rows, change: impl Fn(&mut Value)) {
    let trial = rows.table("trials").into_iter().find(|row| row["state"] == "converged").unwrap();
    within(trial, "report", &change);
    let id = trial["id"].clone();
    for result in rows.table("results").into_iter().filter(|row| row["trial_id"] == id) {
        within(result, "report", &change);
    }
}

/// Changes a figure of the first converged trial wherever it occurs.
fn everywhere(rows: &mut Rows, column: &str, value: f64) {
    rows.table("trials").into_iter().find(|row| row["state"] == "converged").unwrap()[column] = value.into();
    in_reports(rows, |report| report[column] = value.into());
}

/// Scales a figure by a factor that makes another motion of it.
fn scale(figure: &mut Value) {
    *figure = (1.0002 * figure.as_f64().unwrap()).into();
}

/// Lengthens the last domain of a gait, with the times that follow from it.
fn lengthen(gait: &mut Value) {
    let domain = &mut gait["domains"][7];
    let before = domain["duration_s"].as_f64().unwrap();
    domain["duration_s"] = (before + 1e-3).into();
    let (start, after) = (domain["time_s"][0].as_f64().unwrap(), domain["duration_s"].as_f64().unwrap());
    for time in domain["time_s"].as_array_mut().unwrap() {
        *time = (start + (time.as_f64().unwrap() - start) * after / before).into();
    }
    let stride = gait["stride_time_s"].as_f64().unwrap() + after - before;
    gait["stride_time_s"] = stride.into();
    gait["speed_m_s"] = (gait["stride_length_m"].as_f64().unwrap() / stride).into();
}

/// Writes the figures of a gait into the reports of the first converged trial.
fn state_figures_of(rows: &mut Rows, gait: &Value) {
    let gait: Gait = serde_json::from_value(gait.clone()).unwrap();
    let reference = serde_json::from_str(rows.first("reference_gaits")["definition"].as_str().unwrap()).unwrap();
    let figures = GaitFigures::of(&gait, &reference).unwrap();
    everywhere(rows, "gait_rmse_rad", figures.gait_rmse_rad);
    everywhere(rows, "cost_of_transport", figures.cost_of_transport);
    in_reports(rows, |report| {
        report["gait_rmse_parts_rad"] = json!(figures.gait_rmse_parts_rad);
        report["speed_m_s"] = json!(figures.speed_m_s);
        report["durations_s"] = json!(figures.durations_s);
    });
}

fn of_source<'a>(rows: &'a mut Rows, source: &str) -> &'a mut Value {
    let kind = |row: &Value| row["kind"] == "preference" && row["source"] == source;
    rows.table("feedback").into_iter().find(|row| kind(row)).unwrap()
}

type Forgery = (&'static str, fn(&mut Rows), &'static str);

const FORGERIES: [Forgery; 68] = [
    ("a better RMSE", |r| r.first("trials")["gait_rmse_rad"] = 0.01.into(), "its figures differ from its solve report"),
    ("a better RMSE everywhere", |r| everywhere(r, "gait_rmse_rad", 0.01), "its stated gait_rmse_rad is 0.01"),
    ("a negative RMSE", |r| everywhere(r, "gait_rmse_rad", -1.0), "negative or not finite"),
    (
        "a better cost",
        |r| r.first("trials")["cost_of_transport"] = 0.01.into(),
        "its figures differ from its solve report",
    ),
    (
        "a violation that converges",
        |r| everywhere(r, "max_violation", 0.5),
        "it is converged, but its violation is 0.5",
    ),
    (
        "parts of an RMSE",
        |r| {
            in_reports(r, |report| report["gait_rmse_parts_rad"] = json!([0.0, 0.0, 0.0, 0.0, 0.0]));
        },
        "its stated gait_rmse_parts_rad is",
    ),
    ("a better cost everywhere", |r| everywhere(r, "cost_of_transport", 0.01), "its stated cost_of_transport is 0.01"),
    (
        "a longer stride",
        |r| in_reports(r, |report| scale(&mut report["stride_length_m"])),
        "its stated stride_length_m is",
    ),
    ("a faster gait", |r| in_reports(r, |report| scale(&mut report["speed_m_s"])), "its stated speed_m_s is"),
    ("a longer domain", |r| in_reports(r, |report| scale(&mut report["durations_s"][7])), "its stated durations_s is"),
    ("a faster hip", |r| in_reports(r, |report| scale(&mut report["vhip_m_s"][3])), "its stated vhip_m_s is"),
    (
        "a longer domain of the gait, too",
        |r| {
            let id = r.table("trials").into_iter().find(|row| row["state"] == "converged").unwrap()["id"].clone();
            let row = r.table("gaits").into_iter().find(|row| row["trial_id"] == id).unwrap();
            gait(row, lengthen);
            let document: Value = serde_json::from_str(&text_of(&row["gait"])).unwrap();
            for column in ["speed_m_s", "stride_time_s"] {
                row[column] = document[column].clone();
            }
            state_figures_of(r, &document);
        },
        "the durations of its gait do not match its motion",
    ),
    (
        "a gait of another subject",
        |r| gait(r.first("gaits"), |g| scale(&mut g["subject"]["body_mass_kg"])),
        "a different height or body mass",
    ),
    (
        "a gait that is not its hash",
        |r| r.first("gaits")["gait_sha256"] = "0".repeat(64).into(),
        "does not match its hash",
    ),
    (
        "another gait under the hash",
        |r| {
            let other = r.table("gaits")[1]["gait"].clone();
            r.first("gaits")["gait"] = other;
        },
        "does not match its hash",
    ),
    (
        "the gait of another trial",
        |r| {
            let other = r.table("gaits")[1].clone();
            for column in ["gait", "gait_sha256", "speed_m_s", "stride_length_m", "stride_time_s"] {
                r.first("gaits")[column] = other[column].clone();
            }
        },
        "another device, problem or action",
    ),
    (
        "a changed angle",
        |r| gait(r.first("gaits"), |g| g["domains"][0]["q"][1][5] = 1.0.into()),
        "its stated gait_rmse_rad is",
    ),
    ("a gait without domains", |r| gait(r.first("gaits"), |g| g["domains"] = json!([])), "number of domains"),
    ("a gait of missing points", |r| gait(r.first("gaits"), |g| g["domains"][0]["qd"] = json!([])), "has 0 entries"),
    ("a gait of another device", |r| gait(r.first("gaits"), |g| g["device"]["name"] = "X".into()), "another device"),
    ("a gait of other bounds", |r| gait(r.first("gaits"), |g| g["bounds"]["a1"] = 16.0.into()), "another device"),
    ("a gait that is no gait", |r| gait(r.first("gaits"), |g| *g = json!({})), "missing field"),
    ("another speed beside it", |r| r.first("gaits")["speed_m_s"] = 9.0.into(), "its gait does not match its row"),
    (
        "a warm start of another mesh",
        |r| {
            let row = r.first("gaits");
            let mut start: Value = serde_json::from_str(&text_of(&row["warm_start"])).unwrap();
            start["mesh"] = serde_json::to_value(Mesh { ds2: 8, ds3: 8, ss2: 8, ss1: 8 }).unwrap();
            row["warm_start"] = blob(start.to_string().as_bytes());
        },
        "warm start belongs to another problem",
    ),
    ("iterations that are none", |r| r.first("gaits")["iterations"] = blob(b"[1]"), "invalid type"),
    ("a gait that is not compressed", |r| r.first("gaits")["iterations"] = json!({"hexadecimal": "00"}), "trial 1"),
    ("a device without anything", |r| definition(r.first("devices"), |d| *d = json!({"name": "X"})), "device: "),
    ("an empty device", |r| r.first("devices")["definition"] = "{}".into(), "device: "),
    (
        "a heavier device under its hash",
        |r| within(r.first("devices"), "definition", |d| d["links"] = json!([])),
        "device",
    ),
    ("another name beside a device", |r| r.first("devices")["name"] = "X".into(), "do not match"),
    ("another hash beside a device", |r| r.first("devices")["sha256"] = "0".repeat(64).into(), "do not match"),
    (
        "a nearer reference",
        |r| definition(r.first("reference_gaits"), |d| d["angles_rad"][7][1] = 0.9.into()),
        "its stated gait_rmse_rad is",
    ),
    (
        "a reference of few rows",
        |r| definition(r.first("reference_gaits"), |d| d["angles_rad"] = json!([])),
        "angles_rad",
    ),
    (
        "another hash beside a reference",
        |r| r.first("reference_gaits")["sha256"] = "0".repeat(64).into(),
        "do not match",
    ),
    ("a giant", |r| r.first("subjects")["height_m"] = 3.0.into(), "subjects_height"),
    ("a light subject", |r| r.first("subjects")["body_mass_kg"] = 30.0.into(), "body_mass_kg"),
    ("a name for a pseudonym", |r| r.first("subjects")["pseudonym"] = "kim@example.org".into(), "pseudonym"),
    (
        "another subject",
        |r| {
            r.copy("subjects", |s| {
                s["id"] = "01900000-0000-7000-8000-000000000001".into();
                s["pseudonym"] = "S77".into();
            });
        },
        "do not belong to its study",
    ),
    (
        "another device",
        |r| {
            r.copy("devices", |d| {
                d["id"] = "01900000-0000-7000-8000-000000000001".into();
                definition(d, |d| d["name"] = "X".into());
            });
        },
        "devices has 2 rows",
    ),
    ("another study", |r| r.copy("studies", |s| s["id"] = "01900000-0000-7000-8000-000000000001".into()), "2 studies"),
    ("an identifier that is none", |r| r.first("studies")["id"] = "x".into(), "not an identifier"),
    ("a seed beyond the range", |r| r.first("studies")["seed"] = (-1).into(), "studies_seed"),
    (
        "a learner that is none",
        |r| within(r.first("studies"), "learner", |l| l["ordinal_thresholds"] = json!([])),
        "study",
    ),
    ("too many at a time", |r| r.first("studies")["parallel_trials"] = 65.into(), "studies_parallel_trials"),
    (
        "a search space without actions",
        |r| within(r.first("studies"), "search_space", |s| s["dimensions"] = json!([])),
        "search_space",
    ),
    ("a state that is none", |r| r.first("studies")["state"] = "won".into(), "studies_state"),
    ("a gap in the numbers", |r| r.table("trials")[7]["number"] = 9.into(), "should have number 8"),
    (
        "another action",
        |r| within(r.first("trials"), "action", |a| a["a2"] = 75.0.into()),
        "the action does not match its index",
    ),
    ("an action out of space", |r| r.first("trials")["action_index"] = 99_999_999.into(), "not in the search space"),
    (
        "a converged trial that did not",
        |r| r.first("trials")["state"] = "not_converged".into(),
        "contradicts the state",
    ),
    ("a failed trial with figures", |r| r.first("trials")["state"] = "failed".into(), "has a solve report"),
    (
        "a best trial from nowhere",
        |r| r.first("trials")["best_before"] = "01900000-0000-7000-8000-000000000001".into(),
        "FOREIGN KEY",
    ),
    (
        "an open job of a trial that ended",
        |r| r.first("jobs")["state"] = "queued".into(),
        "its state contradicts its job",
    ),
    (
        "another result",
        |r| within(r.first("results"), "report", |p| p["iterations"] = 1.into()),
        "its result differs from the accepted one",
    ),
    (
        "a label turned",
        |r| {
            let label = r.table("feedback").into_iter().find(|row| row["kind"] == "label").unwrap();
            label["category"] = (1 - label["category"].as_i64().unwrap()).into();
        },
        "does not match the trial state",
    ),
    (
        "a label taken away",
        |r| {
            let place = r.0.iter().position(|(_, row)| row["kind"] == "label").unwrap();
            r.0.remove(place);
        },
        "7 have a label",
    ),
    (
        "a preference of Gait RMSE turned",
        |r| {
            let row = of_source(r, "gait_rmse");
            let (a, b) = (row["trial_a"].clone(), row["trial_b"].clone());
            (row["trial_a"], row["trial_b"]) = (b, a);
        },
        "the preference contradicts Gait RMSE",
    ),
    (
        "a tie of Gait RMSE",
        |r| of_source(r, "gait_rmse")["kind"] = "tie".into(),
        "the preference contradicts Gait RMSE",
    ),
    (
        "a preference from nowhere",
        |r| of_source(r, "clinician")["source"] = "convergence".into(),
        "the source of a preference is convergence",
    ),
    (
        "an answer by a name with spaces around it",
        |r| of_source(r, "clinician")["author"] = " Nina".into(),
        "which has leading or trailing spaces",
    ),
    (
        "an answer by an invisible name",
        |r| of_source(r, "clinician")["author"] = "\u{200b}".into(),
        "1 to 80 printable characters",
    ),
    (
        "an answer given twice",
        |r| {
            let mut row = of_source(r, "clinician").clone();
            // The first one was retracted.
            for (number, author) in [(1, "Nina"), (2, "NINA")] {
                row["seq"] = (90_000 + number).into();
                row["id"] = format!("01900000-0000-7000-8000-{number:012}").into();
                row["author"] = author.into();
                r.add("feedback", row.clone());
            }
        },
        "has answered this comparison already",
    ),
    (
        "an answer from before its trials",
        |r| of_source(r, "clinician")["created_at"] = "2020-01-01T00:00:00.000Z".into(),
        "before trial",
    ),
    (
        "an assessment from before its gaits",
        |r| r.first("assessments")["created_at"] = "2020-01-01T00:00:00.000Z".into(),
        "before trial",
    ),
    (
        "a suggestion out of space",
        |r| {
            r.copy("feedback", |f| {
                f["seq"] = 99_999.into();
                f["id"] = "01900000-0000-7000-8000-000000000001".into();
                f["kind"] = "suggestion".into();
                f["source"] = "clinician".into();
                f["category"] = Value::Null;
                f["suggested"] = 99_999_999.into();
            });
        },
        "not in the search space",
    ),
    ("a retraction of nothing", |r| r.first("retractions")["feedback_seq"] = 99_999.into(), "FOREIGN KEY"),
    (
        "an author that reads backwards",
        |r| of_source(r, "clinician")["author"] = "a\u{202e}b".into(),
        "printable characters",
    ),
    ("a consent", |r| r.0.push(("consents".to_owned(), json!({"seq": 1}))), "which is not part of an archive"),
];

/// Forgeries that only checks of the whole file can detect.
const MORE: [Forgery; 9] = [
    ("an audit row", |r| r.0.push(("audit".to_owned(), json!({"seq": 1}))), "which is not part of an archive"),
    (
        "a certificate",
        |r| r.0.push(("certificates".to_owned(), json!({"passed": 1}))),
        "which is not part of an archive",
    ),
    (
        "a review of a report that nobody made yet",
        |r| {
            let session = "01900000-0000-7000-8000-000000000003";
            let (review, trial) = ("01900000-0000-7000-8000-000000000004", r.first("assessments")["first"].clone());
            r.0.push((
                "safety_reviews".to_owned(),
                json!({
                    "id": review, "trial_id": trial, "said_until": "2026-01-01T00:00:00.000Z", "decision": "walkable",
                    "author": "K", "reason": "r", "created_at": "2026-01-01T00:00:00.000Z"
                }),
            ));
            let reviewed = json!({"review_id": review, "report_id": session});
            r.0.push(("safety_review_reports".to_owned(), reviewed));
        },
        "the archive has no safety report",
    ),
    ("an unknown column", |r| r.first("trials")["certified"] = 1.into(), "unknown column"),
    (
        "a time to come",
        |r| r.first("trials")["created_at"] = "2999-01-01T00:00:00.000Z".into(),
        "which is in the future",
    ),
    ("no time at all", |r| r.first("feedback")["created_at"] = "soon".into(), "not a time"),
    (
        "trials before their study",
        |r| {
            let place = r.0.iter().position(|(table, _)| table == "studies").unwrap();
            let study = r.0.remove(place);
            r.0.push(study);
        },
        "FOREIGN KEY",
    ),
    ("no study", |r| r.0.clear(), "0 studies"),
    (
        "a safety review of nothing",
        |r| {
            r.0.push((
                "safety_reviews".to_owned(),
                json!({
                    "id": "01900000-0000-7000-8000-000000000001", "trial_id": "01900000-0000-7000-8000-000000000002",
                    "said_until": "2026-01-01T00:00:00.000Z", "decision": "walkable", "author": "K", "reason": "r",
                    "created_at": "2026-01-01T00:00:00.000Z"
                }),
            ));
        },
        "FOREIGN KEY",
    ),
];

#[tokio::test]
async fn review_made_with_a_fast_clock_does_not_cover_later_reports() {
    let (folder, service, study, _) = study().await;
    let listed = format!("/api/v1/studies/{study}/safety-reports");
    let gait = service.fetch(&listed).await.items()[0]["trial_id"].as_str().unwrap().to_owned();
    let review = json!({"decision": "walkable", "reason": "seen again"});
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
    rows.first("safety_reviews")["said_until"] = json!(ahead);
    let database = folder.path().join("b.db");
    let store = Store::open(&database).await.unwrap();
    import(&store, &rows.packed()).await.unwrap();
    store.close().await;
    let other = Service::start(&database, Consistent::default(), 1).await;
    assert_eq!(other.fetch(&listed).await.items()[0]["open"], json!(false));
    let report = other.post(&format!("/api/v1/trials/{gait}/safety-reports"), &json!({"note": "fell"})).await;
    assert_eq!((report.status, &report.json()["open"]), (StatusCode::CREATED, &json!(true)), "{}", report.text);
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

    // Its origin goes with it, further on; and whoever takes it through the service is on record.
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
    service.stop().await;
    let other = Service::start(&folder.path().join("b.db"), Consistent::default(), 1).await;
    let here = other.subject().await;
    assert_ne!(here, there);
    let mut rows = Rows::of(&file);
    rows.first("subjects")["notes"] = json!("another person");
    let refusal = import(&other.store, &rows.packed()).await.unwrap_err().to_string();
    assert!(refusal.contains("has the name \"paper-"), "{refusal}");
    assert_eq!(import(&other.store, &file).await.unwrap(), study);
    assert_eq!(other.get(study).await.plan.subject_id, here);
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

/// Imports a decompression bomb with the command line. Returns its message and its peak memory in bytes.
fn detonate(folder: &Path, bomb: &[u8]) -> (bool, String, u64) {
    let file = folder.join("bomb.gait");
    std::fs::write(&file, bomb).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_gaitwright-cli"));
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("GAITWRIGHT_")) {
        command.env_remove(name);
    }
    let mut child = command
        .args(["import", "bomb.gait", "--database", "bombed.db"])
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0_u64;
    while child.try_wait().unwrap().is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("0");
        peak = peak.max(line.trim().trim_end_matches(" kB").trim().parse::<u64>().unwrap_or(0) * 1024);
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let output = child.wait_with_output().unwrap();
    (output.status.code() == Some(2), String::from_utf8_lossy(&output.stderr).into_owned(), peak)
}

/// Maximum memory of an import, whatever the archive.
const MOST_MEMORY_BYTES: u64 = 320 << 20;

/// A compressed archive of content that is made as it is compressed.
fn streamed(write: impl FnOnce(&mut dyn Write)) -> Vec<u8> {
    let mut encoder = zstd::Encoder::new(b"gaitwright study 4\n".to_vec(), 1).unwrap();
    write(&mut encoder);
    encoder.finish().unwrap()
}

fn repeated(out: &mut dyn Write, piece: &str, bytes: usize) {
    let block = piece.repeat((1 << 20) / piece.len());
    for _ in 0..bytes / block.len() {
        out.write_all(block.as_bytes()).unwrap();
    }
}

const GIGABYTE: usize = 1 << 30;

#[cfg(target_os = "linux")]
#[tokio::test]
async fn decompression_bombs_are_refused_within_bounded_memory() {
    let (folder, service, _, file) = study().await;
    service.stop().await;
    let whole = Rows::of(&file);
    // A value of a gigabyte and more in some kilobytes, as a compressed column of an archive that is right otherwise.
    let zeros = |bytes: usize| {
        let mut encoder = zstd::Encoder::new(Vec::new(), 1).unwrap();
        repeated(&mut encoder, " ", bytes);
        json!({"hexadecimal": hex::encode(encoder.finish().unwrap())})
    };
    let with = |change: &dyn Fn(&mut Rows)| {
        let mut rows = whole.clone();
        change(&mut rows);
        rows.packed()
    };
    let huge = zeros(2 * GIGABYTE);
    let row = |cell: &str| format!("{{\"table\":\"subjects\",\"sha256\":\"\",\"row\":{{\"id\":{cell}");
    let mut bombs: Vec<(&str, Vec<u8>)> = vec![
        ("a line of a gigabyte", streamed(|out| repeated(out, "a", GIGABYTE))),
        ("a gigabyte of brackets", streamed(|out| repeated(out, "[", GIGABYTE))),
        ("a gigabyte of empty lines", streamed(|out| repeated(out, "\n", GIGABYTE))),
        ("a gigabyte of objects", streamed(|out| repeated(out, "{\"row\":", GIGABYTE))),
        (
            "a deep value",
            streamed(|out| {
                out.write_all(row("").as_bytes()).unwrap();
                repeated(out, "[", 30 << 20);
                out.write_all(b"\n").unwrap();
            }),
        ),
        (
            "a deep object",
            streamed(|out| {
                out.write_all(row("").as_bytes()).unwrap();
                repeated(out, "{\"hexadecimal\":", 30 << 20);
                out.write_all(b"\n").unwrap();
            }),
        ),
        (
            "a text of a gigabyte",
            streamed(|out| {
                out.write_all(row("\"").as_bytes()).unwrap();
                repeated(out, "x", GIGABYTE);
            }),
        ),
        (
            "a text of 30 MB in escapes",
            streamed(|out| {
                out.write_all(row("\"").as_bytes()).unwrap();
                repeated(out, "\\u0041", 30 << 20);
                out.write_all(b"\"}}\n").unwrap();
            }),
        ),
        (
            "a number of a gigabyte",
            streamed(|out| {
                out.write_all(row("").as_bytes()).unwrap();
                repeated(out, "1", GIGABYTE);
            }),
        ),
        (
            "a number of 30 MB",
            streamed(|out| {
                out.write_all(row("").as_bytes()).unwrap();
                repeated(out, "1", 30 << 20);
                out.write_all(b"}}\n").unwrap();
            }),
        ),
        (
            "bytes of 60 MB",
            streamed(|out| {
                out.write_all(row("{\"hexadecimal\":\"").as_bytes()).unwrap();
                repeated(out, "00", 60 << 20);
                out.write_all(b"\"}}}\n").unwrap();
            }),
        ),
        (
            "a row of a million columns",
            streamed(|out| {
                out.write_all(b"{\"table\":\"subjects\",\"sha256\":\"\",\"row\":{").unwrap();
                for number in 0..1_000_000 {
                    write!(out, "\"c{number}\":1,").unwrap();
                }
                out.write_all(b"\"x\":1}}\n").unwrap();
            }),
        ),
        (
            "a name of 30 MB",
            streamed(|out| {
                out.write_all(b"{\"table\":\"subjects\",\"sha256\":\"\",\"row\":{\"").unwrap();
                repeated(out, "n", 30 << 20);
                out.write_all(b"\":1}}\n").unwrap();
            }),
        ),
        (
            "a table with a name of 30 MB",
            streamed(|out| {
                out.write_all(b"{\"table\":\"").unwrap();
                repeated(out, "n", 30 << 20);
                out.write_all(b"\",\"sha256\":\"\",\"row\":{}}\n").unwrap();
            }),
        ),
        ("a gait of 2 GB", with(&|rows| rows.first("gaits")["gait"] = huge.clone())),
        ("a warm start of 2 GB", with(&|rows| rows.first("gaits")["warm_start"] = huge.clone())),
        ("iterations of 2 GB", with(&|rows| rows.first("gaits")["iterations"] = huge.clone())),
        (
            "a gait of 31 MB of brackets",
            with(&|rows| {
                let text = format!("{{\"domains\":{}", "[".repeat(31 << 20));
                rows.first("gaits")["gait"] = blob(text.as_bytes());
                rows.first("gaits")["gait_sha256"] = sha256(text.as_bytes()).into();
            }),
        ),
        (
            "iterations of 31 MB of empty objects",
            with(&|rows| {
                rows.first("gaits")["iterations"] = blob(format!("[{}{{}}]", "{},".repeat(10 << 20)).as_bytes());
            }),
        ),
        (
            "settings of four million lists",
            with(&|rows| {
                let text = format!("{{\"mesh\":[{}[]]}}", "[],".repeat(1 << 20));
                rows.first("studies")["gait_settings"] = text.into();
            }),
        ),
        (
            "a search space of a million values",
            with(&|rows| {
                within(rows.first("studies"), "search_space", |space| {
                    space["dimensions"][0]["values"] = (0..400_000).map(f64::from).collect();
                });
            }),
        ),
        ("a deep report", with(&|rows| rows.first("trials")["report"] = "[".repeat(900).into())),
        ("a study within ten frames", (0..10).fold(framed("x\n"), |inner, _| framed(&hex::encode(inner)))),
    ];
    // Many rows, each of which is valid.
    let mut rows = whole.clone();
    let trial = rows.first("assessments").clone();
    bombs.push((
        "forty thousand assessments, cut off",
        streamed(|out| {
            for (table, row) in whole.0.iter().take_while(|(table, _)| table != "assessment_retractions") {
                let known: Row = serde_json::from_value(row.clone()).unwrap();
                writeln!(out, "{}", json!({"table": table, "sha256": known.sha256(), "row": row})).unwrap();
            }
            for number in 0..40_000 {
                let mut row = trial.clone();
                row["id"] = format!("01900000-0000-7000-8000-{number:012}").into();
                row["note"] = "n".repeat(2000).into();
                let known: Row = serde_json::from_value(row.clone()).unwrap();
                writeln!(out, "{}", json!({"table": "assessments", "sha256": known.sha256(), "row": row})).unwrap();
            }
        }),
    ));
    let mut window = zstd::Encoder::new(b"gaitwright study 4\n".to_vec(), 1).unwrap();
    window.window_log(27).unwrap();
    repeated(&mut window, "w", 512 << 20);
    bombs.push(("a window of 128 MB", window.finish().unwrap()));

    let mut failed = Vec::new();
    for (what, bomb) in &bombs {
        let (refused, text, peak) = detonate(folder.path(), bomb);
        println!(
            "{what}: {} bytes, peak {} MiB: {}",
            bomb.len(),
            peak >> 20,
            text.trim().chars().take(160).collect::<String>()
        );
        if !refused || peak > MOST_MEMORY_BYTES || folder.path().join("bombed.db").exists() {
            failed.push(format!("{what}: refused {refused}, peak {} MiB, {text}", peak >> 20));
        }
    }
    assert!(bombs.len() >= 20 && failed.is_empty(), "{}", failed.join("\n"));
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
