//! Forged archives, each with the reason for which it is refused.

use super::rows::{Rows, blob, definition, gait, text_of, within};
use gait_optimizer::{Gait, GaitResults, Mesh};
use serde_json::{Value, json};

/// Changes the report of the first converged trial wherever it occurs.
fn in_reports(rows: &mut Rows, change: impl Fn(&mut Value)) {
    let trial = rows.table("trials").into_iter().find(|row| row["state"] == "converged").unwrap();
    within(trial, "report", &change);
    let id = trial["id"].clone();
    for result in rows.table("attempts").into_iter().filter(|row| row["trial_id"] == id) {
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

/// Writes the results of a gait into the reports of the first converged trial.
fn state_figures_of(rows: &mut Rows, gait: &Value) {
    let gait: Gait = serde_json::from_value(gait.clone()).unwrap();
    let reference = serde_json::from_str(rows.first("reference_gaits")["definition"].as_str().unwrap()).unwrap();
    let results = GaitResults::of(&gait, &reference).unwrap();
    everywhere(rows, "gait_rmse_rad", results.gait_rmse_rad);
    everywhere(rows, "cost_of_transport", results.cost_of_transport);
    in_reports(rows, |report| {
        report["gait_rmse_parts_rad"] = json!(results.gait_rmse_parts_rad);
        report["speed_m_s"] = json!(results.speed_m_s);
        report["durations_s"] = json!(results.durations_s);
    });
}

pub(super) fn of_source<'a>(rows: &'a mut Rows, source: &str) -> &'a mut Value {
    let kind = |row: &Value| row["kind"] == "preference" && row["source"] == source;
    rows.table("feedback").into_iter().find(|row| kind(row)).unwrap()
}

type Forgery = (&'static str, fn(&mut Rows), &'static str);

/// Adds a copy of an answer under another number and name, with changes. Returns its identifier.
fn add_answer(rows: &mut Rows, number: u32, author: &str, change: impl FnOnce(&mut Value)) -> Value {
    let mut row = of_source(rows, "clinician").clone();
    row["seq"] = (90_000 + number).into();
    row["id"] = format!("01900000-0000-7000-8000-{number:012}").into();
    row["author"] = author.into();
    change(&mut row);
    rows.add("feedback", row.clone());
    row["id"].clone()
}

pub(super) const FORGERIES: [Forgery; 74] = [
    ("a better RMSE", |r| r.first("trials")["gait_rmse_rad"] = 0.01.into(), "its results differ from its solve report"),
    ("a better RMSE everywhere", |r| everywhere(r, "gait_rmse_rad", 0.01), "its stated gait_rmse_rad is 0.01"),
    ("a negative RMSE", |r| everywhere(r, "gait_rmse_rad", -1.0), "it must be a finite number of at least 0"),
    (
        "a better cost",
        |r| r.first("trials")["cost_of_transport"] = 0.01.into(),
        "its results differ from its solve report",
    ),
    (
        "a violation that converges",
        |r| everywhere(r, "max_violation", 0.5),
        "its state is converged, but its violation is 0.5",
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
    (
        "a learner setting that this version lacks",
        |r| within(r.first("studies"), "learner", |l| l["additive_share"] = 0.3.into()),
        "unknown field `additive_share`",
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
    ("a failed trial with results", |r| r.first("trials")["state"] = "failed".into(), "has a solve report"),
    (
        "a best trial from nowhere",
        |r| r.first("trials")["best_before"] = "01900000-0000-7000-8000-000000000001".into(),
        "FOREIGN KEY",
    ),
    (
        "an open job of a trial that ended",
        |r| r.first("solve_jobs")["state"] = "queued".into(),
        "its state contradicts its job",
    ),
    (
        "another result",
        |r| within(r.first("attempts"), "report", |p| p["iterations"] = 1.into()),
        "its result differs from the accepted one",
    ),
    (
        "a label turned",
        |r| {
            let label = r.table("feedback").into_iter().find(|row| row["kind"] == "label").unwrap();
            label["label"] = if label["label"] == "converged" { "not_converged" } else { "converged" }.into();
        },
        "does not match the trial state",
    ),
    (
        "a label taken away",
        |r| {
            let place = r.0.iter().position(|(_, row)| row["kind"] == "label").unwrap();
            r.0.remove(place);
        },
        "the number of labels is 7",
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
        "no difference by Gait RMSE",
        |r| of_source(r, "gait_rmse")["kind"] = "no_difference".into(),
        "the preference contradicts Gait RMSE",
    ),
    (
        "a preference from nowhere",
        |r| of_source(r, "clinician")["source"] = "evaluation".into(),
        "the source of a preference is evaluation; it must be gait_rmse, subject, clinician or script",
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
        "has already answered this comparison",
    ),
    (
        "an answer in place of nothing",
        |r| {
            add_answer(r, 1, "Nina", |row| row["replaces"] = "01900000-0000-7000-8000-000000000009".into());
        },
        "replaces an answer that is missing or not about the same two trials",
    ),
    (
        "an answer in place of one that counts",
        |r| {
            let first = add_answer(r, 1, "Nina", |_| ());
            add_answer(r, 2, "Olga", |row| row["replaces"] = first);
        },
        "replaces an answer that still counts",
    ),
    (
        "an answer replaced twice",
        |r| {
            let first = of_source(r, "clinician")["id"].clone();
            add_answer(r, 1, "Nina", |row| row["replaces"] = first.clone());
            add_answer(r, 2, "Olga", |row| row["replaces"] = first);
        },
        "feedback.replaces",
    ),
    (
        "an answer brought back without an undo",
        |r| {
            let first = of_source(r, "clinician")["id"].clone();
            add_answer(r, 1, "K", |row| row["restores"] = first);
        },
        "brings back an answer whose change was not undone",
    ),
    (
        "another answer than the one to bring back",
        |r| {
            let first = of_source(r, "clinician")["id"].clone();
            add_answer(r, 1, "K", |row| row["replaces"] = first.clone());
            r.copy("feedback_retractions", |retraction| retraction["feedback_seq"] = 90_001.into());
            add_answer(r, 2, "Nina", |row| row["restores"] = first);
        },
        "differs from the answer that it brings back",
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
                f["label"] = Value::Null;
                f["suggested"] = 99_999_999.into();
            });
        },
        "not in the search space",
    ),
    ("a retraction of nothing", |r| r.first("feedback_retractions")["feedback_seq"] = 99_999.into(), "FOREIGN KEY"),
    (
        "an author that reads backwards",
        |r| of_source(r, "clinician")["author"] = "a\u{202e}b".into(),
        "printable characters",
    ),
    ("a consent", |r| r.0.push(("consents".to_owned(), json!({"seq": 1}))), "which is not part of an archive"),
];

/// Forgeries that only checks of the whole file can detect.
pub(super) const MORE: [Forgery; 9] = [
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
            let (review, trial) = ("01900000-0000-7000-8000-000000000004", r.first("assessments")["trial_a"].clone());
            r.0.push((
                "safety_reviews".to_owned(),
                json!({
                    "id": review, "trial_id": trial, "decision": "cleared",
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
                    "decision": "cleared", "author": "K", "reason": "r",
                    "created_at": "2026-01-01T00:00:00.000Z"
                }),
            ));
        },
        "FOREIGN KEY",
    ),
];
