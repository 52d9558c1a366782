//! Studies: creation, progress, answers, and the page of the learner.

use crate::chromium::Chromium;
use crate::site::Site;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::large;
use gaitwright_tests::users;
use std::path::PathBuf;
use std::time::Duration;

#[tokio::test(flavor = "multi_thread")]
async fn browser_starts_a_study_with_three_clicks_and_follows_it_to_its_end() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::slow(Duration::from_millis(15))).await;
    let page = browser.open(&site.origin).await;
    page.click("a.button").await;
    page.wait_for("#number_of_trials").await;
    page.fill("#number_of_trials", "3").await;
    page.click("button[type=submit]").await;
    // The page follows the study by itself.
    page.wait_for(".running[data-trial]").await;
    page.wait_for("[data-part=state] .state.finished").await;
    page.wait_until("document.querySelectorAll('.trials tbody tr').length === 3").await;
    assert!(!page.text("#trials").await.contains("No trials yet") && page.count("#trials form.filter").await == 1);
    assert_eq!(page.count("[data-part=history] svg.chart").await, 1);
    // The recommendation can be downloaded.
    let bounds =
        "document.querySelector('[data-part=best] a[download][href*=\"recommendation?\"]').getAttribute('href')";
    let bounds = page.value(bounds).await;
    let told = site.service.fetch(&bounds).await.json();
    assert!(told["bounds"]["a1"].is_number() && told["gait_rmse_rad"].is_number(), "{told}");
    page.click("[data-part=best] a.button[href^='/trials/']").await;
    page.wait_for(".walker svg.gait-walker").await;
    page.wait_for("[data-phase]").await;
    assert!(page.count("svg.chart").await >= 12);
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_shows_the_recommended_gait_of_a_finished_study_walking_above_the_fold() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 6).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let best = site.service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await.json();
    let address = site.at(&format!("/studies/{study}"));
    let page = browser.open(&address).await;
    page.resize(1280, 800).await;
    page.wait_for(".outcome [data-phase]").await;
    assert_eq!(page.value("document.querySelector('.outcome [data-trial]').dataset.trial").await, best["trial_id"]);
    let (bottom, _, height) = page.lowest(".outcome svg.gait-walker").await;
    assert!(bottom <= 800.0 && height >= 300.0, "{bottom} {height}");
    let (bottom, ..) = page.lowest(".outcome [data-part=best] a").await;
    assert!(bottom <= 800.0, "{bottom}");
    let phase = "document.querySelector('.outcome [data-phase]').textContent";
    let before = page.value(phase).await;
    page.wait_until(&format!("{phase} !== {before:?}")).await;
    // The sentence about certainty states what the recommendation says.
    let sure = page.text("[data-part=best]").await;
    assert!(sure.contains("The recommended gait has the lowest Gait RMSE of"), "{sure}");
    // Another gait walks once this one is reported as unsafe.
    let report = format!("/api/v1/trials/{}/safety-reports", best["trial_id"].as_str().unwrap());
    assert!(site.service.post(&report, &serde_json::json!({"note": "fell"})).await.status.is_success());
    let other = site.service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await.json();
    let shown = "document.querySelector('.outcome [data-trial]')?.dataset.trial";
    page.wait_until(&format!("{shown} === {:?}", other["trial_id"].as_str().unwrap())).await;
    page.wait_for(".outcome fieldset:enabled [data-phase]").await;
    let before = page.value(phase).await;
    page.wait_until(&format!("{phase} !== {before:?}")).await;
    page.is_clean(&site.origin).await;
    let plain = browser.open_without_scripts(&address).await;
    assert_eq!(plain.count(".outcome svg.gait-walker").await, 1);
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_follows_a_running_solve() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::slow(Duration::from_millis(400))).await;
    let study = site.service.study(|new| new.number_of_trials = 1).await;
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    page.wait_for(".running [data-chart] svg.chart").await;
    let text = "document.querySelector('.running [data-text]')?.textContent ?? ''";
    let drawing = "document.querySelector('.running .chart .line')?.getAttribute('d') ?? ''";
    let (early, drawn) = (page.value(text).await, page.value(drawing).await);
    // Folded away until somebody wants to see it.
    assert_eq!(page.value("document.querySelector('.running svg.chart').checkVisibility()").await, "false");
    page.wait_until(&format!("({text}) !== {early:?} && ({drawing}) !== {drawn:?}")).await;
    page.wait_for("[data-part=state] .state.finished").await;
    assert_eq!(page.count(".running").await, 0);
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_shows_the_best_gait_so_far_of_a_running_study_and_the_time_left() {
    let Some(browser) = Chromium::launch().await else { return };
    // Slow enough for the page to be open before the first result.
    let site = Site::start(Analytic::slow(Duration::from_millis(150))).await;
    let study = site.service.study(|new| new.number_of_trials = 200).await;
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    page.resize(1280, 800).await;
    assert!(
        page.text("[data-walker]")
            .await
            .contains("An animation of the recommended gait appears here after the first converged trial")
    );
    assert!(page.text("[data-part=state]").await.contains("The time left can be estimated after 3 more solves."));
    // Progress and the place of the best gait lead; the solve that runs is one line.
    page.wait_for(".running").await;
    let (bottom, ..) = page.lowest("progress, .running p").await;
    assert!(bottom <= 420.0, "{bottom}");
    // The first gait walks without a reload, and the better one after it.
    page.run("window.same = true").await;
    page.wait_for(".outcome fieldset:enabled [data-phase]").await;
    let shown = "document.querySelector('.outcome [data-trial]').dataset.trial";
    let first = page.value(shown).await;
    page.wait_until(&format!("{shown} !== {first:?}")).await;
    page.wait_for(".outcome fieldset:enabled [data-phase]").await;
    page.wait_until("/^About .+ left for \\d+ trials/m.test(document.querySelector('[data-part=state]').innerText)")
        .await;
    assert_eq!(page.value("window.same ?? false").await, "true");
    let (bottom, ..) = page.lowest(".outcome svg.gait-walker").await;
    assert!(bottom <= 800.0, "{bottom}");
    page.is_clean(&site.origin).await;
    // Before its first result a study is estimated from earlier ones.
    let fresh = site.service.study(|new| new.number_of_trials = 8).await;
    let page = site.service.fetch(&format!("/studies/{fresh}")).await.text;
    assert!(page.contains(" left for 8 trials; half of the earlier solves here took less than "), "{page}");
    // An estimate that can never come is not announced.
    let site = Site::start(Analytic::slow(Duration::from_millis(400))).await;
    let short = site.service.study(|new| new.number_of_trials = 2).await;
    let page = site.service.fetch(&format!("/studies/{short}")).await.text;
    assert!(!page.contains("can be estimated"), "{page}");
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_leads_with_the_comparison_that_waits_and_draws_the_utility_over_the_answers() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| (new.number_of_trials, new.answer_source) = (12, AnswerSource::People)).await;
    for _ in 0..4 {
        users::answer_once(&site.service, study).await;
    }
    users::asked(&site.service, study).await;
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    page.resize(1280, 800).await;
    // The first button of the page.
    assert_eq!(page.text("main .button").await, "Answer the comparison");
    let (bottom, ..) = page.lowest(".lead .button").await;
    assert!(bottom <= 400.0, "{bottom}");
    let chart = "[data-part=history] svg.chart[data-along='utility, no unit']";
    assert_eq!(page.count(&format!("{chart} .dot")).await, 4);
    assert_eq!(
        (page.count(&format!("{chart} .band")).await, page.count("[data-part=history] svg.chart").await),
        (1, 1)
    );
    assert_eq!(page.count("[data-part=progress] svg.chart").await, 1);
    // The same figures as on the page Analysis.
    let sentence = "document.querySelector('[data-part=best] table').previousElementSibling.textContent.match(/\\d+\\s%/)?.[0].replace(/\\s/, ' ')";
    let sure = page.value(sentence).await;
    assert!(
        page.text("[data-part=best]").await.contains("After 4 comparisons, the learner is")
            || page.text("[data-part=best]").await.contains("after 4 comparisons, the learner is only")
    );
    let analysis = browser.open(&site.at(&format!("/studies/{study}/analysis"))).await;
    assert!(analysis.text("#best tbody tr:nth-child(2)").await.contains(&sure), "{sure}");
    // A new answer adds a point without a reload.
    users::answer_once(&site.service, study).await;
    page.wait_until(&format!("document.querySelectorAll(`{chart} .dot`).length === 5")).await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_reaches_each_section_of_a_study_from_its_index_with_the_keyboard() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 4).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    let order = "[...document.querySelectorAll('nav.index a')].map(a => document.querySelector(a.getAttribute('href')).offsetTop)";
    assert_eq!(page.value(&format!("{order}.length")).await, "6");
    let in_order = format!("{order}.every((top, i, all) => i === 0 || all[i - 1] < top)");
    assert_eq!(page.value(&in_order).await, "true", "sections stand in the order of the index");
    for name in ["trials", "answers", "analysis", "figures", "lab", "export"] {
        page.run(&format!("document.querySelector('nav.index a[href=\"#{name}\"]').focus()")).await;
        page.press("Enter").await;
        page.wait_until(&format!("location.hash === '#{name}'")).await;
        let seen = format!(
            "(() => {{ const r = document.querySelector('#{name} h2').getBoundingClientRect(); return r.top >= 0 && r.bottom <= innerHeight }})()"
        );
        page.wait_until(&seen).await;
    }
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_updates_do_not_overwrite_edited_fields() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 6).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    page.wait_for("#more").await;
    page.run("document.querySelector('#more').closest('details').open = true").await;
    page.fill("#more", "67").await;
    page.run("window.field = document.querySelector('#more')").await;
    let mut gaits = site.service.trials(study).await;
    gaits.retain(|trial| trial.state == gaitwright_store::trials::TrialState::Converged);
    let assessment =
        serde_json::json!({"trial_a": gaits[0].id, "trial_b": gaits[1].id, "answer": "unsafe_a", "author": "K1"});
    site.service.post(&format!("/api/v1/studies/{study}/assessments"), &assessment).await;
    page.wait_for("[data-part=state] [role=alert]").await;
    let typed = "`${window.field.value} ${document.querySelector('#more') === window.field}`";
    assert_eq!(page.value(typed).await, "67 true");
    assert_eq!(page.value("document.activeElement === window.field").await, "true");
    assert_eq!(page.count("[data-part=state] progress").await, 1);
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_sorts_and_filters_trials_with_and_without_scripts() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 40).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let errors =
        "[...document.querySelectorAll('.trials tbody tr')].map(r => r.cells[2].textContent).filter(t => t !== '–')";
    let sorted = format!(
        "(() => {{ const e = {errors}; return e.every((v, i) => i === 0 || Number(e[i - 1]) <= Number(v)) }})()"
    );
    let rows = "document.querySelectorAll('.trials tbody tr').length";
    let by_error = ".trials thead a[href*='sort=gait_rmse_rad']";

    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    assert_eq!(page.value(&sorted).await, "false", "by number at first");
    page.click(by_error).await;
    page.wait_for("th[aria-sort=ascending] a[href*='sort=gait_rmse_rad']").await;
    assert_eq!(page.value(&sorted).await, "true");
    let all: usize = page.value(rows).await.parse().unwrap();
    page.run(
        "const s = document.querySelector('select[name=state]'); s.value = 'not_converged'; \
              s.dispatchEvent(new Event('input', { bubbles: true }))",
    )
    .await;
    page.wait_until(&format!("{rows} < {all} && {rows} > 0")).await;
    assert_eq!(page.value("document.querySelectorAll('.trials .state:not(.not_converged)').length").await, "0");
    // The address contains the selection, so that it can be shared.
    assert!(page.value("location.search").await.contains("state=not_converged"));
    page.is_clean(&site.origin).await;

    let plain = browser
        .open_without_scripts(&site.at(&format!("/studies/{study}?sort=gait_rmse_rad&order=ascending&state=converged")))
        .await;
    assert_eq!(plain.value(&sorted).await, "true");
    assert_eq!(plain.value("document.querySelectorAll('.trials .state:not(.converged)').length").await, "0");
    let refused = site.service.fetch(&format!("/studies/{study}?sort=shoe_size")).await;
    assert!(refused.status.is_client_error() && refused.text.contains("gait_rmse_rad"), "{}", refused.text);
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_remembers_the_columns_of_trials_and_shows_few_of_them_on_a_phone() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 5).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let address = site.at(&format!("/studies/{study}"));
    let shown =
        "[...document.querySelectorAll('.trials tbody tr:first-child > *')].filter(cell => cell.offsetParent).length";
    let fits = "(() => { const box = document.querySelector('#trials .scroll'); return box.scrollWidth <= box.clientWidth + 1 })()";

    let plain = browser.open_without_scripts(&address).await;
    assert_eq!((plain.value(shown).await.as_str(), plain.count("[data-columns]:not([hidden])").await), ("16", 0));
    plain.resize(390, 844).await;
    assert_eq!((plain.value(shown).await.as_str(), plain.value(fits).await.as_str()), ("4", "true"));

    let page = browser.open(&address).await;
    page.wait_for("[data-columns]:not([hidden])").await;
    assert_eq!(page.value(shown).await, "16");
    page.click("[data-columns] summary").await;
    for column in ["iterations", "reason"] {
        page.click(&format!("[data-columns] input[value={column}]")).await;
    }
    assert_eq!(page.value(shown).await, "14");
    page.goto(&address).await;
    page.wait_until(&format!("{shown} === 14")).await;
    let hidden = "[...document.querySelectorAll('.trials thead th')].filter(th => !th.offsetParent).map(th => th.textContent.trim()).join()";
    assert_eq!(page.value(hidden).await, "Iterations,Reason");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_shows_the_posterior_and_the_warm_start_tree() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 8).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let page = browser.open(&site.at(&format!("/studies/{study}/analysis?x=a5&y=a6"))).await;
    assert_eq!(page.count("#marginals svg.chart .band").await, 8);
    // Four clearances by six leans, twice.
    assert_eq!(page.count("#maps svg.map .cell").await, 48);
    assert_eq!(page.count("#maps svg.map .framed").await, 2);
    // The recommended gait is the first row, and the means fall.
    let recommended = site.service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await.json();
    assert_eq!(page.text("#best tbody tr:first-child a").await, recommended["number"].to_string(), "{recommended}");
    assert!(page.text("#best tr.best").await.contains("recommended"));
    let means = "[...document.querySelectorAll('#best tbody tr')].map(r => Number(r.cells[2].textContent.split(' ')[0].replace('\u{2212}', '-')))";
    assert_eq!(page.value(&format!("{means}.every((mean, i, all) => i === 0 || mean <= all[i - 1])")).await, "true");
    // Where Gait RMSE answers, it decides, and not the analysis beside it.
    let by_rmse = "[...document.querySelectorAll('#best tbody tr')].slice(1).every((row, i, all) => \
        row.cells[1].textContent === (Number(row.cells[3].textContent) > Number(document.querySelector('#best tr.best').cells[3].textContent) \
        ? 'yes, by Gait RMSE' : 'no, by Gait RMSE'))";
    assert_eq!(page.value(by_rmse).await, "true");
    let bars = "[...document.querySelectorAll('#main-effects rect')].map(bar => bar.width.baseVal.value)";
    assert_eq!(
        page.value(&format!(
            "{bars}.length === 8 && {bars}[0] > 0 && {bars}.every((v, i, all) => i === 0 || v <= all[i - 1])"
        ))
        .await,
        "true"
    );
    // One legend for all charts of the marginals.
    assert_eq!((page.count("#marginals .legend.shared span").await, page.count("#marginals figcaption").await), (2, 0));
    // Each dot links to its trial.
    let results = site.service.trials(study).await.iter().filter(|trial| trial.state.is_result()).count();
    assert_eq!(page.count("#every-trial svg.parallel a").await, results);
    let dots = page.count("#maps svg.chart:not(.map) a circle.dot").await;
    assert!(dots > 4, "{dots}");
    page.run("document.querySelector('#maps svg.chart:not(.map) a').id = 'dot'").await;
    let trial = page.value("document.querySelector('#dot').getAttribute('href')").await;
    // Answers that the learner agrees with are no surprise.
    let doubted = "[...document.querySelectorAll('#answers tbody td:last-child')].every(cell => parseInt(cell.textContent) <= 50)";
    assert_eq!(page.value(doubted).await, "true");
    page.is_clean(&site.origin).await;
    let wrong = site.service.fetch(&format!("/studies/{study}/analysis?x=a5&y=a5")).await;
    assert!(wrong.status.is_client_error(), "{}", wrong.status);
    page.click("#dot circle").await;
    page.wait_until(&format!("location.pathname === {trial:?}")).await;

    let other = site.service.study(|new| (new.number_of_trials, new.muscles) = (4, false)).await;
    site.service.wait_for(other, &[StudyState::Finished]).await;
    let page = browser.open(&site.at(&format!("/studies/compare?study={study}&study={other}"))).await;
    page.resize(1280, 800).await;
    let (bottom, ..) = page.lowest(".headline, .beside svg.chart, .beside svg.gait-walker").await;
    assert!(bottom <= 800.0, "{bottom}");
    assert_eq!(page.count("svg.chart path.line").await, 2);
    assert!(page.text(".sides").await.contains("without muscles"));
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    assert_eq!(page.count("svg.tree circle").await, 8);
    assert!(page.count("svg.tree .branch").await >= 1);
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_checks_the_new_study_form_during_input() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let page = browser.open(&site.at("/studies/new")).await;
    page.wait_until("document.querySelector('[data-outlook]').textContent.includes('11\u{202f}664')").await;
    page.wait_for("[data-reference] figure svg").await;
    let matcher = page.text("[data-reference]").await;
    assert!(matcher.contains("nearer") || matcher.contains("nearest"), "{matcher}");
    page.fill("#number_of_trials", "many").await;
    page.wait_for("#number_of_trials[aria-invalid=true]").await;
    page.wait_for("[data-outlook].bad").await;
    page.fill("#number_of_trials", "2").await;
    // A refused field is shown, even if its section was collapsed.
    page.run("document.querySelector('#seed').value = 'x'").await;
    page.fill("#name", "a seed that is none").await;
    page.wait_for("details[open] #seed[aria-invalid=true]").await;
    page.run("document.querySelector('#seed').value = '1'").await;
    page.run("document.querySelector('.editor').closest('details').open = true; \
              for (const box of document.querySelectorAll('.editor [type=checkbox]')) box.checked = box.name === 'tuned_a5'")
        .await;
    page.fill("[name=values_a5]", "0, 0.02").await;
    page.wait_until("document.querySelector('[data-outlook]').textContent.includes('2 of 2')").await;
    assert_eq!(page.count("[aria-invalid]").await, 0);
    // The check created nothing.
    assert_eq!(site.service.fetch("/api/v1/studies").await.items().as_array().unwrap().len(), 0);
    page.click("button[type=submit]").await;
    page.wait_for("[data-part=state] .state.finished").await;
    let studies = site.service.fetch("/api/v1/studies").await.items();
    assert_eq!(studies[0]["search_space"]["dimensions"].as_array().map(Vec::len), Some(1), "{studies}");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_answers_a_comparison_with_the_keyboard_and_without_scripts() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| (new.number_of_trials, new.answer_source) = (3, AnswerSource::People)).await;
    site.service.wait_for(study, &[StudyState::Waiting]).await;

    // The home page has the queue.
    let page = browser.open(&site.origin).await;
    page.click("[aria-labelledby=waits] a").await;
    // Both gaits walk, on one clock.
    page.wait_for(".walker [data-play]").await;
    assert_eq!(page.count(".walker svg.gait-walker").await, 2);
    let drawn =
        "[...document.querySelectorAll('.walker [data-segment]')].map(part => part.getAttribute('transform')).join()";
    let before = page.value(drawn).await;
    page.wait_until(&format!("{drawn} !== {before:?}")).await;
    page.answer("no_difference").await;
    // Without a name nothing is sent, and Enter in the field of the name answers nothing.
    page.press("2").await;
    page.wait_until("document.activeElement?.id === 'author'").await;
    page.type_text("K1").await;
    page.press("Enter").await;
    page.wait_until("!document.querySelector('details.person').open").await;
    assert!(page.text("details.person summary").await.ends_with("the subject, K1"));
    assert_eq!(site.service.feedback(study).await.iter().filter(|row| row.author == "K1").count(), 0);
    page.run("document.activeElement.blur()").await;
    page.press("2").await;
    page.wait_for(".notice.good").await;
    let said = page.text(".notice.good").await;
    assert!(said.contains("no difference between trial"), "{said}");
    // The next comparison comes by itself, and the name is not asked again.
    page.answer("a").await;
    assert!(page.text(".notice.good").await.contains("The next comparison is below"));
    assert!(page.text("details.person summary").await.ends_with("the subject, K1"));
    assert_eq!(page.value("document.querySelector('details.person').open").await, "false");

    while site.service.trials(study).await.len() < 3 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    let plain = browser.open_without_scripts(&site.at(&format!("/studies/{study}/compare"))).await;
    // Each answer stands under the pictures of its gait, and each label is shown once.
    plain.resize(1280, 800).await;
    let (bottom, ..) = plain.lowest(".motions .answer").await;
    assert!(bottom <= 800.0, "{bottom}");
    let shown = "[...document.querySelectorAll('figcaption')].filter((label) => label.checkVisibility()).length";
    assert_eq!(plain.value(shown).await, "2");
    plain.click_plainly("#author").await;
    plain.type_text("K2").await;
    // Enter presses the first button of the form, which answers nothing.
    plain.press("Enter").await;
    plain.wait_for("[role=alert]:not([data-unsent])").await;
    assert!(plain.text("[role=alert]").await.contains("one of the answers on the form"));
    plain.click_plainly("button[value=b]").await;
    plain.wait_for(".notice.good").await;
    // Undone on the next page, and given again.
    plain.click_plainly(".notice.good [data-undo] button").await;
    plain.wait_until("location.search.includes('&a=')").await;
    plain.wait_for(".motions .answer").await;
    let undone = site.service.feedback(study).await.into_iter().find(|row| row.author == "K2").unwrap();
    assert_eq!(undone.retraction.unwrap().reason, "undone immediately after answering");
    plain.click_plainly("#author").await;
    plain.type_text("K2").await;
    plain.click_plainly("button[value=b]").await;
    plain.wait_for(".notice.good [data-undo]").await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    assert_eq!(site.service.feedback(study).await.iter().filter(|row| row.author.starts_with('K')).count(), 3);
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_receives_trial_events_after_a_service_restart() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::slow(Duration::from_millis(60))).await;
    let study = site.service.study(|new| new.number_of_trials = 6).await;
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    page.wait_until("document.querySelectorAll('.trials tbody .converged').length >= 1").await;
    let away = |_| tokio::time::sleep(Duration::from_millis(300));
    let site = site.restart(Analytic::slow(Duration::from_millis(60)), away).await;
    // The same page, without a reload.
    page.run("window.same = true").await;
    page.wait_for("[data-part=state] .state.finished").await;
    assert_eq!(page.value("window.same ?? false").await, "true");
    page.wait_until("document.querySelectorAll('.trials tbody tr').length === 6").await;
    assert_eq!(site.service.trials(study).await.len(), 6);
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_opens_ten_thousand_trials_within_a_second() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 3).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let fill = |database: PathBuf| async move { large::fill(&database, study).await };
    let site = site.restart(Analytic::default(), fill).await;
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    let mut fastest = f64::INFINITY;
    for _ in 0..5 {
        page.goto(&site.at(&format!("/studies/{study}?sort=gait_rmse_rad&order=ascending"))).await;
        let took = "(() => { const n = performance.getEntriesByType('navigation')[0]; return n.loadEventEnd - n.startTime })()";
        page.wait_until(&format!("{took} > 0")).await;
        fastest = fastest.min(page.value(took).await.parse().unwrap());
    }
    println!("{fastest:.0} ms until a study of 10,000 trials is loaded, sorted by Gait RMSE");
    assert_eq!(page.count(".trials tbody tr").await, 50);
    // A second on a machine of one's own; where programs share its cores, as much longer as they have to wait.
    let load: f64 =
        std::fs::read_to_string("/proc/loadavg").ok().and_then(|t| t.split(' ').next()?.parse().ok()).unwrap_or(0.0);
    let cores = std::thread::available_parallelism().map_or(1.0, |n| n.get() as f64);
    assert!(fastest < 1000.0 * (load / cores).max(1.0), "{fastest} ms at a load of {load} on {cores} cores");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_shows_the_values_at_the_pointer() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 6).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    let history = site.service.fetch(&format!("/api/v1/studies/{study}/history")).await.items();
    let last = history.as_array().unwrap().last().unwrap();
    // The walker above the chart has its controls, so that the chart stays in its place.
    page.wait_for(".outcome fieldset:enabled [data-phase]").await;
    page.point_at("[data-part=history] svg circle.dot.c0:last-of-type").await;
    page.wait_for(".readout:not([hidden])").await;
    let said = page.text(".readout").await;
    let value: f64 = said.lines().last().unwrap().rsplit(' ').next().unwrap().parse().unwrap();
    assert!(said.starts_with("best action so far") && said.contains("Gait RMSE, rad"), "{said}");
    assert!((value - last["gait_rmse_rad"].as_f64().unwrap()).abs() < 2e-3, "{said} of {last}");
    assert_eq!(page.count("svg .here").await, 1);
    page.point_at("h1").await;
    page.wait_for(".readout[hidden]").await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_reports_lost_and_restored_connection() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::slow(Duration::from_millis(60))).await;
    let study = site.service.study(|new| (new.number_of_trials, new.answer_source) = (3, AnswerSource::People)).await;
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    let site = site
        .restart(Analytic::default(), async |_| {
            page.wait_for("[data-connection]:not([hidden])").await;
            let told = page.text("[data-connection]").await;
            assert!(told.contains("Retrying"), "{told}");
            let since = "document.querySelector('[data-connection] time').title";
            assert!(page.value(since).await.contains(" UTC (shown: "), "{told}");
            page.wait_for("#live.stale").await;
        })
        .await;
    page.wait_for("[data-connection][hidden]").await;
    page.wait_for("#live:not(.stale)").await;
    // Changes are announced to screen readers.
    site.service.post(&format!("/api/v1/studies/{study}/pause"), &serde_json::json!({})).await;
    page.wait_until("document.querySelector('[data-announced]').textContent === 'The study is now: paused.'").await;
    // Stopping a study needs a confirmation.
    page.click("[data-part=state] details summary").await;
    page.click("[data-part=state] button[value=stop]").await;
    page.wait_for("[data-part=state] .state.stopped").await;
    page.wait_for("[data-part=state] button[value=extend]").await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_shows_two_gaits_by_time_and_as_still_pictures() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| (new.number_of_trials, new.answer_source) = (3, AnswerSource::People)).await;
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    let at = site.at(&format!("/studies/{study}/compare"));
    let page = browser.open(&at).await;
    page.wait_for("[data-pace]").await;
    assert_eq!(page.count("svg.tiles").await, 0);
    page.click("[data-play]").await;
    page.run("const p = document.querySelector('[data-pace]'); p.value = 'time'; p.dispatchEvent(new Event('change'))")
        .await;
    assert!(page.text("[data-phase]").await.ends_with(" s"));
    // Half a second is half a stride of one second and a quarter of one of two; side by side both are equally far.
    let places = "import('/static/stride_clock.mjs').then(({ Clocks }) => { const c = new Clocks([1, 2], 1.5); c.at = 0.5; \
                  const both = () => [c.strides(0), c.strides(1)].map(n => n.toFixed(2)); const share = both(); c.pace = 'time'; \
                  return [...share, ...both(), c.round].join(' ') })";
    assert_eq!(page.value(places).await, "0.33 0.33 0.50 0.25 2");
    page.is_clean(&site.origin).await;

    let still = browser.open(&site.origin).await;
    still.prefer("prefers-reduced-motion", "reduce").await;
    still.goto(&at).await;
    still.wait_until("document.querySelector('[data-play]')?.textContent === 'Play'").await;
    assert_eq!(still.count("svg.tiles").await, 2);
    let plain = browser.open_without_scripts(&at).await;
    assert_eq!(plain.count("svg.tiles").await, 2);
    let seen = "[...document.querySelectorAll('svg.gait-walker, [data-key], [data-keys]')].filter(c => c.getClientRects().length).length";
    assert_eq!(plain.value(seen).await, "0", "no empty frames, no keys that do nothing");
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_does_not_offer_an_answered_comparison_as_the_next_one() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| (new.number_of_trials, new.answer_source) = (4, AnswerSource::People)).await;
    site.service.wait_for(study, &[StudyState::Waiting]).await;
    let at = site.at(&format!("/studies/{study}/compare"));
    let (one, other) = (browser.open(&at).await, browser.open(&at).await);
    // Only one tab is in front: the form is filled in by script.
    let send = "document.querySelector('#author').value = 'K1'; document.querySelector('button[value=a]').click()";
    for page in [&one, &other] {
        page.answer("a").await;
        page.run(send).await;
        page.wait_until("document.querySelector('.notice.good') !== null").await;
        site.service.wait_for(study, &[StudyState::Waiting]).await;
    }
    other.wait_until("document.querySelector('.notice.bad[role=alert]:not([data-unsent])') !== null").await;
    assert!(!other.text("main").await.contains("is below"));
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_prints_the_recommended_gait_with_date_and_version() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 3).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let page = browser.open(&site.at(&format!("/studies/{study}"))).await;
    let shown = |selector: &str| format!("document.querySelector('{selector}')?.checkVisibility() ?? false");
    assert_eq!(page.value(&shown("p.paper")).await, "false", "on screens");
    page.be_paper().await;
    for (selector, printed) in [
        (".outcome svg.gait-walker", "true"),
        ("p.paper", "true"),
        (".index", "false"),
        ("#export", "false"),
        (".controls", "false"),
        ("#analysis a[href$=analysis]", "false"),
    ] {
        assert_eq!(page.value(&shown(selector)).await, printed, "{selector}");
    }
    assert!(page.text("p.paper").await.contains(concat!("Gaitwright ", env!("CARGO_PKG_VERSION"))));
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_shows_the_analysis_whole_on_a_phone_and_on_paper() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 12).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let page = browser.open(&site.at(&format!("/studies/{study}/analysis"))).await;
    page.resize(390, 844).await;
    // Whether a gait is better is said beside its number, in sight without scrolling across.
    let answer = "(() => { const cell = document.querySelector('#best tbody tr:last-child').cells[1]; \
                   return /Gait RMSE/.test(cell.textContent) && cell.getBoundingClientRect().right <= innerWidth })()";
    assert_eq!(page.value(answer).await, "true");
    page.be_paper().await;
    page.resize(718, 1000).await;
    let cut = "[...document.querySelectorAll('.across')].filter(box => box.scrollWidth > box.clientWidth + 1).length";
    assert_eq!(page.count(".across").await, 3, "two maps and every trial");
    assert_eq!(page.value(cut).await, "0");
    assert_eq!(page.beyond().await, "0");
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_prints_tables_without_breaking_headings() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 12).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let gait = site
        .service
        .trials(study)
        .await
        .into_iter()
        .find(|trial| trial.state == gaitwright_store::trials::TrialState::Converged)
        .unwrap()
        .id;
    let broken = "[...document.querySelectorAll('thead th')].flatMap(th => { \
        const walker = document.createTreeWalker(th, NodeFilter.SHOW_TEXT); const broken = []; \
        for (let t = walker.nextNode(); t; t = walker.nextNode()) for (const word of t.data.matchAll(/[^ ]+/g)) { \
          const range = document.createRange(); range.setStart(t, word.index); range.setEnd(t, word.index + word[0].length); \
          if (range.getClientRects().length > 1) broken.push(word[0]); } return broken; }).join()";
    for path in [format!("/studies/{study}"), format!("/studies/{study}/analysis"), format!("/trials/{gait}")] {
        let page = browser.open(&site.at(&path)).await;
        page.be_paper().await;
        // A4 between margins of 1 cm.
        page.resize(718, 1000).await;
        assert_eq!(page.value(broken).await, "", "{path}");
        assert_eq!(page.beyond().await, "0", "{path}");
    }
    browser.close().await;
}
