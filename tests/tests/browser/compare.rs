//! Staff compare two gaits: one press for each answer, and undo.

use crate::axe::Axe;
use crate::chromium::{Chromium, Tab};
use crate::site::Site;
use gaitwright_store::StudyId;
use gaitwright_store::feedback::FeedbackRow;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_tests::analytic::Analytic;
use std::time::Duration;

/// Where the page has what an answer needs.
const NEEDED: &str = "h1, details.person summary, .motions svg.gait-walker, .motions .answer, .extras summary";

async fn waiting(site: &Site, trials: u32) -> StudyId {
    let study =
        site.service.study(|new| (new.number_of_trials, new.answer_source) = (trials, AnswerSource::People)).await;
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    study
}

/// Answers of a person.
async fn answers(site: &Site, study: StudyId, author: &str) -> Vec<FeedbackRow> {
    let mut rows = site.service.feedback(study).await;
    rows.retain(|row| row.author == author);
    rows
}

/// The page of the comparison, with the name of the person who answers.
async fn asked(browser: &Chromium, site: &Site, study: StudyId) -> Tab {
    let page = browser.open(&site.at(&format!("/studies/{study}/compare"))).await;
    page.answer("a").await;
    page.fill("#author", "K1").await;
    page
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_staff_answer_with_one_click_and_undo_within_five_seconds() {
    let Some(browser) = Chromium::launch().await else { return };
    // The study is still computing when the answer is undone.
    let site = Site::start(Analytic::slow(Duration::from_millis(60))).await;
    let study = waiting(&site, 5).await;
    let page = asked(&browser, &site, study).await;
    page.click("button[value=b]").await;
    page.wait_for(".notice.good [data-undo]").await;
    assert_eq!(answers(&site, study, "K1").await.len(), 1, "saved at once");
    page.click("[data-undo] button").await;
    page.wait_until("document.querySelector('.notice.good')?.textContent.includes('(retracted)') ?? false").await;
    let undone = answers(&site, study, "K1").await.remove(0).retraction.unwrap();
    assert_eq!((undone.author.as_str(), undone.reason.as_str()), ("K1", "undone immediately after answering"));
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_undo_of_a_changed_answer_brings_the_former_one_back() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site, 5).await;
    let page = asked(&browser, &site, study).await;
    page.run("document.activeElement.blur()").await;
    page.press("ArrowLeft").await;
    page.wait_for(".notice.good [data-undo]").await;
    let first = answers(&site, study, "K1").await.remove(0);
    // The answer is changed on the page of the study, with a key, and the change is undone with Ctrl+Z.
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    page.click("#answers a[href*='change=']").await;
    page.answer("no_difference").await;
    page.press("2").await;
    page.wait_until("document.querySelector('.notice.good')?.textContent.includes('no difference between') ?? false")
        .await;
    page.wait_until("document.querySelector('[data-left]').textContent !== ''").await;
    page.press_with_control("z").await;
    page.wait_until("document.querySelector('.notice.good')?.textContent.includes('counts again') ?? false").await;
    let rows = answers(&site, study, "K1").await;
    let standing: Vec<_> = rows.iter().filter(|row| row.retraction.is_none()).collect();
    assert_eq!((rows.len(), standing.len()), (3, 1), "{rows:?}");
    assert_eq!((standing[0].content, standing[0].restores), (first.content, Some(first.id)));
    // The page loads again when the next comparison is ready. A reason retracts the answer later.
    page.wait_until(
        "document.readyState === 'complete' && document.querySelectorAll('.notice.good details').length === 1",
    )
    .await;
    assert_eq!(page.count("[data-undo]").await, 0, "an undo cannot be undone");
    if let Some(axe) = Axe::find() {
        let complaints = axe.complaints(&page).await;
        assert!(complaints.is_empty(), "{complaints:?}");
    }
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_page_waits_with_the_next_comparison_until_undo_is_over() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::slow(Duration::from_millis(300))).await;
    let study = waiting(&site, 12).await;
    let page = asked(&browser, &site, study).await;
    // The next comparison is there at once if its trial was prefetched.
    for _ in 0..8 {
        let answered = page.address().await;
        page.click("button[value=a]").await;
        page.wait_until(&format!("location.href !== '{answered}' && document.readyState === 'complete'")).await;
        page.wait_for(".notice.good").await;
        if page.count("[data-going-on]").await > 0 {
            break;
        }
    }
    assert_eq!(page.count(".notice.good [data-going-on]").await, 1);
    page.run("window.same = true").await;
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    tokio::time::sleep(Duration::from_millis(500)).await;
    assert_eq!(page.value("window.same ?? false").await, "true", "Undo stays under the pointer");
    assert_eq!(page.count("[data-undo]:not([hidden])").await, 1);
    // Then it comes by itself, with the name.
    page.wait_until("window.same === undefined").await;
    page.answer("a").await;
    assert_eq!(page.value("document.querySelector('#author').value").await, "K1");
    assert_eq!(page.count("[data-undo]:not([hidden])").await, 0, "its time is over");
    assert_eq!(page.count(".notice.good details").await, 1, "a reason retracts it later");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_staff_see_both_gaits_and_every_answer_without_scrolling() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site, 5).await;
    let page = browser.open(&site.at(&format!("/studies/{study}/compare"))).await;
    page.answer("a").await;
    // At first the name of the person is asked, then the answer before is shown.
    for answered in [false, true] {
        for (width, height, least) in [(1280, 800, 300.0), (1024, 768, 260.0), (390, 844, 150.0)] {
            page.resize(width, height).await;
            let (bottom, ..) = page.lowest(NEEDED).await;
            assert!(bottom <= height as f64, "{width} x {height}: {bottom}");
            let (_, wide, high) = page.lowest(".motions svg.gait-walker").await;
            assert!(high >= least && wide >= 300.0, "{width} x {height}: {wide} x {high}");
            assert_eq!(page.beyond().await, "0");
            if answered {
                let (bottom, ..) = page.lowest("[data-undo] button").await;
                assert!(bottom <= height as f64, "{width} x {height}: {bottom}");
            } else {
                let (bottom, ..) = page.lowest("#author").await;
                assert!(bottom <= height as f64, "{width} x {height}: {bottom}");
            }
        }
        if !answered {
            page.fill("#author", "K1").await;
            page.become_touch_screen().await;
            page.touch("button[value=no_difference]").await;
            page.wait_for(".notice.good").await;
            page.answer("a").await;
        }
    }
    assert_eq!(answers(&site, study, "K1").await.len(), 1, "one touch");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_name_of_another_person_never_replaces_the_signed_in_user() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = waiting(&site, 5).await;
    let page = asked(&browser, &site, study).await;
    page.run("sessionStorage.setItem('answering person', JSON.stringify({source: 'subject', author: 'S09'}))").await;
    // The page of a signed-in user, as the service writes it.
    let signed_in = "(async () => { const place = document.querySelector('details.person'); const copy = place.cloneNode(true); \
        copy.dataset.user = 'Dr Kay'; copy.querySelector('#author').value = 'Dr Kay'; copy.querySelector('#source').value = 'clinician'; \
        place.replaceWith(copy); await import('/static/answering_person.mjs?again'); \
        return copy.querySelector('#source').value + ' ' + copy.querySelector('#author').value })()";
    assert_eq!(page.value(signed_in).await, "clinician Dr Kay");
    // The code of the subject is not the name of the user.
    let changed = "(() => { const s = document.querySelector('#source'); s.value = 'subject'; \
        s.dispatchEvent(new Event('change', { bubbles: true })); return document.querySelector('#author').value })()";
    assert_eq!(page.value(changed).await, "S09");
    assert!(page.text("details.person summary").await.ends_with("the subject, S09"));
    page.is_clean(&site.origin).await;
    browser.close().await;
}
