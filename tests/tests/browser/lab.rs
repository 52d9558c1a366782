//! The lab pages: walks are recorded, and the subject answers which was better.

use crate::chromium::Chromium;
use crate::site::Site;
use gaitwright_store::StudyId;
use gaitwright_store::feedback::{FeedbackRow, Source};
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::TrialState;
use gaitwright_tests::analytic::Analytic;
use serde_json::json;

/// A study, and a session of it that was planned.
async fn planned(site: &Site) -> (StudyId, String) {
    let study = site.service.study(|new| new.number_of_trials = 6).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let mut gaits = site.service.trials(study).await;
    gaits.retain(|trial| trial.state == TrialState::Converged);
    let pair = json!({"trial_a": gaits[0].id, "trial_b": gaits[1].id});
    let session = site.service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &pair).await.json();
    (study, session["id"].as_str().unwrap().to_owned())
}

/// The answer of the subject, as the learner received it.
async fn subject_answers(site: &Site, study: StudyId) -> Vec<FeedbackRow> {
    let mut rows = site.service.feedback(study).await;
    rows.retain(|row| row.source == Source::Subject);
    rows
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_lab_session_records_walks_and_asks_which_was_better() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let (study, session) = planned(&site).await;
    let page = browser.open(&site.at(&format!("/lab/{session}"))).await;
    page.resize(768, 1024).await;
    for walk in 1..=3 {
        page.wait_until(&format!("document.querySelector('h1').innerText.startsWith('Walk {walk}')")).await;
        // An accidental tap records nothing.
        page.run("document.querySelector('main button').click()").await;
        // A double click records one walk, and the page shows the next one.
        page.run("document.querySelector('main [type=checkbox]').checked = true; const b = document.querySelector('main button'); b.click(); b.click()").await;
    }
    page.wait_until("document.querySelector('h1').innerText === 'Which walk was better?'").await;
    assert_eq!(page.count("[role=alert]:not([hidden])").await, 0);
    for (width, height) in [(390, 844), (768, 1024), (1024, 768)] {
        page.resize(width, height).await;
        let (bottom, ..) = page.lowest(".answers-in-line .answer, details summary").await;
        assert!(bottom <= height as f64, "{width} x {height}: {bottom}");
    }

    // Answers with one touch, retracts the answer, then answers with the keyboard.
    page.become_touch_screen().await;
    page.touch(&page.answer("first").await).await;
    page.wait_for(".notice.good button").await;
    assert!(page.text(".notice.good").await.contains("walk 2, the first with the device, was better"));
    page.click(".notice.good button").await;
    page.answer("second").await;
    page.run("document.querySelector('button[value=second]').focus()").await;
    page.press("Enter").await;
    page.wait_until("document.querySelector('.notice.good')?.textContent.includes('walk 3, the second with the device, was better') ?? false").await;
    page.reload().await;
    assert!(page.text(".notice.good").await.contains("walk 3, the second with the device, was better"));
    assert!(subject_answers(&site, study).await.is_empty(), "the session is still blind");
    page.is_clean(&site.origin).await;

    let page = browser.open(&site.at(&format!("/lab-sessions/{session}"))).await;
    assert!(page.text("main").await.contains("walk 3, the second with the device, was better"));
    page.run("for (const d of document.querySelectorAll('details')) d.open = true").await;
    page.fill("#reason", "every walk was recorded").await;
    page.click("form[action$='/unblind'] button").await;
    page.wait_until("document.querySelector('main').innerText.includes('Unblinded by')").await;
    assert_eq!(subject_answers(&site, study).await.len(), 1);
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    assert!(page.text(".answers").await.contains("the subject, "));
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_lab_session_keeps_the_note_over_a_reload_and_an_outage() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let (_, session) = planned(&site).await;
    let page = browser.open(&site.at(&format!("/lab/{session}"))).await;
    page.fill("#note", "slow at first").await;
    page.reload().await;
    page.wait_until("document.querySelector('#note')?.value === 'slow at first'").await;
    let send =
        "document.querySelector('main [type=checkbox]').checked = true; document.querySelector('main button').click()";
    let site = site
        .restart(Analytic::default(), async |_| {
            page.run(send).await;
            page.wait_for("[data-unsent]:not([hidden])").await;
        })
        .await;
    page.run(send).await;
    page.wait_until("document.querySelector('h1').innerText.startsWith('Walk 2')").await;
    assert_eq!(page.value("document.querySelector('#note').value").await, "", "another walk, another note");
    let walked = site.service.fetch(&format!("/api/v1/lab-sessions/{session}")).await.json();
    assert_eq!(walked["walks"][0]["recorded"]["note"], "slow at first", "{walked}");
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_lab_session_reports_an_unsafe_walk_before_and_after_the_answer() {
    let Some(browser) = Chromium::launch().await else { return };
    for walks in [1, 3] {
        let site = Site::start(Analytic::default()).await;
        let (study, session) = planned(&site).await;
        for walk in 1..=walks {
            site.service.post(&format!("/api/v1/lab-sessions/{session}/walks"), &json!({"walk": walk})).await;
        }
        let page = browser.open(&site.at(&format!("/lab/{session}"))).await;
        if walks == 3 {
            page.click(&page.answer("first").await).await;
            page.wait_for(".notice.good").await;
        }
        page.run("for (const d of document.querySelectorAll('details')) d.open = true").await;
        page.click("details input[value=unsafe_first]").await;
        page.fill("#event", "stumbled at the step").await;
        page.click("details form:has(#event) button").await;
        page.wait_until(
            "document.querySelector('main').innerText.includes('unsafe') && !document.querySelector('#event')",
        )
        .await;
        page.is_clean(&site.origin).await;
        let reports = site.service.fetch(&format!("/api/v1/studies/{study}/safety-reports")).await.items();
        assert_eq!(reports.as_array().unwrap().len(), 2, "either gait may be meant: {reports}");
        let kept = site.service.fetch(&format!("/api/v1/lab-sessions/{session}")).await.text;
        assert!(kept.contains("stumbled at the step"), "{kept}");
    }
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_lab_session_accepts_answers_without_scripts_and_in_two_tabs() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let (study, session) = planned(&site).await;
    for walk in 1..=3 {
        site.service.post(&format!("/api/v1/lab-sessions/{session}/walks"), &json!({"walk": walk})).await;
    }
    let at = site.at(&format!("/lab/{session}"));
    let (plain, other) = (browser.open_without_scripts(&at).await, browser.open(&at).await);
    plain.click_plainly("details:has(#note) summary").await;
    plain.click_plainly("#note").await;
    plain.type_text("stumbled").await;
    plain.click_plainly("details:has([value=unsafe_first]) summary").await;
    plain.click_plainly("button[value=unsafe_first]").await;
    plain.wait_for(".notice.good").await;
    assert!(plain.text(".notice.good").await.contains("walk 2 was unsafe"));
    // The other tab says that its answer was not recorded, and shows the recorded one.
    other.click(&other.answer("second").await).await;
    other.wait_for("[role=alert]:not([data-unsent])").await;
    assert!(other.text(".notice.good").await.contains("walk 2 was unsafe"));
    // Both gaits are unsafe until unblinding shows which one was meant.
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    assert_eq!(page.count(".trials .tag.bad").await, 2);
    assert_eq!(page.count("[data-part=state] [role=alert]").await, 2);
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_staff_report_a_gait_as_unsafe_and_cannot_retract_the_report() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let (study, _) = planned(&site).await;
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    let best = page.text("[data-part=best] a").await;
    let compare = browser.open(&site.at(&format!("/studies/{study}"))).await;
    compare.click("[data-part=answers] a").await;
    // The best gait against another one.
    compare.wait_for("#a").await;
    let choose = format!(
        "const a = document.querySelector('#a'); a.value = [...a.options].find(o => o.text === '{best}').value; \
         const b = document.querySelector('#b'); b.value = [...b.options].find(o => o.text !== '{best}').value; \
         a.form.querySelector('button').click()"
    );
    compare.run(&choose).await;
    compare.wait_until(&format!("document.querySelector('figcaption a')?.innerText === '{best}'")).await;
    compare.fill("#author", "K1").await;
    compare.unfold().await;
    compare.click(&compare.answer("unsafe_a").await).await;
    compare.wait_for(".notice.good").await;
    assert!(compare.text(".notice.good").await.contains(&format!("{best} was reported as unsafe")));
    // The study page updates without reloading, and recommends another gait.
    page.wait_for("[data-part=state] [role=alert]").await;
    page.wait_until(&format!("document.querySelector('[data-part=best] a').innerText !== '{best}'")).await;
    assert_eq!(page.count(".trials .tag.bad").await, 1);

    assert_eq!(compare.count(".notice.good details").await, 0, "a safety report is reviewed, and not retracted");
    assert!(compare.text(".notice.good").await.contains("Staff will review it"));
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_staff_review_a_safety_report() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let (study, _) = planned(&site).await;
    let watched = browser.open(&site.at(&format!("/studies/{study}"))).await;
    let best = watched.text("[data-part=best] a").await;
    let trials = site.service.trials(study).await;
    let gait = trials.iter().find(|trial| format!("trial {}", trial.number) == best).unwrap().id;
    let other = trials.iter().find(|trial| trial.state == TrialState::Converged && trial.id != gait).unwrap().id;
    let assessment = json!({"trial_a": gait, "trial_b": other, "answer": "unsafe_a", "author": "R7"});
    site.service.post(&format!("/api/v1/studies/{study}/assessments"), &assessment).await;
    watched.wait_until(&format!("document.querySelector('[data-part=best] a').innerText !== '{best}'")).await;

    // From the home page to the decision.
    let page = browser.open(&site.at("/")).await;
    assert!(page.text("main").await.contains("1 gait reported as unsafe"));
    page.click("#waits ~ ul a").await;
    page.wait_for("[data-part=state] [role=alert] a[href$='#safety-review']").await;
    page.click("[data-part=state] [role=alert] a[href$='#safety-review']").await;
    page.wait_for("#safety-review input[value=cleared]").await;
    page.click("#safety-review input[value=cleared]").await;
    page.fill("#author", "K1").await;
    page.fill("#reason", "walked slowly, with a harness").await;
    page.click("#safety-review button").await;
    page.wait_until("document.querySelector('#safety-review') === null").await;
    assert!(page.text("main").await.contains("cleared the gait for walking"));
    assert_eq!(page.count("main [role=alert]").await, 0);
    watched.wait_until(&format!("document.querySelector('[data-part=best] a').innerText === '{best}'")).await;
    assert_eq!(watched.count(".trials .tag.bad").await, 0);
    page.is_clean(&site.origin).await;
    watched.is_clean(&site.origin).await;
    browser.close().await;
}
