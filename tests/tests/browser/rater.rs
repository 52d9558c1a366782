//! A rater compares two gaits blind: with mouse, touch and keyboard, and after failures.

use crate::chromium::{Chromium, Tab};
use crate::site::Site;
use gaitwright_store::StudyId;
use gaitwright_store::feedback::{FeedbackRow, Source};
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_tests::analytic::Analytic;

/// A study that waits for a comparison.
async fn waiting(site: &Site) -> StudyId {
    let study = site.service.study(|new| (new.number_of_trials, new.answer_source) = (3, AnswerSource::People)).await;
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
    page.answer("first").await;
    page
}

/// Where the page of a pair has what an answer needs.
const NEEDED: &str = "h1, svg[data-side], .motions .answer, .extras summary";

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_answers_with_one_click_and_undoes_the_answer() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    page.click("button[value=second]").await;
    page.wait_for(".notice.good").await;
    assert!(page.text(".notice.good").await.contains("answer 1: the second gait is better"));
    assert_eq!(answers(&site, study).await.len(), 1, "saved at once");
    page.wait_until("/^Undo \\([1-5] s\\)$/.test(document.querySelector('.notice.good button').textContent)").await;
    page.click(".notice.good button").await;
    page.wait_until("document.querySelector('.notice.good')?.textContent.includes('retracted') ?? false").await;
    assert!(answers(&site, study).await[0].retraction.is_some());
    // The retracted comparison is pending again, and comes by itself.
    page.wait_until("document.querySelector('h1').textContent === 'Pair 2'").await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_next_pair_comes_by_itself_unless_it_is_turned_off() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| (new.number_of_trials, new.answer_source) = (6, AnswerSource::People)).await;
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    let page = at_the_pair(&browser, &site).await;
    page.click("button[value=second]").await;
    page.wait_for(".notice.good").await;
    let saved = std::time::Instant::now();
    page.wait_until("location.pathname.startsWith('/rate/pair/')").await;
    let came = saved.elapsed().as_secs_f64();
    assert!(came > 3.0, "there is time to undo the answer: {came} s");

    page.click(&page.answer("first").await).await;
    page.click("[data-by-itself]").await;
    page.wait_until("document.querySelector('.notice.good button').textContent === 'Retract answer'").await;
    tokio::time::sleep(std::time::Duration::from_millis(1500)).await;
    assert_eq!(page.value("location.pathname").await, "/rate", "turned off");
    page.click(".notice.good button").await;
    page.wait_until("document.querySelector('.notice.good')?.textContent.includes('retracted') ?? false").await;
    assert_eq!(answers(&site, study).await.iter().filter(|row| row.retraction.is_some()).count(), 1);
    page.wait_for("[data-by-itself]:not(:checked)").await;
    page.click("[data-by-itself]").await;
    page.wait_until("location.pathname.startsWith('/rate/pair/')").await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_sees_both_gaits_and_every_answer_without_scrolling() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    for (width, height, least) in [(1280, 800, 400.0), (1024, 768, 380.0), (768, 1024, 400.0), (390, 844, 220.0)] {
        page.resize(width, height).await;
        let (bottom, ..) = page.lowest(NEEDED).await;
        assert!(bottom <= height as f64, "{width} x {height}: {bottom}");
        let (_, wide, high) = page.lowest("svg[data-side]").await;
        assert!(high >= least && wide >= 250.0, "{width} x {height}: {wide} x {high}");
        let (.., button) = page.lowest(".motions .answer").await;
        assert!(button >= 44.0, "for a finger: {button}");
    }
    // The figures stand one above the other on a phone, each with its answer below it.
    let order = "['svg[data-side=first]', '[value=first]', '[value=no_difference]', 'svg[data-side=second]', '[value=second]'] \
                 .map(s => document.querySelector(s).getBoundingClientRect()).every((box, i, all) => i === 0 || box.top >= all[i - 1].bottom)";
    assert_eq!(page.value(order).await, "true");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_gives_five_answers_on_a_phone_with_one_touch_each() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| (new.number_of_trials, new.answer_source) = (12, AnswerSource::People)).await;
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    let page = browser.open(&site.at("/rate")).await;
    page.resize(390, 844).await;
    page.become_touch_screen().await;
    page.reload().await;
    let begun = std::time::Instant::now();
    page.touch("main form button").await;
    for (place, value) in ["first", "second", "no_difference", "second", "first"].into_iter().enumerate() {
        let button = page.answer(value).await;
        let (bottom, ..) = page.lowest(NEEDED).await;
        assert!(bottom <= 844.0, "{bottom}");
        let seen =
            "[...document.querySelectorAll('[data-key], [data-keys]')].filter(e => e.getClientRects().length).length";
        assert_eq!(page.value(seen).await, "0", "a touch screen has no keys");
        page.run("window.touches = 0; document.addEventListener('touchstart', () => { window.touches += 1; })").await;
        assert_eq!(page.value("window.touches").await, "0");
        page.touch(&button).await;
        page.wait_for(".notice.good").await;
        assert_eq!(answers(&site, study).await.len(), place + 1, "one touch, one answer");
        let (bottom, ..) = page.lowest(".notice.good button, [data-next] button").await;
        assert!(bottom <= 844.0, "{bottom}");
    }
    println!("{:.1} s for five answers on a phone", begun.elapsed().as_secs_f64());
    // The last one is undone with a finger.
    page.touch(".notice.good button").await;
    page.wait_until("document.querySelector('.notice.good')?.textContent.includes('retracted') ?? false").await;
    assert_eq!(answers(&site, study).await.iter().filter(|row| row.retraction.is_some()).count(), 1);
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_answers_with_one_key() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| (new.number_of_trials, new.answer_source) = (8, AnswerSource::People)).await;
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    let page = at_the_pair(&browser, &site).await;
    let said = [("ArrowLeft", "the first gait"), ("3", "the second gait"), ("2", "no difference")];
    for (place, (key, words)) in said.into_iter().enumerate() {
        page.answer("first").await;
        assert_eq!(page.count("[data-key]:not([hidden]), [data-keys]:not([hidden])").await, 4, "the keys are named");
        page.press(key).await;
        page.wait_for(".notice.good").await;
        assert!(page.text(".notice.good").await.contains(words), "{key}");
        assert_eq!(answers(&site, study).await.len(), place + 1);
    }
    page.wait_until("document.querySelector('[data-left]').textContent !== ''").await;
    let undo = "new KeyboardEvent('keydown', { key: 'z', ctrlKey: true, bubbles: true, cancelable: true })";
    page.run(&format!("document.body.dispatchEvent({undo})")).await;
    page.wait_until("document.querySelector('.notice.good')?.textContent.includes('retracted') ?? false").await;
    assert!(answers(&site, study).await[2].retraction.is_some());
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_answers_and_undoes_without_scripts() {
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
    page.click_plainly("button[value=first]").await;
    page.wait_for(".notice.good").await;
    assert_eq!(answers(&site, study).await.len(), 1);
    page.click_plainly(".notice.good button").await;
    page.wait_until("document.querySelector('.notice.good')?.textContent.includes('was retracted') ?? false").await;
    assert!(answers(&site, study).await[0].retraction.is_some());
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    page.click_plainly("[data-next] button").await;
    page.wait_for("button[value=second]").await;
    page.click_plainly("button[value=second]").await;
    page.wait_for(".notice.good").await;
    assert_eq!(answers(&site, study).await.len(), 2);
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_reloads_the_page_and_sees_the_same_pair() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    let pair = page.address().await;
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
    page.run("const b = document.querySelector('button[value=first]'); b.click(); b.click()").await;
    page.wait_for(".notice.good").await;
    assert_eq!(answers(&site, study).await.len(), 1);
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_ignores_a_press_from_the_previous_page() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    // A second press finds a form whose script has just begun.
    let pressed = "(async () => { const old = document.querySelector('form[data-answer]'); const form = old.cloneNode(true); \
                   delete form.dataset.ready; old.replaceWith(form); await import('/static/kept_answer.mjs?again'); \
                   form.querySelector('[value=first]').click(); return 'ready' in form.dataset })()";
    assert_eq!(page.value(pressed).await, "false");
    page.answer("second").await;
    assert!(answers(&site, study).await.is_empty());
    page.click("button[value=second]").await;
    page.wait_for(".notice.good").await;
    assert!(page.text(".notice.good").await.contains("the second gait is better"));
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
        page.run(&format!("document.querySelector('button[value={value}]').click()")).await;
        page.wait_until(
            "!location.pathname.startsWith('/rate/pair') || document.querySelector('form[data-answer]') === null",
        )
        .await;
    }
    let told = other.text("main").await;
    assert!(
        told.contains("was already answered") && told.contains("Your first answer counts: the first gait is better."),
        "{told}"
    );
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

/// The note on the page of a pair.
const NOTE: &str = "document.querySelector('#note')?.value";

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_keeps_answer_and_note_during_an_outage() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    page.unfold().await;
    page.fill("#note", "softer at the heel").await;
    let site = site
        .restart(Analytic::default(), async |_| {
            page.run("document.querySelector('button[value=second]').click()").await;
            page.wait_for("[data-unsent]:not([hidden])").await;
            assert!(page.text("[data-unsent]").await.contains("may not have been saved"));
            assert_eq!(page.value(NOTE).await, "softer at the heel");
        })
        .await;
    // Also over a reload.
    page.reload().await;
    page.click("[data-unsent] button").await;
    page.wait_for(".notice.good").await;
    assert!(page.text(".notice.good").await.contains("the second gait is better"));
    let given = answers(&site, study).await;
    assert_eq!(given.iter().map(|row| row.note.as_str()).collect::<Vec<_>>(), ["softer at the heel"]);
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_rater_keeps_the_note_over_a_reload() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    page.unfold().await;
    page.fill("#note", "both limp").await;
    page.reload().await;
    page.wait_until(&format!("{NOTE} === 'both limp'")).await;
    page.click(&page.answer("cannot_tell").await).await;
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
    page.click("button[value=second]").await;
    page.wait_for(".notice.good").await;
    // The page of the pair offers it, and so does the home page without a word in its address.
    page.goto(&pair).await;
    assert!(page.text(".notice").await.contains("Your answer for this pair: the second gait is better"));
    assert_eq!(page.count("form[action$='/retract']").await, 1);
    page.goto(&site.at("/rate")).await;
    assert_eq!(page.text("form[action$='/retract'] button").await, "Retract answer");
    page.click("form[action$='/retract'] button").await;
    page.wait_until("document.querySelector('.notice.good')?.textContent.includes('retracted') ?? false").await;
    assert!(answers(&site, study).await[0].retraction.is_some());
    page.goto(&site.at("/rate")).await;
    assert_eq!(page.count("form[action$='/retract']").await, 0, "once");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_answer_keys_do_not_fire_in_other_fields_and_can_be_disabled() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site).await;
    let page = at_the_pair(&browser, &site).await;
    let same = "document.querySelector('form[data-ready]') !== null";
    for (field, key) in [
        ("[data-speed]", "1"),
        ("[data-scrub]", "ArrowRight"),
        ("[data-scrub]", "Enter"),
        ("[data-keys] input", "Enter"),
        ("#note", "1"),
        ("#note", "ArrowLeft"),
    ] {
        page.unfold().await;
        page.run(&format!("document.querySelector('{field}').focus()")).await;
        page.press(key).await;
        tokio::time::sleep(std::time::Duration::from_millis(150)).await;
        assert_eq!(page.value(same).await, "true", "{key} belongs to {field}");
    }
    page.run("document.activeElement.blur()").await;
    for held in ["ctrlKey", "repeat"] {
        let event = format!("new KeyboardEvent('keydown', {{ key: '2', {held}: true, bubbles: true }})");
        page.run(&format!("document.body.dispatchEvent({event})")).await;
        assert_eq!(page.value(same).await, "true", "{held}");
    }
    page.run("document.querySelector('[data-keys] input').click()").await;
    page.reload().await;
    page.answer("first").await;
    page.press("3").await;
    assert_eq!(page.value("document.querySelector('[data-key]').hidden").await, "true", "turned off, also later");
    assert_eq!(page.value(same).await, "true");
    assert!(answers(&site, study).await.is_empty());
    page.run("document.querySelector('[data-keys] input').click()").await;
    page.run("document.activeElement.blur()").await;
    page.press("ArrowRight").await;
    page.wait_for(".notice.good").await;
    assert!(page.text(".notice.good").await.contains("the second gait is better"));
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
