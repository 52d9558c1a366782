//! Signing in, and administration.

use crate::chromium::Chromium;
use crate::site::Site;
use gaitwright_http::AccessState;
use gaitwright_service::access::user_administration::{self, NewUser};
use gaitwright_service::access::{Role, secret};
use gaitwright_service::studies::membership::{self, NewMember};
use gaitwright_store::audit::Actor;
use gaitwright_store::commit;
use gaitwright_store::members::MemberKind;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_tests::analytic::Analytic;
use std::sync::Arc;

/// A service that requires sign-in, and the link of its first administrator.
async fn guarded() -> (Site, String) {
    let site = Site::start_with(Analytic::default(), |service| {
        service.access = Arc::new(AccessState::by_sign_in(3600.0));
    })
    .await;
    let mut writer = site.service.store.write().await.unwrap();
    let new = NewUser { name: "Ada".to_owned(), role: Role::Administrator };
    let user = user_administration::add(&mut writer, &Actor::program(), &new).await.unwrap();
    let link = user_administration::link(&mut writer, &Actor::program(), user.id).await.unwrap();
    commit(writer).await.unwrap();
    (site, link)
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_signs_in_by_link_then_by_password() {
    let Some(browser) = Chromium::launch().await else { return };
    let (site, link) = guarded().await;
    let page = browser.open(&site.origin).await;
    page.wait_for("#password").await;
    assert!(page.address().await.ends_with("/sign-in"));
    page.goto(&site.at(&format!("/sign-in/{link}"))).await;
    page.click("main button").await;
    page.wait_for("a[href='/studies/new']").await;
    // The link cannot be used again, so the page asks for a password to be set.
    page.click("main .notice a[href='/account']").await;
    page.wait_for("#password").await;
    assert_eq!(
        page.value("[...document.querySelectorAll('main input')].filter(e => e.checkVisibility()).length").await,
        "1"
    );
    page.fill("#password", "correct horse battery").await;
    page.click("main form[action='/account'] button").await;
    page.wait_for(".notice.good").await;
    page.click("form[action='/sign-out'] button").await;
    page.wait_for("#name").await;
    page.fill("#name", "Ada").await;
    page.fill("#password", "correct horse battery").await;
    page.click("main button").await;
    page.wait_for("a[href='/studies/new']").await;
    assert_eq!(page.count("main .notice").await, 0);
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_administrator_adds_a_rater_and_a_token_and_reads_the_audit_trail() {
    let Some(browser) = Chromium::launch().await else { return };
    let (site, link) = guarded().await;
    let page = browser.open(&site.at(&format!("/sign-in/{link}"))).await;
    page.click("main button").await;
    page.click("nav a[href='/system']").await;
    page.click("form[action='/system/backup'] button").await;
    page.wait_for(".notice.good code").await;
    page.click("main a[href='/users']").await;
    page.wait_for("#user-name").await;
    page.fill("#user-name", "R1").await;
    page.click("button[value=add_user]").await;
    page.wait_for(".secret").await;
    let link = page.text(".secret").await;
    assert!(link.starts_with(&site.at("/sign-in/")), "{link}");
    page.fill("#token-name", "treadmill").await;
    page.click("button[value=make_token]").await;
    page.wait_until("document.querySelector('.secret')?.textContent.startsWith('gait_') ?? false").await;
    // The same name is refused with a reason.
    page.fill("#token-name", "treadmill").await;
    page.click("button[value=make_token]").await;
    page.wait_for(".notice.bad").await;
    page.goto(&site.at("/audit?verify=true")).await;
    page.wait_for(".notice.good").await;
    let rows = page.text("tbody").await;
    assert!(["token: make", "user: add", "backup: complete"].iter().all(|row| rows.contains(row)), "{rows}");
    // The rater sees comparisons and nothing else.
    page.goto(&link).await;
    page.click("main button").await;
    page.wait_for("main h1").await;
    page.wait_until("location.pathname === '/rate'").await;
    assert_eq!(page.count("nav").await, 0);
    // Without a password the rater could not sign in again, so the page warns in time.
    page.click("main .notice a[href='/account']").await;
    page.wait_for("#password").await;
    assert_eq!(page.value("[...document.querySelectorAll('nav a')].map(a => a.pathname).join()").await, "/rate");
    // Pages for staff redirect raters to their own page.
    page.goto(&site.at("/studies/new")).await;
    page.click("main a").await;
    page.wait_until("location.pathname === '/rate'").await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_sends_an_answer_after_the_session_ended() {
    let Some(browser) = Chromium::launch().await else { return };
    let (site, _) = guarded().await;
    let study = site.service.study(|new| (new.number_of_trials, new.answer_source) = (3, AnswerSource::People)).await;
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    let mut writer = site.service.store.write().await.unwrap();
    let new = NewUser { name: "R1".to_owned(), role: Role::Rater };
    let rater = user_administration::add(&mut writer, &Actor::program(), &new).await.unwrap();
    let hashed = secret::hash_password("correct horse battery").unwrap();
    user_administration::set_password(&mut writer, &Actor::program(), rater.id, &hashed).await.unwrap();
    let member = NewMember { kind: MemberKind::User, name: "R1".to_owned() };
    membership::add(&mut writer, &Actor::program(), study, &member).await.unwrap();
    commit(writer).await.unwrap();

    let page = browser.open(&site.at("/sign-in")).await;
    let sign_in = async || {
        page.fill("#name", "R1").await;
        page.fill("#password", "correct horse battery").await;
        page.click("main form button").await;
    };
    sign_in().await;
    page.click("main form[action^='/rate/'] button").await;
    let button = page.answer("no_difference").await;
    page.unfold().await;
    page.fill("#note", "both fine").await;
    page.forget_cookies().await;
    page.click(&button).await;
    page.wait_for("#password").await;
    assert!(page.text("main").await.contains("Your entry was not saved"));
    sign_in().await;
    page.wait_until("document.querySelector('h1').textContent === 'Send your entry'").await;
    page.click("main form button").await;
    page.wait_for(".notice.good").await;
    let feedback = site.service.feedback(study).await;
    assert_eq!(
        feedback.iter().filter(|row| (row.author.as_str(), row.note.as_str()) == ("R1", "both fine")).count(),
        1
    );
    browser.close().await;
}
