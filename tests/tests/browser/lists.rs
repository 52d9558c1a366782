//! Lists of studies and of users in the browser: searching, archiving, sign-in links, disabling a user, local times.

use crate::axe::Axe;
use crate::chromium::Chromium;
use crate::site::Site;
use gaitwright_store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;

#[tokio::test(flavor = "multi_thread")]
async fn browser_renames_finds_and_archives_a_study() {
    let Some(browser) = Chromium::launch().await else { return };
    let axe = Axe::find();
    let site = Site::start(Analytic::default()).await;
    let page = browser.open(&site.at("/")).await;
    page.click("form[action='/studies/sample'] button").await;
    page.wait_for("[data-part=state] .state.finished").await;
    let study = page.address().await.rsplit('/').next().unwrap().to_owned();
    site.service.wait_for(study.parse().unwrap(), &[StudyState::Finished]).await;
    let page = browser.open(&site.at(&format!("/studies/{study}/details"))).await;
    page.run("document.querySelector('#name').value = ''").await;
    page.fill("#name", "Visit 3").await;
    page.fill("#tags", "pilot").await;
    page.click("button[value=save]").await;
    page.wait_until("document.querySelector('.notice.good')?.innerText === 'Saved.'").await;
    assert_eq!(page.value("document.querySelector('#name').value").await, "Visit 3");
    let page = browser.open(&site.at("/")).await;
    page.fill("[name=text]", "visit").await;
    page.click(".filter button").await;
    page.wait_until("location.search.includes('text=visit')").await;
    assert!(page.text("table.studies").await.contains("Visit 3"));
    // Times are local, and their title has the time zone.
    page.wait_until("document.querySelector('table time').title.includes('UTC')").await;
    assert!(page.text("main").await.contains("Times are in your time zone."));
    if let Some(axe) = &axe {
        assert_eq!(axe.complaints(&page).await, Vec::<String>::new());
    }
    let page = browser.open(&site.at(&format!("/studies/{study}/details"))).await;
    page.click("button[value=archive]").await;
    page.wait_for("button[value=restore]").await;
    page.is_clean(&site.origin).await;
    let page = browser.open(&site.at("/")).await;
    assert!(!page.text("main").await.contains("Visit 3"));
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_shows_a_sign_in_link_as_qr_code_and_asks_before_disabling_a_user() {
    let Some(browser) = Chromium::launch().await else { return };
    let axe = Axe::find();
    let site = Site::start(Analytic::default()).await;
    let page = browser.open(&site.at("/users")).await;
    page.fill("#user-name", "Ada").await;
    page.click("button[value=add_user]").await;
    page.wait_for("svg.qr").await;
    page.wait_until("document.querySelector('.notice button')?.innerText === 'Copy'").await;
    if let Some(axe) = &axe {
        assert_eq!(axe.complaints(&page).await, Vec::<String>::new());
    }
    assert_eq!(page.value("String(document.querySelector('button[value=disable]').checkVisibility())").await, "false");
    page.click(".confirm summary").await;
    assert!(page.text(".confirm").await.contains("This ends the sessions, links and tokens of Ada."));
    page.click("button[value=disable]").await;
    page.wait_until("document.querySelector('#users tbody').innerText.includes('disabled')").await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}
