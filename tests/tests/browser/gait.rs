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
    let study = site.service.study(|new| new.number_of_trials = 1).await;
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
    let pose = "document.querySelector('[data-body] [data-segment=\"left.thigh\"]').getAttribute('transform')";
    let before = page.value(pose).await;
    page.run("const s = document.querySelector('[data-scrub]'); s.value = 50; s.dispatchEvent(new Event('input'))")
        .await;
    assert_ne!(page.value(pose).await, before, "another pose");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_gait_is_shown_completely_with_coloured_muscles() {
    let Some(browser) = Chromium::launch().await else { return };
    let (site, trial) = with_a_gait().await;
    let page = browser.open_without_scripts(&site.at(&format!("/trials/{trial}"))).await;
    // Each leg over its own cycle; the stride as pictures.
    for (group, charts) in
        [("angles", 4), ("forces", 2), ("torques", 3), ("powers", 3), ("muscles", 7), ("fibres", 7), ("portraits", 4)]
    {
        assert_eq!(page.count(&format!("#{group} svg.chart")).await, charts, "{group}");
    }
    assert_eq!(page.count("#powers tbody tr").await, 6);
    // The walker is complete without scripts.
    for (what, count) in [(".device", 3), (".muscle", 10), (".trunk", 1), (".left", 3)] {
        assert_eq!(page.count(&format!(".walker [data-body] {what}")).await, count, "{what}");
    }
    assert_eq!(page.count("svg.tiles").await, 1);
    assert_eq!(page.count("#bounds tbody tr").await, 8);
    let reached =
        "[...document.querySelectorAll('#bounds tbody tr')].every(row => /[0-9]/.test(row.cells[3].textContent))";
    assert_eq!(page.value(reached).await, "true", "of every bound it is said what the gait makes of it");
    assert_eq!(page.count("#solve .files a").await, 3);
    let bytes = page.value("document.documentElement.outerHTML.length").await;
    assert!(bytes.parse::<u32>().unwrap() < 400_000, "{bytes} bytes");
    // Muscles are scaled to their own peak.
    let page = browser.open(&site.at(&format!("/trials/{trial}"))).await;
    page.wait_for("[data-play]").await;
    let widest = "(() => { let widest = 0; const s = document.querySelector('[data-scrub]'); for (let p = 0; p <= 100; p += 0.5) { \
                  s.value = p; s.dispatchEvent(new Event('input')); \
                  widest = Math.max(widest, ...[...document.querySelectorAll('.muscle')].map(m => Number(m.getAttribute('stroke-width')))); \
                  } return widest })()";
    page.wait_until(&format!("{widest} === 5")).await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_has_one_cursor_for_walker_and_charts() {
    let Some(browser) = Chromium::launch().await else { return };
    let (site, trial) = with_a_gait().await;
    let page = browser.open(&site.at(&format!("/trials/{trial}"))).await;
    page.wait_for("[data-play]").await;
    page.wait_for("#angles .cursor").await;
    // Drags to the middle of the axis of the first chart, from the line of the right leg.
    let drag = "(() => { const c = document.querySelector('#angles svg.chart'); const m = c.getScreenCTM(); \
                const s = document.querySelector('[data-scrub]'); s.value = 40; s.dispatchEvent(new Event('input')); \
                const send = (kind, x) => c.dispatchEvent(new PointerEvent(kind, { bubbles: true, button: 0, \
                  clientX: m.e + m.a * x, clientY: m.f + m.d * 150 })); \
                send('pointerdown', 74 + 542 * 0.4); send('pointermove', 74 + 542 * 0.25); send('pointerup', 0); \
                const at = [...c.parentElement.querySelectorAll('.cursor')].map(l => Number(l.getAttribute('transform').match(/[\\d.]+/)[0])); \
                const percent = at.map(x => Math.round((x - 74) / 5.42)); return [s.value, ...percent].join(' ') })()";
    // The cycle of the left leg begins in the middle of the stride.
    assert_eq!(page.value(drag).await, "25 75 25");
    assert_eq!(page.text("[data-play]").await, "Play", "what is dragged does not play on");
    // The reference gait appears behind the walker.
    let ghost = "document.querySelector('[data-ghost]').getAttribute('visibility')";
    assert_eq!(page.value(ghost).await, "hidden");
    page.click("[data-overlay]").await;
    assert_eq!(page.value(ghost).await, "visible");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_explains_a_trial_without_a_gait() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 40).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let trials = site.service.trials(study).await;
    let without = trials.iter().find(|trial| trial.state == TrialState::NotConverged).unwrap();
    let page = browser.open(&site.at(&format!("/trials/{}", without.id))).await;
    assert!(!page.text("#explanation").await.contains("swing foot clearance"), "rows of the problem are folded away");
    page.run("for (const d of document.querySelectorAll('#explanation details')) d.open = true").await;
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
        site.service.study(|new| (new.number_of_trials, new.search_space) = (3, Some(without_gaits().into()))).await;
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
    // The conflict in words comes first, and each way out leads to a study with it.
    let headline = page.text("#explanation .headline").await;
    assert!(headline.contains("swing-foot clearance of at least"), "{headline}");
    page.click("#explanation .ways a").await;
    page.wait_for("#bounds[open]").await;
    assert_eq!(page.value("document.querySelector('[name=fixed_a5]').value").await, "0.03");
    page.is_clean(&site.origin).await;
    browser.close().await;
}
