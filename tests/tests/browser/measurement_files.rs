//! Measurement files in the browser: every step from a dropped file to the stored one.

use crate::axe::Axe;
use crate::chromium::{Chromium, Tab};
use crate::site::Site;
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::TrialState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::measured::{electromyogram, laboratory_angles};
use serde_json::json;
use std::path::PathBuf;

/// The page of a lab session whose first walk is recorded.
async fn session_with_a_walk(site: &Site) -> String {
    let study = site.service.study(|new| new.number_of_trials = 12).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let trials = site.service.trials(study).await;
    let mut gaits = trials.iter().filter(|trial| trial.state == TrialState::Converged);
    let gaits = json!({"trial_a": gaits.next().unwrap().id, "trial_b": gaits.next().unwrap().id});
    let session = site.service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &gaits).await.json();
    let session = session["id"].as_str().unwrap();
    site.service.post(&format!("/api/v1/lab-sessions/{session}/walks"), &json!({"walk": 1})).await;
    site.at(&format!("/lab-sessions/{session}"))
}

/// Drops a file on the form whose address ends like this.
async fn drop_file(page: &Tab, form: &str, name: &str, text: &str) {
    page.run(&format!(
        "const moved = new DataTransfer(); moved.items.add(new File([{}], '{name}')); \
         document.querySelector('form[action$=\"{form}\"] .drop').dispatchEvent(new DragEvent('drop', {{ dataTransfer: moved, bubbles: true, cancelable: true }}))",
        json!(text)
    ))
    .await;
}

/// Checks that a step fits into every width and is accessible. Saves pictures of it if they are asked for.
async fn is_fit(page: &Tab, axe: Option<&Axe>, step: &str) {
    let pictures = std::env::var_os("GAITWRIGHT_PICTURES").map(PathBuf::from);
    for width in [1280, 768, 390] {
        page.resize(width, 900).await;
        assert_eq!(page.beyond().await, "0", "{step} at {width} px");
        if let Some(folder) = &pictures {
            page.picture(&folder.join(format!("{step}-{width}.png"))).await;
        }
    }
    page.resize(1280, 900).await;
    if let Some(axe) = axe {
        let complaints = axe.complaints(page).await;
        assert!(complaints.is_empty(), "{step}: {}", complaints.join("\n"));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_walks_through_the_steps_of_an_emg_recording_and_rejects_a_stride() {
    let Some(browser) = Chromium::launch().await else { return };
    let axe = Axe::find();
    let axe = axe.as_ref();
    let site = Site::start(Analytic::default()).await;
    let page = browser.open(&session_with_a_walk(&site).await).await;
    page.unfold().await;
    drop_file(&page, "emg", "walk 1.c3d", "x").await;
    let told = "document.querySelector('form[action$=emg] .drop [role=status]').innerText";
    page.wait_until(&format!("{told}.startsWith('C3D files are not read. Export the signals to CSV')")).await;
    assert_eq!(page.value("document.querySelector('#emg_recording').value").await, "", "the file is not read");
    // A file that is dropped fills in the text, its name and its format.
    page.run("document.querySelector('#emg_format').value = 'opensim'").await;
    let file = electromyogram(1.0).replace("RF_L", "EMG 1").replace("TA_L", "Left tib ant");
    drop_file(&page, "emg", "walk 1.csv", &file).await;
    page.wait_until("document.querySelector('#emg_recording').value.length > 1000").await;
    page.wait_until("document.querySelector('#emg_format').value === 'csv'").await;
    page.wait_until(&format!("{told}.startsWith('Loaded: walk 1.csv')")).await;
    is_fit(&page, axe, "emg-1-file").await;

    page.click("button[value=signals]").await;
    page.wait_for("button[value=muscles]").await;
    assert_eq!(page.text(".wizard [aria-current=step]").await, "Signals and heel strikes");
    assert_eq!(page.value("document.activeElement.innerText").await, "Signals and heel strikes");
    let form = page.text("#upload-emg").await;
    assert!(form.contains("walk 1.csv, 7 columns") && form.contains("6 right heel strikes from column heel"), "{form}");
    assert_eq!(page.value("document.querySelector('#heel_strike_column').value").await, "heel");
    assert_eq!(page.count("#upload-emg svg.chart").await, 7);
    is_fit(&page, axe, "emg-2-signals").await;

    page.click("button[value=muscles]").await;
    page.wait_for("#column_TA_L").await;
    assert_eq!(page.value("document.querySelector('#column_TA_L').value").await, "Left tib ant");
    page.run("document.querySelector('#column_RF_L').value = 'EMG 1'").await;
    is_fit(&page, axe, "emg-3-muscles").await;

    page.click("#upload-emg button[value=preview]").await;
    page.wait_for("#preview").await;
    let preview = page.text("#preview").await;
    assert!(preview.contains("The recording can be uploaded: walk 1.csv"), "{preview}");
    page.click("[data-strides] tbody tr:nth-child(2) input").await;
    page.wait_until("document.querySelector('#rejected_strides').value === '2'").await;
    page.click("#upload-emg button[value=preview]").await;
    page.wait_until("document.querySelector('[data-strides]').innerText.includes('rejected')").await;
    assert_eq!(page.value("document.querySelector('#rejected_strides').value").await, "2");
    let result = page.text("#preview").await;
    assert!(result.contains("mean activity over the gait cycle"), "{result}");
    is_fit(&page, axe, "emg-4-strides").await;
    page.click("#upload-emg button[value=upload]").await;
    page.wait_until("[...document.querySelectorAll('main td a')].some(a => a.innerText === 'walk 1.csv')").await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}

/// Signs of a laboratory whose left ankle is positive in plantarflexion.
const LEFT_ANKLE_REVERSED: [f64; 7] = [1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0];
/// Warning of the page about the left ankle of such a file.
const DOUBT: &str = "Left ankle moves opposite to normal walking. Is its sign reversed?";

#[tokio::test(flavor = "multi_thread")]
async fn browser_shows_a_reversed_joint_angle_and_corrects_it_before_the_upload() {
    let Some(browser) = Chromium::launch().await else { return };
    let axe = Axe::find();
    let axe = axe.as_ref();
    let site = Site::start(Analytic::default()).await;
    let page = browser.open(&session_with_a_walk(&site).await).await;
    page.unfold().await;
    drop_file(&page, "joint-angles", "walk 1.csv", &laboratory_angles(LEFT_ANKLE_REVERSED)).await;
    page.wait_until("document.querySelector('#joint_angles_recording').value.length > 1000").await;
    page.click("#upload-joint-angles button[value=preview]").await;
    page.wait_for("#columns").await;
    let columns = page.text("#columns").await;
    assert!(columns.contains("The sign of one angle looks reversed.") && columns.contains(DOUBT), "{columns}");
    assert_eq!(page.count("#columns svg.chart").await, 7);
    assert_eq!(page.count("#upload-joint-angles button[value=upload]").await, 0, "the strides come first");
    is_fit(&page, axe, "angles-1-columns").await;

    page.click("[name=reversed_ankle_L]").await;
    page.click("button[value=columns]").await;
    page.wait_until("document.querySelector('[name=reversed_ankle_L]')?.hasAttribute('checked') ?? false").await;
    let columns = page.text("#columns").await;
    assert!(!columns.contains("looks reversed") && !columns.contains(DOUBT), "{columns}");
    page.click("#columns button[value=preview]").await;
    page.wait_for("#preview").await;
    let preview = page.text("#preview").await;
    assert!(preview.contains("The recording can be uploaded: walk 1.csv"), "{preview}");
    is_fit(&page, axe, "angles-2-strides").await;
    page.click("#upload-joint-angles button[value=upload]").await;
    page.wait_until("[...document.querySelectorAll('main td a')].some(a => a.innerText === 'walk 1.csv')").await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_imports_a_reference_gait_whose_left_ankle_was_reversed() {
    let Some(browser) = Chromium::launch().await else { return };
    let axe = Axe::find();
    let axe = axe.as_ref();
    let site = Site::start(Analytic::default()).await;
    let page = browser.open(&site.at("/reference-gaits")).await;
    drop_file(&page, "reference-gaits", "S03.csv", &laboratory_angles(LEFT_ANKLE_REVERSED)).await;
    page.wait_until("document.querySelector('#recording').value.length > 1000").await;
    page.click("main button[value=preview]").await;
    page.wait_for("#columns").await;
    assert!(page.text("#columns").await.contains(DOUBT));
    is_fit(&page, axe, "reference-1-columns").await;
    page.click("[name=reversed_ankle_L]").await;
    page.click("#columns button[value=preview]").await;
    page.wait_for("#preview").await;
    assert!(!page.text("#columns").await.contains(DOUBT));
    let preview = page.text("#preview").await;
    assert!(preview.contains("The recording can be imported: S03.csv"), "{preview}");
    is_fit(&page, axe, "reference-2-strides").await;
    page.click("main button[value=import]").await;
    page.wait_until("document.querySelector('h1').innerText === 'S03'").await;
    assert!(page.text("main").await.contains("ankle_L = -L Ankle"));
    page.is_clean(&site.origin).await;
    browser.close().await;
}
