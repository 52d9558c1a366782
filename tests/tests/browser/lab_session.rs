//! A whole lab session in the browser: planned, walked, answered, closed and unblinded.

use crate::axe::Axe;
use crate::chromium::{Chromium, Tab};
use crate::site::Site;
use gaitwright_store::lab_sessions;
use gaitwright_store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;

/// The findings of axe-core on the current page, if axe-core is installed.
async fn is_for_everybody(axe: Option<&Axe>, page: &Tab, what: &str) {
    if let Some(axe) = axe {
        let complaints = axe.complaints(page).await;
        assert!(complaints.is_empty(), "{what}: {}", complaints.join("\n"));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_completes_a_lab_session_from_plan_to_unblinding() {
    let Some(browser) = Chromium::launch().await else { return };
    let axe = Axe::find();
    let axe = axe.as_ref();
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 6).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;

    // Planned from the page of the study. The allocation is concealed.
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    page.click("main a[href$='/lab']").await;
    page.wait_for("#trial_a").await;
    is_for_everybody(axe, &page, "no session yet").await;
    page.fill("#notes", "treadmill, 1.1 m/s").await;
    page.click("form[action$='/lab'] button[type=submit]").await;
    page.wait_until("document.querySelector('h1').innerText === 'Lab session 1'").await;
    assert!(page.text("main").await.contains("treadmill, 1.1 m/s"));
    assert_eq!(page.text("main table").await.matches("one of the two gaits (blinded)").count(), 2);
    assert_eq!(page.text(".heading .state").await, "planned");
    is_for_everybody(axe, &page, "planned").await;
    let at = page.address().await;

    // Walked: the page in the lab shows only the numbers of walks.
    page.click("main a[href^='/lab/']").await;
    for walk in 1..=3 {
        page.wait_until(&format!("document.querySelector('h1').innerText.startsWith('Walk {walk}')")).await;
        is_for_everybody(axe, &page, "a walk").await;
        page.fill("#note", &format!("note of walk {walk}")).await;
        page.click("main [type=checkbox]").await;
        page.click("main form button").await;
    }
    page.wait_until("document.querySelector('h1').innerText === 'Which walk was better?'").await;
    assert!(!page.text("main").await.contains("trial"));
    is_for_everybody(axe, &page, "the question").await;
    page.unfold().await;
    page.fill("#note", "softer at the heel").await;
    page.click(&page.answer("second").await).await;
    page.wait_until("document.querySelector('.notice.good')?.innerText.includes('walk 3, the second with the device, was better') ?? false").await;
    is_for_everybody(axe, &page, "answered").await;
    page.is_clean(&site.origin).await;

    // Closed, then unblinded.
    let page = browser.open(&at).await;
    for walk in 1..=3 {
        assert!(page.text("main table").await.contains(&format!("note of walk {walk}")));
    }
    let main = page.text("main").await;
    assert!(
        main.contains("softer at the heel")
            && main.contains("The study will use this answer once the session is unblinded"),
        "{main}"
    );
    page.run("for (const d of document.querySelectorAll('details')) d.open = true").await;
    page.fill("#closing", "all walked").await;
    page.click("form[action$='/close'] button").await;
    page.wait_until("document.querySelector('.heading .state').innerText === 'closed'").await;
    assert!(page.text("main table").await.contains("one of the two gaits (blinded)"));
    is_for_everybody(axe, &page, "closed").await;
    page.run("for (const d of document.querySelectorAll('details')) d.open = true").await;
    page.fill("#reason", "every walk was recorded").await;
    page.click("form[action$='/unblind'] button").await;
    page.wait_until("document.querySelector('main').innerText.includes('Unblinded by')").await;
    assert!(!page.text("main table").await.contains("blinded"));
    is_for_everybody(axe, &page, "told").await;

    // The study has the preference for the gait of walk 3, and its page shows it.
    let session = lab_sessions::of_study(&mut site.service.store.read().await.unwrap(), study).await.unwrap().remove(0);
    let (second, third) = session.walked().unwrap();
    let trials = site.service.trials(study).await;
    let number = |id| trials.iter().find(|trial| trial.id == id).unwrap().number;
    page.click(".crumbs a[href^='/studies/']").await;
    page.wait_for(".answers").await;
    let expected = format!("trial {} is better than trial {}", number(third), number(second));
    assert!(page.text(".answers").await.contains(&expected), "{}", page.text(".answers").await);
    page.is_clean(&site.origin).await;
    browser.close().await;
}
