//! Uploads of measurement files to a lab session, step by step: what a page shows before anything is stored, and what the files
//! become.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_optimizer::ReferenceGait;
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::TrialState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::callers::FORM;
use gaitwright_tests::measured::{electromyogram, laboratory_angles};
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};
use std::fmt::Write;
use tempfile::TempDir;

/// A lab session with recorded walks.
struct Visit {
    service: Service,
    session: String,
    _folder: TempDir,
}

impl Visit {
    async fn begin() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
        let study = service.study(|new| new.number_of_trials = 12).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        let trials = service.trials(study).await;
        let mut gaits = trials.iter().filter(|trial| trial.state == TrialState::Converged);
        let gaits = json!({"trial_a": gaits.next().unwrap().id, "trial_b": gaits.next().unwrap().id});
        let session = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &gaits).await.json();
        let session = format!("/lab-sessions/{}", session["id"].as_str().unwrap());
        for walk in 1..=2 {
            service.post(&format!("/api/v1{session}/walks"), &json!({"walk": walk})).await;
        }
        Self { service, session, _folder: folder }
    }

    /// Uploads a file through REST.
    async fn upload(&self, kind: &str, body: &Value) -> Answer {
        self.service.post(&format!("/api/v1{}/measurement-files/{kind}", self.session), body).await
    }

    /// Submits a form.
    async fn submit(&self, kind: &str, fields: &[(&str, &str)]) -> Answer {
        let fields = fields.iter().map(|(name, value)| format!("{name}={}", encoded(value)));
        let body = fields.collect::<Vec<_>>().join("&");
        self.service.post_text(&format!("{}/measurement-files/{kind}", self.session), FORM, &body).await
    }

    async fn files(&self) -> Value {
        self.service.fetch(&format!("/api/v1{}/measurement-files", self.session)).await.items()
    }

    async fn page(&self) -> String {
        self.service.fetch(&self.session).await.text
    }
}

/// A text in a submitted form.
fn encoded(text: &str) -> String {
    text.bytes().fold(String::with_capacity(text.len()), |mut encoded, byte| {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'.' | b'-' | b'_' => encoded.push(char::from(byte)),
            other => write!(encoded, "%{other:02X}").unwrap(),
        }
        encoded
    })
}

/// The place of the largest value.
fn peak(channel: &Value) -> usize {
    let mean: Vec<f64> = channel["mean"].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
    (0..mean.len()).max_by(|a, b| mean[*a].total_cmp(&mean[*b])).unwrap()
}

#[tokio::test]
async fn left_channels_are_cut_at_left_heel_strikes() {
    let visit = Visit::begin().await;
    let results = async || {
        let result = visit.service.post(&format!("/api/v1{}/emg-results", visit.session), &json!({})).await.json();
        result["result"]["walks"][0]["channels"].as_array().unwrap().clone()
    };
    let with = |reading: Value| json!({"walk": 1, "recording": electromyogram(1.0), "reading": reading});
    // The switch closes at 0.4 s, 1.5 s, ...; the left tibialis anterior is most active 0.925 s after the start.
    visit.upload("emg", &with(json!({"heel_strike_column": "heel"}))).await;
    let assumed = results().await;
    let begins: Vec<&str> = assumed.iter().map(|channel| channel["begins_at"].as_str().unwrap()).collect();
    let (left, right) = ("assumed_left_heel_strike", "right_heel_strike");
    assert_eq!(begins, [left, left, left, left, right, right]);
    assert!((97..=99).contains(&peak(&assumed[1])), "0.925 s is 98 % after 0.95 s: {}", peak(&assumed[1]));
    let page = visit.page().await;
    assert!(page.contains("Left heel strikes were not recorded (without the device)"), "{page}");
    assert!(
        page.contains("gait cycle from left heel strike, %") && page.contains("gait cycle from right heel strike, %")
    );

    let given = json!({"heel_strike_column": "heel", "left_heel_strikes_s": [0.65, 1.75, 2.85, 3.95, 5.05]});
    let kept = visit.upload("emg", &with(given)).await;
    assert_eq!(kept.status, StatusCode::CREATED, "{}", kept.text);
    let recorded = results().await;
    assert_eq!((recorded[1]["begins_at"].as_str(), &recorded[1]["strides"]), (Some("left_heel_strike"), &json!(4)));
    assert!((24..=26).contains(&peak(&recorded[1])), "0.925 s is 25 % after 0.65 s: {}", peak(&recorded[1]));
    assert_eq!(recorded[4], assumed[4], "a muscle of the right leg");
    assert!(!visit.page().await.contains("Left heel strikes were not recorded"));

    for (reading, expected) in [
        (
            json!({"heel_strike_column": "heel", "left_heel_strike_column": "heel"}),
            "another column than that of the right",
        ),
        (json!({"heel_strike_column": "heel", "left_heel_strikes_s": [0.5]}), "at least two heel-strike times"),
        (json!({"heel_strike_column": "heel", "left_heel_strikes_s": [0.5, 99]}), "left_heel_strikes_s is 99"),
        (json!({"heel_strike_column": "heel", "left_heel_strike_column": "x"}), "column \"x\" is missing"),
    ] {
        let refused = visit.upload("emg", &with(reading)).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", refused.text);
        assert!(refused.json()["detail"].as_str().unwrap().contains(expected), "{expected}: {}", refused.text);
    }
    visit.service.stop().await;
}

#[tokio::test]
async fn emg_form_shows_signals_then_muscles_then_strides_and_stores_only_the_upload() {
    let visit = Visit::begin().await;
    let file = electromyogram(1.0).replace("RF_L", "EMG 1").replace("TA_L", "Left tib ant");
    let charts = |answer: &Answer| answer.text.matches("<svg class=\"chart\"").count();
    let common = [("walk", "1"), ("format", "csv"), ("recording", file.as_str()), ("file_name", "visit 1.csv")];
    let send = async |rest: &[(&str, &str)]| visit.submit("emg", &[&common[..], rest].concat()).await;

    // Every column, under its own name, with the strikes of the switch.
    let signals = send(&[("button", "signals")]).await;
    assert_eq!(signals.status, StatusCode::OK, "{}", signals.text);
    for says in [
        "<strong>visit 1.csv</strong>, 7 columns, 6.0 s at 1000 Hz",
        "6 right heel strikes from column heel, above 0.5. This column looks like heel strikes",
        "Left heel strikes are taken to be half a stride after the right ones.",
        "<h3>EMG 1</h3>",
        "<option selected>heel</option>",
        "contact threshold",
    ] {
        assert!(signals.text.contains(says), "{says}: {}", signals.text);
    }
    assert_eq!(charts(&signals), 7);
    assert!(!signals.text.contains("not measured"), "no muscle is asked for yet");

    let strikes = [("heel_strike_column", "heel"), ("heel_strike_threshold", "0.5")];
    let muscles = send(&[&strikes[..], &[("button", "muscles")]].concat()).await;
    assert!(muscles.text.contains("<option selected>Left tib ant</option>"), "{}", muscles.text);
    assert_eq!((charts(&muscles), muscles.text.matches("not measured").count()), (7, 6));

    let columns = [("column_RF_L", "EMG 1"), ("column_TA_L", "Left tib ant"), ("column_BF_R", "BF_R")];
    let preview = [&strikes[..], &columns, &[("rejected_strides", "2"), ("button", "preview")]].concat();
    let strides = send(&preview).await;
    assert!(strides.text.contains("The recording can be uploaded: visit 1.csv."), "{}", strides.text);
    assert!(strides.text.contains("<td>rejected</td>") && strides.text.contains("mean activity over the gait cycle"));
    assert_eq!(charts(&strides), 6, "three muscles over time, and over the cycle");
    assert_eq!(visit.files().await, json!([]), "nothing was uploaded");

    // A refused upload stays at its step, with everything that was typed.
    let beyond = [&strikes[..], &columns, &[("rejected_strides", "9"), ("button", "upload")]].concat();
    let refused = send(&beyond).await;
    assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", refused.text);
    assert!(refused.text.contains("value=\"9\"") && refused.text.contains("<option selected>EMG 1</option>"));
    assert!(refused.text.contains("<strong>visit 1.csv</strong>"), "{}", refused.text);

    let uploaded = send(&[&strikes[..], &columns, &[("rejected_strides", "2"), ("button", "upload")]].concat()).await;
    assert_eq!(uploaded.status, StatusCode::SEE_OTHER, "{}", uploaded.text);
    assert_eq!(visit.files().await[0]["file_name"], "visit 1.csv");
    visit.service.stop().await;
}

#[tokio::test]
async fn first_step_without_heel_strikes_says_so_and_keeps_entries_of_later_steps() {
    let visit = Visit::begin().await;
    let file: String =
        electromyogram(1.0).lines().map(|line| line.rsplit_once(',').unwrap().0.to_owned() + "\n").collect();
    let typed = [("rejected_strides", "3"), ("column_RF_L", "TA_L"), ("button", "signals")];
    let fields = [&[("walk", "1"), ("format", "csv"), ("recording", file.as_str())][..], &typed].concat();
    let signals = visit.submit("emg", &fields).await;
    assert_eq!(signals.status, StatusCode::OK, "{}", signals.text);
    assert!(signals.text.contains("Heel strikes are unknown"), "{}", signals.text);
    assert!(signals.text.contains("<input type=\"hidden\" name=\"rejected_strides\" value=\"3\">"));
    assert!(signals.text.contains("<input type=\"hidden\" name=\"column_RF_L\" value=\"TA_L\">"));

    // A refused entry can be corrected even if the file cannot be read.
    let typed = [("rejected_strides", "two"), ("recording", "time_s,a\n0,x"), ("button", "upload")];
    let refused = visit.submit("emg", &[&[("walk", "1"), ("format", "csv")][..], &typed].concat()).await;
    assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", refused.text);
    assert!(refused.text.contains("name=\"rejected_strides\" value=\"two\" aria-invalid"), "{}", refused.text);
    assert!(refused.text.contains("line 2, column 2"), "{}", refused.text);
    visit.service.stop().await;
}

/// The choice of columns for a file of [`laboratory_angles`].
const CHOSEN: [(&str, &str); 7] = [
    ("column_torso", "Trunk"),
    ("column_hip_L", "L Hip"),
    ("column_knee_L", "L Knee"),
    ("column_ankle_L", "L Ankle"),
    ("column_hip_R", "R Hip"),
    ("column_knee_R", "R Knee"),
    ("column_ankle_R", "R Ankle"),
];
const LEFT_ANKLE_REVERSED: [f64; 7] = [1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0];

#[tokio::test]
async fn joint_angles_with_other_names_are_uploaded_after_a_choice_of_columns() {
    let visit = Visit::begin().await;
    let file = laboratory_angles(LEFT_ANKLE_REVERSED);
    let common = [
        ("walk", "1"),
        ("format", "csv"),
        ("recording", file.as_str()),
        ("file_name", "visit 1.csv"),
        ("cutoff_hz", "6"),
    ];
    let send = async |rest: &[(&str, &str)]| visit.submit("joint-angles", &[&common[..], rest].concat()).await;

    let first = send(&[("button", "preview")]).await;
    assert_eq!(first.status, StatusCode::OK, "{}", first.text);
    for says in [
        "<option selected>L Ankle</option>",
        "<option value=\"degrees\" selected>",
        "The unit was taken from the size of the angles.",
        "The sign of one angle looks reversed.",
        "Left ankle moves opposite to normal walking. Is its sign reversed?",
        "gait cycle from left heel strike, %",
    ] {
        assert!(first.text.contains(says), "{says}: {}", first.text);
    }
    assert_eq!(first.text.matches("normal walking</span>").count(), 1, "one legend for every angle");
    let reversed = [("unit", "degrees"), ("reversed_ankle_L", "on")];
    let drawn = send(&[&CHOSEN[..], &reversed, &[("button", "columns")]].concat()).await;
    assert!(!drawn.text.contains("looks reversed") && !drawn.text.contains("can be uploaded"), "{}", drawn.text);
    assert!(drawn.text.contains("name=\"reversed_ankle_L\" value=\"on\" checked"), "{}", drawn.text);
    let strides = send(&[&CHOSEN[..], &reversed, &[("button", "preview")]].concat()).await;
    assert!(strides.text.contains("The recording can be uploaded: visit 1.csv."), "{}", strides.text);
    assert_eq!(visit.files().await, json!([]), "nothing was uploaded");

    // A reversed knee is an error of the file, which leaves the choice open.
    let knee = [("unit", "degrees"), ("reversed_knee_L", "on")];
    let refused = send(&[&CHOSEN[..], &knee, &[("button", "upload")]].concat()).await;
    assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", refused.text);
    assert!(refused.text.contains("check the sign of the knee angle"), "{}", refused.text);
    assert!(refused.text.contains("Left knee ranges from") && refused.text.contains("id=\"columns\""));
    let twice = send(&[("column_knee_L", "L Knee"), ("column_knee_R", "L Knee"), ("unit", "degrees")]).await;
    assert!(twice.text.contains("is chosen for both left knee and right knee"), "{}", twice.text);
    let unknown = send(&[("column_elbow", "L Knee")]).await;
    assert!(unknown.status.is_client_error() && unknown.text.contains("column_elbow"), "{}", unknown.text);

    let uploaded = send(&[&CHOSEN[..], &reversed, &[("button", "upload")]].concat()).await;
    assert_eq!(uploaded.status, StatusCode::SEE_OTHER, "{}", uploaded.text);

    // A script does the same with the object `columns`, and gets the same limit cycles.
    let of = |column: &str, reversed: bool| json!({"column": column, "reversed": reversed});
    let columns = json!({
        "torso": of("Trunk", false), "hip_L": of("L Hip", false), "knee_L": of("L Knee", false),
        "ankle_L": of("L Ankle", true), "hip_R": of("R Hip", false), "knee_R": of("R Knee", false),
        "ankle_R": of("R Ankle", false),
    });
    let with = |columns: &Value, unit: Value| {
        // Another file, because a file belongs to one walk.
        json!({"walk": 2, "recording": format!("# 2\n{file}"), "reading": {"columns": columns, "unit": unit}})
    };
    let kept = visit.upload("joint-angles", &with(&columns, json!("degrees"))).await;
    assert_eq!(kept.status, StatusCode::CREATED, "{}", kept.text);
    let cycles = visit.service.fetch(&format!("/api/v1{}/limit-cycles", visit.session)).await.items();
    assert_eq!(cycles[0]["joints"].as_array().unwrap().len(), 7);
    assert_eq!(cycles[0]["joints"], cycles[1]["joints"]);
    let reference = ReferenceGait::builtin().unwrap();
    let highest = |values: &[f64]| values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let knee: Vec<f64> = serde_json::from_value(cycles[0]["joints"][2]["angle_rad"].clone()).unwrap();
    let expected: Vec<f64> = reference.angles_rad.iter().map(|row| row[2]).collect();
    assert!((highest(&knee) - highest(&expected)).abs() < 0.02, "degrees were read as degrees");
    for (columns, unit, expected) in [
        (&columns, Value::Null, "Give the unit of the angles"),
        (&json!({"elbow": of("Trunk", false)}), json!("degrees"), "one of torso, hip_L"),
        (&json!({"torso": of("Head", false)}), json!("degrees"), "column \"Head\" is missing"),
    ] {
        let refused = visit.upload("joint-angles", &with(columns, unit)).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", refused.text);
        assert!(refused.json()["detail"].as_str().unwrap().contains(expected), "{expected}: {}", refused.text);
    }
    visit.service.stop().await;
}

#[tokio::test]
async fn reference_gait_with_other_names_is_imported_after_a_choice_of_columns() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let before = service.fetch("/api/v1/reference-gaits").await.items();
    let file = laboratory_angles(LEFT_ANKLE_REVERSED);
    let common = [
        ("name", "S03"),
        ("format", "csv"),
        ("strikes", "kinematics"),
        ("recording", file.as_str()),
        ("file_name", "S03.csv"),
    ];
    let chosen: Vec<(&str, &str)> = CHOSEN.into_iter().filter(|(name, _)| *name != "column_ankle_R").collect();
    let send = async |rest: &[(&str, &str)]| {
        let fields = [&common[..], rest].concat();
        let fields = fields.iter().map(|(name, value)| format!("{name}={}", encoded(value)));
        service.post_text("/reference-gaits", FORM, &fields.collect::<Vec<_>>().join("&")).await
    };
    let first = send(&[("button", "preview")]).await;
    assert_eq!(first.status, StatusCode::OK, "{}", first.text);
    assert!(first.text.contains("The sign of one angle looks reversed.") && !first.text.contains("Mean stride"));
    let incomplete = send(&[("column_torso", "Trunk"), ("unit", "degrees"), ("button", "preview")]).await;
    assert_eq!(incomplete.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", incomplete.text);
    assert!(incomplete.text.contains("Choose a column for each of these angles: left hip (hip_L), left knee"));
    assert!(incomplete.text.contains("id=\"columns\""), "{}", incomplete.text);
    let reversed = [("unit", "degrees"), ("reversed_ankle_L", "on")];
    let strides = send(&[&chosen[..], &reversed, &[("button", "preview")]].concat()).await;
    assert!(strides.text.contains("The recording can be imported: S03.csv."), "{}", strides.text);
    assert_eq!(service.fetch("/api/v1/reference-gaits").await.items(), before, "nothing was imported");
    let imported = send(&[&chosen[..], &reversed, &[("button", "import")]].concat()).await;
    assert_eq!(imported.status, StatusCode::SEE_OTHER, "{}", imported.text);
    let page = service.fetch(imported.headers["location"].to_str().unwrap()).await.text;
    assert!(page.contains("ankle_L = -L Ankle") && page.contains("angles in degrees"), "{page}");

    let of = |column: &str, reversed: bool| json!({"column": column, "reversed": reversed});
    let columns = json!({
        "torso": of("Trunk", false), "hip_L": of("L Hip", false), "knee_L": of("L Knee", false),
        "ankle_L": of("L Ankle", true), "hip_R": of("R Hip", false), "knee_R": of("R Knee", false),
    });
    let body = json!({"name": "S03", "format": "csv", "recording": file, "columns": columns, "unit": "degrees"});
    let same = service.post("/api/v1/reference-gaits", &body).await;
    assert_eq!(same.status, StatusCode::OK, "the same recording, read in the same way: {}", same.text);

    let c3d = [("name", "S03"), ("recording", "x"), ("file_name", "S03.C3D"), ("button", "import")];
    let fields = c3d.map(|(name, value)| format!("{name}={}", encoded(value))).join("&");
    let refused = service.post_text("/reference-gaits", FORM, &fields).await;
    assert!(refused.text.contains("C3D files are not read. Export the signals to CSV"), "{}", refused.text);
    service.stop().await;
}
