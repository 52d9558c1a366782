//! Devices and muscle values, through pages and REST.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_optimizer::Device;
use gaitwright_store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::json;
use std::collections::BTreeMap;

const FORM: &str = "application/x-www-form-urlencoded";

async fn service() -> (tempfile::TempDir, Service) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    (folder, service)
}

/// The form of the built-in device, with changes.
fn form(changes: &[(&str, &str)]) -> String {
    let device = Device::ampro3().unwrap();
    let mut fields: BTreeMap<&str, String> =
        Device::FIELDS.iter().map(|field| (field.name, (field.value)(&device).to_string())).collect();
    fields.extend(changes.iter().map(|(name, value)| (*name, (*value).to_owned())));
    fields.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join("&")
}

#[tokio::test]
async fn device_is_copied_from_another_and_errors_appear_at_their_field() {
    let (_folder, service) = service().await;
    let before = service.fetch("/api/v1/devices").await.items();
    let path = format!("/devices/{}", before[0]["id"].as_str().unwrap());
    let page = service.fetch(&path).await.text;
    assert!(!page.contains(">shank_mass_kg<"), "{page}");
    assert!(page.contains("name=\"shank_mass_kg\"") && page.contains("0.2 to 15") && page.contains("prosthetic shank"));
    for (field, value, expected) in [
        ("shank_mass_kg", "99", "is \u{201c}99\u{201d}; it must be 0.2 to 15."),
        ("shank_length_m", "long", "it must be 0.2 to 0.6"),
        ("name", "", "1 to 80 printable characters"),
        ("colour", "red", "The form has no field colour."),
    ] {
        let changes = [("name", "light"), (field, value)];
        let refused = service.post_text(&path, FORM, &form(&changes)).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{field}");
        assert!(refused.text.contains(expected), "{expected}: {}", refused.text);
        if field != "colour" {
            let input = refused.text.split(&format!("name=\"{field}\"")).nth(1).unwrap().split('>').next().unwrap();
            assert!(input.contains(&format!("value=\"{value}\"")) && input.contains("aria-invalid"), "{input}");
        }
    }
    assert_eq!(service.fetch("/api/v1/devices").await.items(), before, "nothing was added");
    let made = service.post_text(&path, FORM, &form(&[("name", "light"), ("shank_mass_kg", "2.5")])).await;
    assert_eq!(made.status, StatusCode::SEE_OTHER, "{}", made.text);
    let location = made.headers["location"].to_str().unwrap();
    let added = service.fetch(&format!("/api/v1{location}")).await.json();
    let (new, old) = (&added["definition"], &before[0]["definition"]);
    assert_eq!(
        (&new["shank_mass_kg"], &new["carried_limb"], &new["name"]),
        (&json!(2.5), &json!(false), &json!("light"))
    );
    assert_eq!(
        (&new["foot_mass_kg"], &new["sources"]["foot_mass_kg"]),
        (&old["foot_mass_kg"], &old["sources"]["foot_mass_kg"])
    );
    assert!(new["sources"]["shank_mass_kg"].is_null() && !old["sources"]["shank_mass_kg"].is_null());
    assert!(service.fetch("/devices").await.text.contains(">light</a>"));
    service.stop().await;
}

#[tokio::test]
async fn new_studies_use_the_recorded_muscles_of_their_subject() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    let before = service.study(|new| new.number_of_trials = 1).await;
    service.wait_for(before, &[StudyState::Finished]).await;
    let (page, api) = (format!("/subjects/{subject}/muscles"), format!("/api/v1/subjects/{subject}/muscles"));
    for (typed, expected) in [
        ("sol_max_force_n=1", "\u{201c}soleus: maximum isometric force, N\u{201d} is 1; it must be 50 to 20000."),
        ("sol_max_force_n=much", "a number, or empty"),
        ("sol_knee_lever_m=0.05", "sol does not span the knee"),
        ("sol_colour=1", "The form has no field sol_colour."),
    ] {
        let refused = service.post_text(&page, FORM, typed).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{typed}");
        assert!(refused.text.contains(expected), "{expected}: {}", refused.text);
    }
    let refused = service.post_text(&page, FORM, "sol_max_force_n=1").await.text;
    let input = refused.split("name=\"sol_max_force_n\"").nth(1).unwrap().split('>').next().unwrap();
    assert!(input.contains("value=\"1\"") && input.contains("aria-invalid"), "{input}");
    assert_eq!(service.fetch(&api).await.json()["scaled_to_body"], false);

    let sent = service.post_text(&page, FORM, "scaled_to_body=on&sol_max_force_n=4200&ta_max_speed=").await;
    assert_eq!(sent.status, StatusCode::SEE_OTHER, "{}", sent.text);
    let muscles = service.fetch(&api).await.json();
    assert_eq!((&muscles["scaled_to_body"], &muscles["sol"]), (&json!(true), &json!({"max_force_n": 4200.0})));
    let shown = service.fetch(&page).await.text;
    assert!(shown.contains("value=\"4200\"") && shown.contains(" checked"), "{shown}");
    let after = service.study(|new| new.number_of_trials = 1).await;
    let of = async |study| service.get(study).await.plan.gait_settings.muscles;
    assert!(of(before).await.is_published());
    assert_eq!(of(after).await.sol.max_force_n, Some(4200.0));
    // A clone has the set-up of its parent, not values that were recorded later.
    let clone = service.post(&format!("/api/v1/studies/{before}/clone"), &json!({})).await.json();
    assert!(of(clone["id"].as_str().unwrap().parse().unwrap()).await.is_published());
    assert_eq!(service.put(&api, &json!({})).await.status, StatusCode::OK);
    let published = service.study(|new| new.number_of_trials = 1).await;
    assert!(of(published).await.is_published());
    service.stop().await;
}
