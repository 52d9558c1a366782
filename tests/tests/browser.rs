//! The pages in a real browser. Every name contains `browser`; without a Chromium they say so and are skipped,
//! unless `GAITWRIGHT_REQUIRE_BROWSER` is set.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod chromium;

use chromium::Chromium;
use gaitwright::store::studies::{FeedbackMode, StudyState};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use std::time::Duration;

/// A service on a port of its own.
struct Site {
    service: Service,
    origin: String,
    _folder: tempfile::TempDir,
}

impl Site {
    async fn start(solver: Analytic) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let origin = format!("http://{}", listener.local_addr().unwrap());
        let router = service.router();
        tokio::spawn(async move { axum::serve(listener, router).await.unwrap() });
        Self { service, origin, _folder: folder }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_from_nothing_to_a_finished_study_in_three_clicks() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::slow(Duration::from_millis(15))).await;
    let page = browser.open(&site.origin).await;
    page.click("a.button").await;
    page.wait_for("#trial_budget").await;
    page.fill("#trial_budget", "3").await;
    page.click("button[type=submit]").await;
    // The page follows the study by itself.
    page.wait_for("[data-trial]").await;
    page.wait_for(".state.finished").await;
    assert_eq!(page.count(".trials tbody tr").await, 3);
    assert_eq!(page.count("svg.chart").await, 1);
    page.click(".trials tbody tr a").await;
    page.wait_for(".walker canvas").await;
    page.wait_for("[data-phase]").await;
    assert!(page.count("svg.chart").await >= 12);
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_animation_plays_pauses_and_is_scrubbed() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.trial_budget = 1).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let trial = site.service.trials(study).await[0].id;
    let page = browser.open(&format!("{}/trials/{trial}", site.origin)).await;
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
async fn browser_answers_a_comparison_with_the_keyboard_and_without_scripts() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| (new.trial_budget, new.feedback_mode) = (3, FeedbackMode::Human)).await;
    site.service.wait_for(study, &[StudyState::Waiting]).await;

    let page = browser.open(&format!("{}/studies/{study}/compare", site.origin)).await;
    page.wait_for("input[name=answer]").await;
    page.run("document.querySelector('input[name=answer]').focus()").await;
    page.press("ArrowRight").await;
    let chosen = "document.querySelector('input[name=answer]:checked')?.value ?? 'nothing'";
    assert_eq!(page.value(chosen).await, "no_difference");
    page.run("document.querySelector('#author').focus()").await;
    page.type_text("K1").await;
    assert_eq!(page.value("document.querySelector('#author').value").await, "K1");
    page.press("Enter").await;
    page.wait_for(".notice.good").await;
    assert!(page.text(".notice.good").await.contains("no difference between trial"));

    while site.service.trials(study).await.len() < 3 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    let plain = browser.open_without_scripts(&format!("{}/studies/{study}/compare", site.origin)).await;
    // The answers stand below the pictures of both gaits.
    plain.resize(1280, 2000).await;
    plain.click_plainly("input[value=b]").await;
    plain.click_plainly("#author").await;
    plain.type_text("K2").await;
    plain.click_plainly("main > form button[type=submit]").await;
    plain.wait_for(".notice.good").await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    assert_eq!(site.service.feedback(study).await.iter().filter(|row| row.author.starts_with('K')).count(), 2);
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_pages_fit_a_tablet_and_a_phone() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.trial_budget = 4).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let trial = site.service.trials(study).await[0].id;
    for path in [
        "/".into(),
        "/studies/new".into(),
        format!("/studies/{study}"),
        format!("/studies/{study}/compare"),
        format!("/trials/{trial}"),
        "/subjects".into(),
        format!("/subjects/{}", site.service.subject().await),
    ] {
        let page = browser.open(&format!("{}{path}", site.origin)).await;
        for width in [1280, 768, 360] {
            page.resize(width, 900).await;
            let overflow =
                page.value("document.documentElement.scrollWidth - document.documentElement.clientWidth").await;
            assert_eq!(overflow, "0", "{path} at {width} px");
        }
        page.is_clean(&site.origin).await;
    }
    browser.close().await;
}
