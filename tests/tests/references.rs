//! Reference gaits from recordings, through REST and pages.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright_store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::measured::four_strides;
use gaitwright_tests::service::Service;
use serde_json::{Value, json};
use std::fmt::Write;

fn recording() -> String {
    four_strides(100)
}

fn new(name: &str, height_m: f64) -> Value {
    json!({"name": name, "format": "csv", "recording": recording(), "height_m": height_m, "body_mass_kg": 66.0})
}

async fn service() -> (tempfile::TempDir, Service) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    (folder, service)
}

#[tokio::test]
async fn gait_rmse_is_not_compared_between_studies_with_different_reference_gaits() {
    let (_folder, service) = service().await;
    let all = service.fetch("/api/v1/reference-gaits").await.items();
    let ids: Vec<gaitwright_store::ReferenceGaitId> =
        all.as_array().unwrap().iter().map(|one| one["id"].as_str().unwrap().parse().unwrap()).collect();
    assert_eq!(all[0]["name"], "Falisse 2019, subject 1");
    assert_eq!(all[1]["name"], "Fukuchi 2018, median of 24 adults");
    let mut studies = Vec::new();
    for reference in [ids[0], ids[0], ids[1]] {
        let study = service.study(|new| (new.reference_gait_id, new.number_of_trials) = (Some(reference), 2)).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        studies.push(study);
    }
    let warning = "The studies have different reference gaits";
    for (other, comparable) in [(1, true), (2, false)] {
        let (a, b) = (studies[0], studies[other]);
        let rows = service.fetch(&format!("/api/v1/study-comparison?ids={a},{b}")).await.items();
        for row in rows.as_array().unwrap() {
            assert_eq!(row["best_gait_rmse_rad"].is_number(), comparable, "{row}");
            assert!(row["best_cost_of_transport"].is_number() && row["reference_gait_id"].is_string(), "{row}");
        }
        let page = service.fetch(&format!("/studies/compare?study={a}&study={b}")).await.text;
        assert_eq!(page.contains("Gait RMSE of the recommended trial"), comparable);
        assert_eq!(page.contains("Gait RMSE of the best action by iteration</h3>"), comparable);
        assert_eq!(page.contains(warning), !comparable);
        let figures = service.fetch(&format!("/studies/{a}/figures?other={b}")).await.text;
        assert_eq!(figures.contains(warning), !comparable);
    }
}

#[tokio::test]
async fn imported_recording_becomes_the_reference_of_a_study() {
    let (_folder, service) = service().await;
    let far = service.post("/api/v1/reference-gaits", &new("far", 2.0)).await;
    assert_eq!(far.status, StatusCode::CREATED, "{}", far.text);
    let near = service.post("/api/v1/reference-gaits", &new("near", 1.72)).await.json();
    let definition = &near["definition"];
    assert_eq!(definition["angles_rad"].as_array().unwrap().len(), 101);
    assert!(definition["provenance"].as_str().unwrap().contains("mean of 2 strides"), "{definition}");
    assert!(definition["standard_deviation_rad"].is_array());
    // The very same recording is the same reference gait.
    assert_eq!(service.post("/api/v1/reference-gaits", &new("near", 1.72)).await.json()["id"], near["id"]);

    let subject = service.subject().await;
    let matches = service.fetch(&format!("/api/v1/subjects/{subject}/reference-gaits")).await.items();
    let names: Vec<_> =
        matches.as_array().unwrap().iter().map(|m| m["reference_gait"]["name"].as_str().unwrap()).collect();
    assert_eq!(names[..2], ["near", "far"]);
    assert!(matches[0]["distance"].as_f64().unwrap() < 0.2 && matches[2]["distance"].is_null(), "{matches}");

    let id: gaitwright_store::ReferenceGaitId = near["id"].as_str().unwrap().parse().unwrap();
    let study = service.study(|new| (new.reference_gait_id, new.number_of_trials) = (Some(id), 1)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = service.trials(study).await.remove(0).id;
    let page = service.fetch(&format!("/trials/{trial}")).await.text;
    assert!(page.contains(&format!("<a href=\"/reference-gaits/{id}\">near</a>")), "{page}");

    let list = service.fetch(&format!("/reference-gaits?subject={subject}")).await.text;
    assert!(list.find(">near</a>").unwrap() < list.find(">far</a>").unwrap());
    let page = service.fetch(&format!("/reference-gaits/{id}")).await.text;
    assert!(
        page.contains("</i>right leg") && page.contains("</i>one standard deviation") && page.contains("<svg"),
        "{page}"
    );
    let audit = service.fetch("/api/v1/audit").await.text;
    assert_eq!(audit.matches("reference_gait.import").count(), 2, "{audit}");
    service.stop().await;
}

#[tokio::test]
async fn incomplete_archive_is_refused_with_the_place() {
    let (_folder, service) = service().await;
    let before = service.fetch("/api/v1/reference-gaits").await.items();
    let text = recording();
    let (half, _) = text.split_at(text.find("\n1,0.1,").unwrap() + 12);
    for (change, expected) in [
        (json!({"recording": half}), "recording, line 102"),
        (json!({"recording": text.replace("\n1.5,0.1,", "\n1.5,x,")}), "recording, line 152"),
        (json!({"recording": text.replace("hip_R_rad", "hip_rad")}), "hip_R_rad"),
        (json!({"format": "opensim"}), "endheader"),
        (json!({"strikes": "force"}), "the recording has no force under the right foot"),
        (json!({"heel_strikes_s": [0.5, 99.0]}), "heel_strikes_s is 99;"),
        (json!({"height_m": 17.2}), "height_m is 17.2; it must be 1.4 to 2.2."),
        (json!({"recording": format!("# {}\n{text}", "x".repeat(30_000))}), "at most 20000 bytes of comments"),
        (json!({"name": " "}), "1 to 200 printable characters"),
        (json!({"format": "c3d"}), "format"),
    ] {
        let mut body = new("x", 1.7);
        body.as_object_mut().unwrap().extend(change.as_object().unwrap().clone());
        let refused = service.post("/api/v1/reference-gaits", &body).await;
        assert!(refused.status.is_client_error(), "{change}: {}", refused.text);
        assert!(refused.text.contains(expected), "{expected}: {}", refused.text);
    }
    assert_eq!(service.fetch("/api/v1/reference-gaits").await.items(), before);
    service.stop().await;
}

#[tokio::test]
async fn preview_shows_strikes_and_strides_of_a_recording_and_stores_nothing() {
    let (_folder, service) = service().await;
    let before = service.fetch("/api/v1/reference-gaits").await.items();
    let kind = "application/x-www-form-urlencoded";
    let previewed = async |name: &str, strikes: &str, recording: &str| {
        let recording = recording.replace('\n', "%0D%0A").replace(',', "%2C");
        let form = format!(
            "button=preview&name={name}&format=csv&strikes=kinematics&heel_strikes_s={strikes}&recording={recording}"
        );
        service.post_text("/reference-gaits", kind, &form).await
    };
    let found = previewed("S03", "", &recording()).await;
    assert_eq!(found.status, StatusCode::OK, "{}", found.text);
    assert!(
        found.text.contains("The recording can be imported, but look at it first.")
            && found.text.contains("Mean stride"),
        "{}",
        found.text
    );
    assert!(found.text.contains("right heel strike") && found.text.contains("<td>used</td>"), "{}", found.text);
    // The second stride is too short, and the name is missing.
    let left_out = previewed("", "1,2.1,2.3,3.4", &recording()).await;
    assert_eq!(left_out.text.matches("<td>used</td>").count(), 2, "{}", left_out.text);
    assert_eq!(left_out.text.matches("left out: too short, too long, or with a gap").count(), 1);
    assert!(left_out.text.contains("Not ready for import") && !left_out.text.contains("Mean stride"));
    let unreadable = previewed("S03", "", "time_s\nx").await;
    assert_eq!(unreadable.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", unreadable.text);
    assert_eq!(service.fetch("/api/v1/reference-gaits").await.items(), before);
}

#[tokio::test]
async fn import_form_imports_and_keeps_the_input_after_an_error() {
    let (_folder, service) = service().await;
    let kind = "application/x-www-form-urlencoded";
    let form = |recording: &str, height: &str| {
        let recording = recording.replace('\n', "%0D%0A").replace(',', "%2C");
        format!("name=S03%2C+level&format=csv&strikes=kinematics&height_m={height}&body_mass_kg=&recording={recording}")
    };
    let refused = service.post_text("/reference-gaits", kind, &form(&recording(), "tall")).await;
    assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", refused.text);
    assert!(refused.text.contains("height_m: &#34;tall&#34;") || refused.text.contains("tall"), "{}", refused.text);
    assert!(refused.text.contains("value=\"S03, level\"") && refused.text.contains("0.050000,0.6"), "as it was typed");
    let imported = service.post_text("/reference-gaits", kind, &form(&recording(), "")).await;
    assert_eq!(imported.status, StatusCode::SEE_OTHER, "{}", imported.text);
    let page = service.fetch(imported.headers["location"].to_str().unwrap()).await;
    assert!(page.status == StatusCode::OK && page.text.contains("S03, level"), "{}", page.text);
    // Forces in a separate file. If the form is refused, it keeps both files.
    let mut forces = "forces\nnRows=9001\nnColumns=2\nendheader\ntime\tground_force_vy\n".to_owned();
    for k in 0..9001 {
        let force = if k % 1000 < 600 { 700 } else { 0 };
        writeln!(forces, "{:.3}\t{force}", f64::from(k) / 1000.0).unwrap();
    }
    let encoded = |text: &str| text.replace('\n', "%0D%0A").replace('\t', "%09");
    let with = |forces: &str| form(&recording(), "").replace("kinematics", "force") + "&forces=" + &encoded(forces);
    let refused = service.post_text("/reference-gaits", kind, &with("not a file")).await;
    assert!(
        refused.text.contains("Contents of the force file, line 1: the line &#34;endheader&#34; is missing"),
        "{}",
        refused.text
    );
    assert!(refused.text.contains(">not a file</textarea>") && refused.text.contains("<details open>"), "as typed");
    let imported = service.post_text("/reference-gaits", kind, &with(&forces)).await;
    assert_eq!(imported.status, StatusCode::SEE_OTHER, "{}", imported.text);
    let page = service.fetch(imported.headers["location"].to_str().unwrap()).await.text;
    assert!(
        page.contains("ground_force_vy is the force under the right foot")
            && page.contains("heel strikes detected from the vertical force")
    );
    // More than the usual limit of a body is accepted here, and only here.
    let mut body = new("long", 1.7);
    body["recording"] = json!(four_strides(10_000));
    assert_eq!(service.post("/api/v1/reference-gaits", &body).await.status, StatusCode::CREATED);
    assert_eq!(service.post("/api/v1/subjects", &body).await.status, StatusCode::PAYLOAD_TOO_LARGE);
    service.stop().await;
}

/// Angles between the rows of a table, linearly; `column` of its header.
fn between(rows: &[Vec<f64>], column: usize, time: f64) -> f64 {
    let after = rows.partition_point(|row| row[0] < time).clamp(1, rows.len() - 1);
    let (a, b) = (&rows[after - 1], &rows[after]);
    a[column] + (time - a[0]) / (b[0] - a[0]) * (b[column] - a[column])
}

#[tokio::test]
async fn exported_gait_table_is_imported_as_the_same_curves() {
    let (_folder, service) = service().await;
    let study = service.study(|new| new.number_of_trials = 1).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = service.trials(study).await.remove(0).id;
    let table = service.fetch(&format!("/api/v1/trials/{trial}/gait.csv")).await.text;
    let names: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    let mut rows: Vec<Vec<f64>> =
        table.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().unwrap_or(0.0)).collect()).collect();
    rows.dedup_by_key(|row| row[0].to_bits());
    let end = rows.last().unwrap()[0];
    let body = json!({"name": "our own", "format": "csv", "recording": table, "strikes": "ends"});
    let imported = service.post("/api/v1/reference-gaits", &body).await;
    assert_eq!(imported.status, StatusCode::CREATED, "{}", imported.text);
    let angles = imported.json()["definition"]["angles_rad"].clone();
    for (place, name) in ["torso_rad", "hip_L_rad", "knee_L_rad", "ankle_L_rad", "hip_R_rad"].into_iter().enumerate() {
        let column = names.iter().position(|known| *known == name).unwrap();
        for percent in 0..=100 {
            let found = angles[percent][place].as_f64().unwrap();
            let wanted = between(&rows, column, end * percent as f64 / 100.0);
            assert!((found - wanted).abs() < 1e-12, "{name} at {percent} %: {found} {wanted}");
        }
    }
    // Times must increase even at a change of domain, and errors have the right column number.
    let line = table.lines().nth(12).unwrap();
    let word = body_with(&body, &table.replacen(line, &line.replacen(",DS3_R,", ",DS3_R,x", 1), 1));
    let refused = service.post("/api/v1/reference-gaits", &word).await;
    assert!(refused.text.contains("recording, line 13, column 3: px_m is "), "{}", refused.text);
    service.stop().await;
}

fn body_with(body: &Value, recording: &str) -> Value {
    let mut body = body.clone();
    body["recording"] = json!(recording);
    body
}

#[tokio::test]
async fn import_does_not_change_the_reference_gait_of_new_studies() {
    let (_folder, service) = service().await;
    let near = service.post("/api/v1/reference-gaits", &new("near", 1.72)).await.json();
    let far = service.post("/api/v1/reference-gaits", &new("far", 2.0)).await.json();
    let form = "muscles=on&answer_source=gait_rmse&number_of_trials=1&parallel_trials=1&seed=1&tuned_a5=on";
    let kind = "application/x-www-form-urlencoded";
    let known = format!("{form}&subject={}&reference_gait=", service.subject().await);
    let tall = format!("{form}&subject=new&pseudonym=S09&height_m=1.98&body_mass_kg=66&reference_gait=");
    for (body, nearest, is_chosen) in [
        (known.clone(), &near, false),
        (tall.clone(), &far, false),
        (format!("{tall}{}", text(&near["id"])), &far, false),
        (format!("{tall}{}", text(&far["id"])), &far, true),
    ] {
        let checked = service.post_text("/studies/new/check", kind, &body).await.json();
        let shown = text(&checked["reference"]);
        let name = text(&nearest["name"]);
        let expected = if is_chosen {
            format!("The chosen reference gait, {name}, is the nearest")
        } else {
            format!("{name} (distance")
        };
        assert!(shown.contains(&expected), "{expected}: {checked}");
        let is_measured = body.ends_with(text(&near["id"]));
        let chosen = match (is_chosen, is_measured) {
            (true, _) => "",
            (false, true) => {
                "is the nearest to the subject in height and body mass. The distance of the chosen reference gait is 2."
            }
            (false, false) => {
                "is the nearest to the subject in height and body mass. The distance of the chosen reference gait is unknown."
            }
        };
        assert_eq!(shown.contains("the chosen reference gait"), !is_chosen, "{checked}");
        assert!(shown.contains(chosen), "{chosen}: {checked}");
    }
    let default = service.study(|_| ()).await;
    let default = service.get(default).await.plan.reference_gait_id;
    let made = service.post_text("/studies/new", kind, &tall).await;
    let study = made.headers["location"].to_str().unwrap().rsplit('/').next().unwrap().parse().unwrap();
    assert_eq!(service.get(study).await.plan.reference_gait_id, default, "the built-in one");
    service.stop().await;
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap()
}
