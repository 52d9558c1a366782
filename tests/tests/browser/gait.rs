//! The page of a gait.

use crate::chromium::Chromium;
use crate::site::Site;
use gaitwright_store::TrialId;
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::TrialState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::explained::{Clearance, without_gaits};
use std::time::Duration;

async fn with_a_gait() -> (Site, TrialId) {
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.trial_budget = 1).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let trial = site.service.trials(study).await[0].id;
    (site, trial)
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_animation_plays_pauses_and_is_scrubbed() {
    let Some(browser) = Chromium::launch().await else { return };
    let (site, trial) = with_a_gait().await;
    let page = browser.open(&site.at(&format!("/trials/{trial}"))).await;
    page.wait_for("[data-play]").await;
    let phase = "document.querySelector('[data-scrub]').value";
    let first = page.value(phase).await;
    tokio::time::sleep(Duration::from_millis(300)).await;
    assert_ne!(page.value(phase).await, first, "it plays by itself");
    page.click("[data-play]").await;
    let paused = page.value(phase).await;
    tokio::time::sleep(Duration::from_millis(200)).await;
    assert_eq!(page.value(phase).await, paused, "it stands still");
    let pixels = "document.querySelector('.walker canvas').toDataURL().length";
    let before = page.value(pixels).await;
    page.run("const s = document.querySelector('[data-scrub]'); s.value = 50; s.dispatchEvent(new Event('input'))")
        .await;
    assert_ne!(page.value(pixels).await, before, "another picture");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_gait_is_shown_completely_with_coloured_muscles() {
    let Some(browser) = Chromium::launch().await else { return };
    let (site, trial) = with_a_gait().await;
    let page = browser.open_without_scripts(&site.at(&format!("/trials/{trial}"))).await;
    // Angles, forces, torques, muscles, portraits; the stride as pictures.
    for (group, charts) in [("angles", 6), ("forces", 2), ("torques", 6), ("muscles", 6), ("portraits", 7)] {
        assert_eq!(page.count(&format!("#{group} svg.chart")).await, charts, "{group}");
    }
    assert_eq!(page.count("svg.tiles").await, 1);
    assert_eq!(page.count("#bounds tbody tr").await, 8);
    let reached =
        "[...document.querySelectorAll('#bounds tbody tr')].every(row => /[0-9]/.test(row.cells[3].textContent))";
    assert_eq!(page.value(reached).await, "true", "of every bound it is said what the gait makes of it");
    assert_eq!(page.count("#solve .files a").await, 3);
    // Muscles of a leg are drawn in a colour of their own.
    let page = browser.open(&site.at(&format!("/trials/{trial}"))).await;
    page.wait_for("[data-play]").await;
    let coloured = page
        .value(
            "(() => { const c = document.querySelector('.walker canvas'); \
             const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let n = 0; \
             for (let i = 0; i < d.length; i += 4) if (d[i + 3] > 40 && d[i] > 1.6 * d[i + 1] && d[i + 2] > d[i + 1]) n++; \
             return n })()",
        )
        .await;
    assert!(coloured.parse::<u32>().unwrap() > 50, "{coloured} points in the colour of muscles");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_explains_a_trial_without_a_gait() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.trial_budget = 40).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let trials = site.service.trials(study).await;
    let without = trials.iter().find(|trial| trial.state == TrialState::NotConverged).unwrap();
    let page = browser.open(&site.at(&format!("/trials/{}", without.id))).await;
    let text = page.text("#explanation").await;
    assert!(text.contains("swing foot clearance") && text.contains("--explain"), "{text}");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_shows_an_explanation_when_it_is_ready() {
    let Some(browser) = Chromium::launch().await else { return };
    let explainer = Clearance::slow(Duration::from_secs(2));
    let site = Site::start_explaining(Analytic::default(), explainer).await;
    let study =
        site.service.study(|new| (new.trial_budget, new.search_space) = (3, Some(without_gaits().into()))).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let last = site.service.trials(study).await[2].id;
    let page = browser.open(&site.at(&format!("/trials/{last}"))).await;
    page.click("#explanation button").await;
    page.wait_for("#explanation .pulse").await;
    page.wait_for("#explanation li").await;
    let text = page.text("#explanation").await;
    assert!(
        text.contains("Relaxing a5 (swing-foot clearance) alone, to 0.03 m")
            && !text.contains("is solving this trial again"),
        "{text}"
    );
    page.is_clean(&site.origin).await;
    browser.close().await;
}
