//! Figures as files: every figure that a page links exists in each format, is self-contained, and has its data.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Request, StatusCode};
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::TrialState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::measured::{electromyogram, four_strides, joint_angles};
use gaitwright_tests::service::Service;
use http_body_util::BodyExt;
use serde_json::json;
use tower::ServiceExt;

/// A downloaded file: media type and bytes.
async fn file(service: &Service, path: &str) -> (String, Vec<u8>) {
    let request = Request::get(path).body(Body::empty()).unwrap();
    let answer = service.router().oneshot(request).await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK, "{path}");
    let kind = answer.headers()["content-type"].to_str().unwrap().to_owned();
    let name = answer.headers()["content-disposition"].to_str().unwrap().to_owned();
    let ending = path.split('?').next().unwrap().rsplit('/').next().unwrap();
    assert!(name.contains(ending), "{name} {ending}");
    (kind, answer.into_body().collect().await.unwrap().to_bytes().to_vec())
}

/// The addresses of files with this ending in a page.
fn linked(page: &str, ending: &str) -> Vec<String> {
    let addresses = page.split("href=\"").skip(1).map(|rest| rest.split('"').next().unwrap().replace("&#38;", "&"));
    addresses.filter(|address| address.contains("/figures/") && address.contains(ending)).collect()
}

#[tokio::test]
async fn every_figure_of_a_page_is_served_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let mut studies = Vec::new();
    for muscles in [true, false] {
        let study = service.study(|new| (new.number_of_trials, new.muscles) = (6, muscles)).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        studies.push(study);
    }
    let trials = service.trials(studies[0]).await;
    let gaits: Vec<_> = trials.iter().filter(|trial| trial.state == TrialState::Converged).collect();
    let pair = json!({"trial_a": gaits[0].id, "trial_b": gaits[1].id});
    let session = service.post(&format!("/api/v1/studies/{}/lab-sessions", studies[0]), &pair).await.json();
    let session = session["id"].as_str().unwrap();
    service.post(&format!("/api/v1/lab-sessions/{session}/walks"), &json!({"walk": 1})).await;
    let emg = json!({"walk": 1, "recording": electromyogram(1.0), "reading": {"heel_strike_column": "heel"}});
    let api = format!("/api/v1/lab-sessions/{session}");
    for (what, body) in [
        ("measurement-files/emg", emg),
        ("emg-results", json!({})),
        ("measurement-files/joint-angles", json!({"walk": 1, "recording": joint_angles()})),
    ] {
        let done = service.post(&format!("{api}/{what}"), &body).await;
        assert!(done.status.is_success(), "{}", done.text);
    }
    for (page, least) in [
        (format!("/studies/{}", studies[0]), 1 + 1),
        (format!("/studies/{}/compare?a={}&b={}", studies[0], gaits[0].id, gaits[1].id), 7),
        (format!("/studies/compare?study={}&study={}", studies[0], studies[1]), 1),
        (format!("/studies/{}/figures?other={}", studies[0], studies[1]), 1 + 7 + 2 + 7),
        (format!("/trials/{}", gaits[0].id), 1 + 1 + 4 + 2 + 3 + 3 + 7 + 7 + 7 + 3 + 2 + 4 + 1),
        (format!("/lab-sessions/{session}"), 6 + 2),
        (format!("/studies/{}/analysis?x=a5&y=a6", studies[0]), 8 + 1 + 2 + 2 + 1),
        (format!("/reference-gaits/{}", service.reference().await), 4),
    ] {
        let shown = service.fetch(&page).await;
        assert_eq!(shown.status, StatusCode::OK, "{}", shown.text);
        let drawings = linked(&shown.text, ".svg");
        let mut names = drawings.clone();
        names.sort();
        names.dedup();
        assert_eq!((names.len(), drawings.len()), (least, least), "{page}: {drawings:?}");
        for address in &drawings {
            let (kind, svg) = file(&service, address).await;
            let svg = String::from_utf8(svg).unwrap();
            assert!(kind == "image/svg+xml" && svg.starts_with("<svg xmlns="), "{address}");
            assert!(!svg.contains("var(--") && !svg.contains("href"), "{address}");
            let (kind, csv) = file(&service, &address.replace(".svg", ".csv")).await;
            assert!(kind.starts_with("text/csv") && String::from_utf8_lossy(&csv).lines().count() > 2, "{address}");
        }
        assert_eq!(linked(&shown.text, ".png").len(), least);
        let (kind, png) = file(&service, &drawings[0].replace(".svg", ".png")).await;
        assert!(kind == "image/png" && png.starts_with(b"\x89PNG") && png.len() > 5_000, "{}", png.len());
        if let Some(folder) = std::env::var_os("GAITWRIGHT_PICTURES") {
            for address in &drawings {
                let (_, png) = file(&service, &address.replace(".svg", ".png")).await;
                let name = address.split('?').next().unwrap().rsplit('/').next().unwrap().replace(".svg", ".png");
                std::fs::write(std::path::Path::new(&folder).join(name), png).unwrap();
            }
        }
    }
    let progress =
        format!("/api/v1/studies/{}/figures/progress-gait-rmse-of-the-best-action-by-iteration.csv", studies[0]);
    let (_, csv) = file(&service, &progress).await;
    let history = service.fetch(&format!("/api/v1/studies/{}/history", studies[0])).await.items();
    let csv = String::from_utf8(csv).unwrap();
    let milestones: Vec<_> =
        history.as_array().unwrap().iter().filter(|milestone| !milestone["gait_rmse_rad"].is_null()).collect();
    assert!(milestones.len() > 2, "{history}");
    for milestone in milestones {
        let row = format!(",{},{}\n", milestone["iteration"], milestone["gait_rmse_rad"]);
        assert!(csv.contains(&row), "{row} {csv}");
    }
    let recommended = format!("/api/v1/studies/{}/recommendation", studies[0]);
    let (best, bounds) = (service.fetch(&recommended).await.json(), service.fetch(&format!("{recommended}.csv")).await);
    let row = format!("a5,at least,{},m,swing-foot clearance,passed\n", best["bounds"]["a5"]);
    let header = "bound,side,value,unit,limits,certificate_of_the_gait\n";
    assert!(bounds.text.starts_with(header) && bounds.text.contains(&row), "{}", bounds.text);
    for unknown in ["nothing.svg", "progress.gif", "progress", "..%2Fa.svg"] {
        let path = format!("/api/v1/studies/{}/figures/{unknown}", studies[0]);
        assert_eq!(service.fetch(&path).await.status, StatusCode::NOT_FOUND, "{unknown}");
    }
    let nonsense = service.fetch(&format!("/studies/{}/figures?other=x", studies[0])).await;
    assert!(nonsense.status == StatusCode::UNPROCESSABLE_ENTITY && nonsense.text.contains("a study from the list"));
    service.stop().await;
}

#[tokio::test]
async fn reference_chart_has_a_deviation_band_or_states_that_it_has_none() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let recording = json!({"name": "S03, level", "format": "csv", "recording": four_strides(100)});
    let imported = service.post("/api/v1/reference-gaits", &recording).await;
    assert_eq!(imported.status, StatusCode::CREATED, "{}", imported.text);
    let deviation = imported.json()["definition"]["standard_deviation_rad"][50][3].as_f64().unwrap();
    let imported = imported.json()["id"].as_str().unwrap().parse().unwrap();
    let mut one_stride = recording;
    one_stride["heel_strikes_s"] = json!([1.1, 2.2]);
    let one_stride = service.post("/api/v1/reference-gaits", &one_stride).await.json();
    let one_stride = one_stride["id"].as_str().unwrap().parse().unwrap();
    for (reference, band) in [(one_stride, false), (imported, true)] {
        let study = service.study(|new| (new.number_of_trials, new.reference_gait_id) = (2, Some(reference))).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        let trial = service.trials(study).await.into_iter().find(|t| t.state == TrialState::Converged).unwrap().id;
        // All charts share one legend; the page of a gait and that of a reference gait have the left and the right leg in it.
        for (page, bands) in [
            (format!("/studies/{study}/figures"), 1),
            (format!("/trials/{trial}"), 2),
            (format!("/reference-gaits/{reference}"), 2),
        ] {
            let page = service.fetch(&page).await.text;
            assert_eq!(page.contains("The band shows one standard deviation on either side of the mean."), band);
            assert_eq!(page.contains("has no standard deviation, so there is no band"), !band);
            assert_eq!(page.matches("</i>one standard deviation").count(), if band { bands } else { 0 }, "{page}");
        }
        let ankle = linked(&service.fetch(&format!("/studies/{study}/figures")).await.text, "left-ankle.csv").remove(0);
        let (_, csv) = file(&service, &ankle).await;
        let csv = String::from_utf8(csv).unwrap();
        // Where the left foot strikes, half a stride after the right foot.
        let at_half: Vec<f64> = csv
            .lines()
            .filter_map(|line| line.strip_prefix("one standard deviation,0,"))
            .map(|cell| cell.parse().unwrap())
            .collect();
        assert_eq!(at_half.len(), if band { 2 } else { 0 }, "{csv}");
        if let [low, high] = at_half[..] {
            assert!((high - low - 2.0 * deviation.to_degrees()).abs() < 1e-6, "{low} {high} {deviation}");
        }
    }
    service.stop().await;
}

#[tokio::test]
async fn chart_of_a_running_solve_remains_after_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic::slow(std::time::Duration::from_millis(150));
    let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
    let study = service.study(|new| new.number_of_trials = 1).await;
    let page = format!("/studies/{study}");
    let mut drawings = Vec::new();
    while drawings.is_empty() {
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
        drawings = linked(
            &service.fetch(&page).await.text,
            "/solve-violation-dual-infeasibility-barrier-parameter-and-objective.csv",
        );
    }
    let rows = async |address: &str| String::from_utf8(file(&service, address).await.1).unwrap().lines().count();
    let running = rows(&drawings[0]).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let ended = rows(&drawings[0]).await;
    assert!(2 < running && running < ended, "{running} {ended}");
    service.stop().await;
}

#[tokio::test]
async fn up_to_three_other_gaits_are_laid_over_a_gait() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 24).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let gait = trials.iter().find(|trial| trial.state == TrialState::Converged).unwrap();
    let page = format!("/trials/{}", gait.id);
    let alone = service.fetch(&page).await.text;
    let offered: Vec<String> =
        alone.split("name=\"other\" value=\"").skip(1).map(|rest| rest.split('"').next().unwrap().to_owned()).collect();
    assert!(offered.len() > 3 && !offered.contains(&gait.id.to_string()), "{offered:?}");
    let number = |id: &str| trials.iter().find(|trial| trial.id.to_string() == id).unwrap().number;
    let numbers: Vec<u32> = offered[..3].iter().map(|id| number(id)).collect();

    // As the form sends the choice.
    let query = offered[..3].iter().map(|id| format!("other={id}")).collect::<Vec<_>>().join("&");
    let shown = service.fetch(&format!("{page}?{query}")).await;
    assert_eq!(shown.status, StatusCode::OK, "{}", shown.text);
    assert_eq!(shown.text.matches(" checked").count(), 3, "the choice is kept");
    let drawings = linked(&shown.text, ".svg");
    let overlaid: Vec<&String> = drawings.iter().filter(|address| address.contains("?other=")).collect();
    assert_eq!(overlaid.len(), 7 + 6 + 6, "angles, torques and powers of each joint of each leg: {drawings:?}");
    for address in &overlaid {
        let (_, csv) = file(&service, &address.replace(".svg", ".csv")).await;
        let csv = String::from_utf8(csv).unwrap();
        for number in numbers.iter().chain([&gait.number]) {
            assert!(csv.contains(&format!("\ntrial {number},")), "trial {number} in {address}: {csv}");
        }
    }
    let hip = drawings.iter().find(|address| address.contains("angles-left-hip")).unwrap();
    let (_, csv) = file(&service, &hip.replace(".svg", ".csv")).await;
    assert!(String::from_utf8(csv).unwrap().contains("\nreference,"), "the reference stays");

    // More gaits, the same gait, a trial of another study and one without a gait are refused.
    let query = offered[..4].iter().map(|id| format!("other={id}")).collect::<Vec<_>>().join("&");
    let refused = service.fetch(&format!("{page}?{query}")).await;
    assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY);
    let sentence = "At most 3 other gaits can be overlaid; 4 are chosen.";
    assert!(refused.text.contains(sentence) && refused.text.matches(" checked").count() == 4, "{}", refused.text);
    assert!(!linked(&refused.text, ".svg").iter().any(|address| address.contains("?other=")));
    let figure = format!("/api/v1/trials/{}/figures/angles-left-hip.csv", gait.id);
    let other = service.study(|new| new.number_of_trials = 2).await;
    service.wait_for(other, &[StudyState::Finished]).await;
    let elsewhere = service.trials(other).await[0].id.to_string();
    let without = trials.iter().find(|trial| trial.state == TrialState::NotConverged).unwrap().id.to_string();
    for (others, reason) in [
        (offered[..4].join(","), sentence),
        (gait.id.to_string(), "unlike trial"),
        (format!("{0},{0}", offered[0]), "unlike trial"),
        (elsewhere, "a trial of this study"),
        (without, "converged"),
        ("x".to_owned(), "other is"),
    ] {
        let refused = service.fetch(&format!("{figure}?other={others}")).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{others}: {}", refused.text);
        assert!(refused.text.contains(reason), "{reason}: {}", refused.text);
    }
    service.stop().await;
}
