//! A rater compares two gaits blind: with mouse, touch and keyboard, and after failures.

use crate::chromium::{Chromium, Tab};
use crate::site::Site;
use gaitwright_store::StudyId;
use gaitwright_store::feedback::{FeedbackRow, Source};
use gaitwright_store::studies::{FeedbackMode, StudyState};
use gaitwright_tests::analytic::Analytic;

/// A study that waits for a comparison.
async fn waiting(site: &Site) -> StudyId {
    let study = site.service.study(|new| (new.trial_budget, new.feedback_mode) = (3, FeedbackMode::Human)).await;
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    study
}

/// Answers of people, retracted ones included.
async fn answers(site: &Site, study: StudyId) -> Vec<FeedbackRow> {
    let mut rows = site.service.feedback(study).await;
    rows.retain(|row| row.source == Source::Clinician);
    rows
}

/// The page of the pair, ready to be answered.
async fn at_the_pair(browser: &Chromium, site: &Site) -> Tab {
    let page = browser.open(&site.at("/rate")).await;
    page.click("main form button").await;
    // Its scripts have run, and both motions are there.
    page.wait_until(
        "document.readyState === 'complete' && \
         document.querySelector('[data-answer] [type=submit]')?.disabled === false",
    )
    .await;
    page
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_answers_with_the_mouse_and_retracts_the_answer() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    page.click("input[value=second]").await;
    page.click("[data-answer] [type=submit]").await;
    page.wait_for(".notice.good").await;
    assert!(page.text(".notice.good").await.contains("answer 1: the second gait is better"));
    assert_eq!(answers(&site, study).await.len(), 1);
    page.click(".notice.good button").await;
    page.wait_until("document.querySelector('.notice.good').textContent.includes('retracted')").await;
    assert!(answers(&site, study).await[0].retraction.is_some());
    // The retracted comparison is pending again.
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    page.click("main form[action^='/rate/'] button").await;
    page.wait_until("document.querySelector('h1').textContent === 'Pair 2'").await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_sees_the_whole_pair_on_a_tablet_in_both_orientations() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    for (width, height) in [(768, 1024), (1024, 768)] {
        page.resize(width, height).await;
        // Both gaits and the three answers are visible without scrolling.
        let bottom = "Math.max(...[...document.querySelectorAll('svg[data-side], .answer-option')].map(e => e.getBoundingClientRect().bottom))";
        let bottom: f64 = page.value(bottom).await.parse().unwrap();
        assert!(bottom <= height as f64, "{width} x {height}: {bottom}");
    }
    page.become_touch_screen().await;
    let touches = "window.touches = 0; document.addEventListener('touchstart', () => { window.touches += 1; });";
    page.run(touches).await;
    page.touch("input[value=no_difference]").await;
    page.wait_until("document.querySelector('input:checked')?.value === 'no_difference'").await;
    assert_eq!(page.value("window.touches").await, "1", "a finger, and no mouse");
    page.touch("[data-answer] [type=submit]").await;
    page.wait_for(".notice.good").await;
    assert_eq!(answers(&site, study).await.len(), 1);
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_answers_with_the_keyboard() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    for (key, value) in [("1", "first"), ("3", "second"), ("2", "no_difference")] {
        page.press(key).await;
        assert_eq!(page.value("document.querySelector('input:checked')?.value ?? ''").await, value);
    }
    page.press("Enter").await;
    page.wait_for(".notice.good").await;
    assert_eq!(answers(&site, study).await.len(), 1);
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_answers_without_scripts() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = browser.open_without_scripts(&site.at("/rate")).await;
    page.click_plainly("main form button").await;
    page.wait_for("svg.tiles").await;
    assert_eq!(page.count("svg.tiles").await, 2);
    let seen = "[...document.querySelectorAll('svg[data-side], [data-key], [data-keys]')].filter(e => e.getClientRects().length).length";
    assert_eq!(page.value(seen).await, "0", "no empty frames, no keys that do nothing");
    page.resize(1280, 2400).await;
    page.click_plainly("input[value=first]").await;
    page.click_plainly("[data-answer] [type=submit]").await;
    page.wait_for(".notice.good").await;
    assert_eq!(answers(&site, study).await.len(), 1);
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_reloads_the_page_and_sees_the_same_pair() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    let pair = page.address().await;
    page.click("input[value=first]").await;
    page.reload().await;
    assert_eq!(page.address().await, pair);
    // The rater page also returns to the pending pair.
    let again = at_the_pair(&browser, &site).await;
    assert_eq!(again.address().await, pair);
    assert!(answers(&site, study).await.is_empty());
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_double_click_of_a_rater_gives_one_answer() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    page.click("input[value=first]").await;
    page.run("const b = document.querySelector('[data-answer] [type=submit]'); b.click(); b.click()").await;
    page.wait_for(".notice.good").await;
    assert_eq!(answers(&site, study).await.len(), 1);
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_with_two_tabs_answers_once() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let (one, other) = (at_the_pair(&browser, &site).await, at_the_pair(&browser, &site).await);
    for (page, value) in [(&one, "first"), (&other, "second")] {
        page.run(&format!(
            "document.querySelector('input[value={value}]').checked = true; \
                           document.querySelector('[data-answer] [type=submit]').click()"
        ))
        .await;
        page.wait_until(
            "!location.pathname.startsWith('/rate/pair') || document.querySelector('form[data-answer]') === null",
        )
        .await;
    }
    let told = other.text("main").await;
    assert!(told.contains("was already answered") && told.contains("“first”, counts"), "{told}");
    assert_eq!(other.text("h1").await, "Answer not saved");
    other.click("main a.button[href='/rate']").await;
    other.wait_until("location.pathname === '/rate'").await;
    assert_eq!(answers(&site, study).await.len(), 1);
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_with_reduced_motion_sees_no_animation() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    waiting(&site).await;
    let page = browser.open(&site.at("/rate")).await;
    page.prefer("prefers-reduced-motion", "reduce").await;
    page.click("main form button").await;
    page.wait_until("document.querySelector('[data-play]')?.textContent === 'Play'").await;
    let pictures = "[...document.querySelectorAll('svg[data-side]')].map(svg => svg.innerHTML).join()";
    let before = page.value(pictures).await;
    tokio::time::sleep(std::time::Duration::from_millis(300)).await;
    assert_eq!(page.value(pictures).await, before, "it stands still");
    assert_eq!(page.count("svg.tiles").await, 2, "both strides as pictures");
    page.click("[data-play]").await;
    page.wait_until(&format!("{pictures} !== {before:?}")).await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}

/// The chosen answer and the note on the page of a pair.
const GIVEN: &str = "`${document.querySelector('input:checked')?.value} ${document.querySelector('#note')?.value}`";

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_keeps_choice_and_note_during_an_outage() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    page.press("3").await;
    page.fill("#note", "softer at the heel").await;
    let save = "document.querySelector('[data-answer] [type=submit]').click()";
    let site = site
        .restart(Analytic::default(), async |_| {
            page.run(save).await;
            page.wait_for("[data-unsent]:not([hidden])").await;
            assert!(page.text("[data-unsent]").await.contains("may not have been saved"));
            assert_eq!(page.value(GIVEN).await, "second softer at the heel");
        })
        .await;
    page.run(save).await;
    page.wait_for(".notice.good").await;
    let given = answers(&site, study).await;
    assert_eq!(given.iter().map(|row| row.note.as_str()).collect::<Vec<_>>(), ["softer at the heel"]);
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_keeps_choice_and_note_over_a_reload() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    page.click("input[value=cannot_tell]").await;
    page.fill("#note", "both limp").await;
    page.reload().await;
    page.wait_until(&format!("{GIVEN} === 'cannot_tell both limp'")).await;
    page.wait_until("document.querySelector('[data-answer] [type=submit]').disabled === false").await;
    page.click("[data-answer] [type=submit]").await;
    page.wait_for(".notice.good").await;
    assert!(answers(&site, study).await.is_empty(), "no preference");
    assert_eq!(page.value("sessionStorage.length").await, "0", "what is saved is not kept here");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_retracts_the_newest_answer_later() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    let pair = page.address().await;
    page.click("input[value=second]").await;
    page.click("[data-answer] [type=submit]").await;
    page.wait_for(".notice.good").await;
    // The page of the pair offers it, and so does the home page without a word in its address.
    page.goto(&pair).await;
    assert!(page.text(".notice").await.contains("Your answer for this pair: the second gait is better"));
    assert_eq!(page.count("form[action$='/retract']").await, 1);
    page.goto(&site.at("/rate")).await;
    page.click("form[action$='/retract'] button").await;
    page.wait_until("document.querySelector('.notice.good')?.textContent.includes('retracted') ?? false").await;
    assert!(answers(&site, study).await[0].retraction.is_some());
    page.goto(&site.at("/rate")).await;
    assert_eq!(page.count("form[action$='/retract']").await, 0, "once");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_turns_keys_off_and_keys_do_not_affect_other_fields() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    let chosen = "document.querySelector('[name=answer]:checked')?.value ?? 'nothing'";
    page.run("document.querySelector('[data-speed]').focus()").await;
    page.press("1").await;
    assert_eq!(page.value(chosen).await, "nothing", "the key belongs to the field");
    page.run("document.activeElement.blur()").await;
    page.run("document.body.dispatchEvent(new KeyboardEvent('keydown', { key: '2', ctrlKey: true, bubbles: true }))")
        .await;
    assert_eq!(page.value(chosen).await, "nothing", "the key belongs to the browser");
    page.click("[data-keys] input").await;
    page.reload().await;
    page.wait_until("document.querySelector('[data-keys]')?.hidden === false").await;
    page.press("3").await;
    assert_eq!(page.value(chosen).await, "nothing", "turned off, also later");
    assert_eq!(page.value("document.querySelector('[data-key]').hidden").await, "true");
    page.click("[data-keys] input").await;
    page.run("document.activeElement.blur()").await;
    page.press("3").await;
    assert_eq!(page.value(chosen).await, "second");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_moves_through_the_stride_with_the_slider() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    let scrub = "const s = document.querySelector('[data-scrub]'); s.value = 50; s.dispatchEvent(new Event('input'))";
    page.run(scrub).await;
    assert_eq!(page.text("[data-play]").await, "Play", "it stands still");
    let pictures = "[...document.querySelectorAll('svg[data-side]')].map(svg => svg.innerHTML).join()";
    page.wait_until("document.querySelector('[data-scrub]').value === '50'").await;
    let before = page.value(pictures).await;
    page.run(&scrub.replace("50", "25")).await;
    page.wait_until(&format!("{pictures} !== {before:?}")).await;
    // A body with a prosthesis, which both gaits have.
    assert_eq!(page.count("svg[data-side] .device").await, 6);
    page.is_clean(&site.origin).await;
    browser.close().await;
}
