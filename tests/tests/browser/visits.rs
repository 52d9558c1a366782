//! The questions of visitors, each from the home page to its answer: how many presses it takes, and that the answer is in view.

use crate::chromium::{Chromium, Tab};
use crate::site::Site;
use gaitwright_store::StudyId;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::explained::{Clearance, without_gaits};
use gaitwright_tests::measured::electromyogram;
use serde_json::json;
use std::time::{Duration, Instant};

/// A visit that begins on the home page.
struct Visit<'a> {
    question: &'a str,
    page: Tab,
    presses: u32,
    begun: Instant,
}

impl<'a> Visit<'a> {
    async fn begin(browser: &Chromium, site: &Site, question: &'a str) -> Self {
        let page = browser.open(&site.origin).await;
        page.resize(1280, 800).await;
        Self { question, page, presses: 0, begun: Instant::now() }
    }

    async fn press(&mut self, selector: &str) {
        self.page.click(selector).await;
        self.presses += 1;
    }

    /// The page answers the question: an element with these words, in view without scrolling. The time is printed, not tested.
    async fn ends_at(self, selector: &str, words: &str, presses: u32) {
        self.page.wait_for(selector).await;
        let seconds = self.begun.elapsed().as_secs_f64();
        let text = self.page.text(selector).await;
        assert!(text.contains(words), "{}: {text}", self.question);
        let top = format!("String(document.querySelector(`{selector}`).getBoundingClientRect().top)");
        let top: f64 = self.page.value(&top).await.parse().unwrap();
        assert!((0.0..800.0).contains(&top), "{}: the answer is at {top} px", self.question);
        println!("{}: {} presses, {seconds:.1} s", self.question, self.presses);
        assert_eq!(self.presses, presses, "{}", self.question);
    }
}

/// The link to a study on the home page.
fn link(study: StudyId) -> String {
    format!("table.studies a[href='/studies/{study}']")
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_reaches_outcome_progress_comparison_and_lab_results_in_few_presses() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let finished = site.service.study(|new| new.number_of_trials = 6).await;
    site.service.wait_for(finished, &[StudyState::Finished]).await;
    let other = site.service.study(|new| new.number_of_trials = 4).await;
    site.service.wait_for(other, &[StudyState::Finished]).await;

    let mut visit = Visit::begin(&browser, &site, "which gait is best, and how sure is that").await;
    visit.press(&link(finished)).await;
    visit.ends_at("[data-part=best]", "Gait RMSE", 1).await;

    let mut visit = Visit::begin(&browser, &site, "how do two studies compare").await;
    visit.press(&format!("table.studies input[value='{finished}']")).await;
    visit.press(&format!("table.studies input[value='{other}']")).await;
    visit.press(".heading button[form=compare]").await;
    visit.ends_at(".headline", "Closest to the reference gait: ", 3).await;

    let trials = site.service.trials(finished).await;
    let converged: Vec<_> = trials.iter().filter(|trial| trial.state == TrialState::Converged).collect();
    let gaits = json!({"trial_a": converged[0].id, "trial_b": converged[1].id});
    let session = site.service.post(&format!("/api/v1/studies/{finished}/lab-sessions"), &gaits).await.json();
    let session = format!("/api/v1/lab-sessions/{}", session["id"].as_str().unwrap());
    for walk in 1..=2 {
        site.service.post(&format!("{session}/walks"), &json!({"walk": walk})).await;
        let reading = json!({"heel_strike_column": "heel"});
        let emg = json!({"walk": walk, "recording": electromyogram(f64::from(walk)), "reading": reading});
        site.service.post(&format!("{session}/measurement-files/emg"), &emg).await;
    }
    site.service.post(&format!("{session}/emg-results"), &json!({})).await;
    let mut visit = Visit::begin(&browser, &site, "what was the muscle activity of a visit").await;
    visit.press(&link(finished)).await;
    visit.press("nav.index a[href^='/lab-sessions/']").await;
    visit.page.wait_for("#emg table").await;
    let (bottom, ..) = visit.page.lowest("#emg tbody tr:first-child").await;
    assert!(bottom <= 800.0, "{bottom}");
    let emg = visit.page.text("main").await;
    assert!(emg.contains("EMG, left rectus femoris"), "{emg}");
    visit.page.resize(390, 844).await;
    let hidden = "[...document.querySelectorAll('#emg .scroll')].filter(t => t.scrollWidth > t.clientWidth + 1).length";
    visit.page.wait_until(&format!("{hidden} === 0")).await;
    assert_eq!(visit.presses, 2);
    println!("{}: 2 presses, {:.1} s", visit.question, visit.begun.elapsed().as_secs_f64());
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_reaches_a_running_study_and_its_comparison_in_few_presses() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::slow(Duration::from_millis(300))).await;
    let running = site.service.study(|new| new.number_of_trials = 400).await;
    site.service.wait_for(running, &[StudyState::Running]).await;
    let mut visit = Visit::begin(&browser, &site, "how far is a running study").await;
    visit.press(&link(running)).await;
    visit.ends_at("[data-part=state]", "of 400 trials", 1).await;
    site.service.post(&format!("/api/v1/studies/{running}/stop"), &json!({})).await;

    let asking = site.service.study(|new| (new.number_of_trials, new.answer_source) = (4, AnswerSource::People)).await;
    site.service.wait_for(asking, &[StudyState::Waiting]).await;
    // Who answers is asked once.
    let mut visit = Visit::begin(&browser, &site, "answer the comparison that waits").await;
    visit.press("[aria-labelledby=waits] a").await;
    visit.page.fill("#author", "K1").await;
    let better = visit.page.answer("b").await;
    visit.press(&better).await;
    visit.ends_at(".notice.good", "is better than", 2).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_reaches_the_conflict_of_a_trial_without_a_gait_in_two_presses() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start_explaining(Analytic::default(), Clearance::default()).await;
    let study =
        site.service.study(|new| (new.number_of_trials, new.search_space) = (2, Some(without_gaits().into()))).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let mut visit = Visit::begin(&browser, &site, "why is there no gait").await;
    visit.press(&link(study)).await;
    visit
        .page
        .wait_until("document.body.innerText.includes('relaxing a5 (swing-foot clearance) alone gives a gait')")
        .await;
    visit.press("[data-part=state] a[href$='#explanation']").await;
    visit.ends_at("#explanation .headline", "swing-foot clearance", 2).await;
    browser.close().await;
}
