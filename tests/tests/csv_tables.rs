//! CSV files: no cell begins a formula, and the history has a row for each iteration.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_learner::{Dimension, SearchSpace};
use gaitwright_service::studies::atlas;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::json;
use std::collections::BTreeSet;

const FORMULA: &str = "=HYPERLINK(\"http://x\",\"y\")";

/// The cells of a CSV file.
fn cells(text: &str) -> Vec<Vec<String>> {
    let mut rows = vec![vec![String::new()]];
    let mut quoted = false;
    for c in text.chars() {
        let cell = rows.last_mut().unwrap().last_mut().unwrap();
        match c {
            '"' => {
                // A doubled quote closes and opens again, and stands for itself.
                if !quoted && cell.ends_with('\u{0}') {
                    cell.pop();
                    cell.push('"');
                } else if quoted {
                    cell.push('\u{0}');
                }
                quoted = !quoted;
            }
            ',' if !quoted => rows.last_mut().unwrap().push(String::new()),
            '\n' if !quoted => rows.push(vec![String::new()]),
            c => cell.push(c),
        }
    }
    rows.iter_mut().flatten().for_each(|cell| *cell = cell.replace('\u{0}', ""));
    rows
}

fn begins_formula(cell: &str) -> bool {
    cell.parse::<f64>().is_err() && cell.starts_with(['=', '+', '-', '@', '\t', '\r', '\n'])
}

#[tokio::test]
async fn csv_endpoints_return_no_formulas() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (6, AnswerSource::Both)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let heights = Dimension { name: "a5".to_owned(), values: vec![0.0, 0.013, 0.026], lengthscale: 0.013 };
    let space = SearchSpace::new(vec![heights]).unwrap();
    let atlas = service.study(|new| {
        new.search_space = Some(space.into());
        *new = atlas::atlas_of(new.clone());
    });
    let atlas = atlas.await;
    service.wait_for(atlas, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let good: Vec<_> = trials.iter().filter(|t| t.state.as_str() == "converged").map(|t| t.id).collect();
    let mut given = Vec::new();
    for (pair, author) in [((0, 1), "+1+1"), ((1, 2), "@SUM(1)"), ((2, 0), "-2+3")] {
        let said =
            json!({"trial_a": good[pair.0], "trial_b": good[pair.1], "answer": "b", "author": author, "note": FORMULA});
        let done = service.post(&format!("/api/v1/studies/{study}/preferences"), &said).await;
        assert_eq!(done.status, StatusCode::CREATED, "{}", done.text);
        given.push(done.json()["id"].as_str().unwrap().to_owned());
    }
    let retract = format!("/api/v1/preferences/{}/retract", given[0]);
    service.post(&retract, &json!({"reason": FORMULA})).await;
    // Text that no entry point accepts may still be in the record, from a worker or an archive.
    let mut writer = service.store.write().await.unwrap();
    sqlx::query("update trials set message = ? where state not in ('converged', 'not_converged')")
        .bind(FORMULA)
        .execute(&mut **writer)
        .await
        .unwrap();
    gaitwright_store::commit(writer).await.unwrap();

    let description = service.fetch("/api/openapi.json").await.json();
    let mut asked = BTreeSet::new();
    for (path, operations) in description["paths"].as_object().unwrap() {
        let Some(content) = operations["get"]["responses"]["200"]["content"].as_object() else { continue };
        // A measurement file is given out byte for byte as it was uploaded.
        if !content.contains_key("text/csv") || path == "/api/v1/measurement-files/{id}/content" {
            continue;
        }
        let id = if path.contains("/trials/{id}") {
            good[0].to_string()
        } else if path.ends_with("/atlas.csv") {
            atlas.to_string()
        } else {
            study.to_string()
        };
        let path = path.replace("{id}", &id);
        let addresses: Vec<String> = if path.contains("{file}") {
            let page = match path.split("/figures").next().unwrap().rsplit('/').nth(1) {
                Some("trials") => format!("/trials/{}", good[0]),
                Some("studies") => format!("/studies/{study}"),
                _ => continue,
            };
            let text = service.fetch(&page).await.text;
            let links =
                text.split('"').filter(|link| link.starts_with("/api/") && link.rsplit('.').next() == Some("csv"));
            links.map(str::to_owned).collect()
        } else {
            vec![path]
        };
        for address in addresses {
            let answer = service.fetch(&address).await;
            assert_eq!(answer.status, StatusCode::OK, "{address}: {}", answer.text);
            assert!(answer.content_type().starts_with("text/csv"), "{address}: {}", answer.content_type());
            let rows = cells(&answer.text);
            assert!(rows.len() > 2, "{address}");
            for cell in rows.iter().flatten() {
                assert!(!begins_formula(cell), "{address}: {cell:?}");
            }
            asked.insert(address);
        }
    }
    assert!(asked.len() >= 8, "{asked:?}");
    let csv = service.fetch(&format!("/api/v1/studies/{study}/preferences")).await.items();
    assert!(csv.as_array().unwrap().iter().any(|row| row["note"] == FORMULA), "JSON keeps it as it was");
    let csv = service.fetch(&format!("/api/v1/studies/{study}/preferences.csv")).await.text;
    for text in [format!("'{FORMULA}"), "'+1+1".to_owned(), "'@SUM(1)".to_owned(), "'-2+3".to_owned()] {
        assert!(cells(&csv).iter().flatten().any(|cell| *cell == text), "{text}: {csv}");
    }
    service.stop().await;
}

#[tokio::test]
async fn history_has_a_row_for_each_iteration_of_parallel_trials() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 3).await;
    let study = service.study(|new| (new.number_of_trials, new.parallel_trials) = (14, 3)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let text = service.fetch(&format!("/api/v1/studies/{study}/history.csv")).await.text;
    let iterations: Vec<u32> =
        text.lines().skip(1).map(|line| line.split(',').next().unwrap().parse().unwrap()).collect();
    let expected: Vec<u32> = (iterations[0]..=14).collect();
    assert_eq!(iterations, expected, "{text}");
    service.stop().await;
}
