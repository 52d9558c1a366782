//! Checks of every page: size, contrast and accessibility.

use crate::axe::Axe;
use crate::chromium::{Chromium, Tab};
use crate::site::Site;
use axum::http::StatusCode;
use gait_learner::{Dimension, SearchSpace};
use gait_optimizer::SolveStatus;
use gaitwright_store::studies::{AnswerSource, Evaluation, StudyState};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{StudyId, TrialId, commit, explanations};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::explained::{explanation, without_gaits};
use gaitwright_tests::measured::{electromyogram, joint_angles};
use gaitwright_tests::simulated;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Users and tokens in every state.
async fn people(site: &Site) {
    let send = async |path: &str, body: Value| site.service.post(&format!("/api/v1/{path}"), &body).await.json();
    for (name, role) in [("Ada", "administrator"), ("K1", "clinician"), ("R1", "rater")] {
        let user = send("users", json!({"name": name, "role": role})).await;
        if role == "rater" {
            send(&format!("users/{}/disable", user["id"].as_str().unwrap()), json!({})).await;
        }
    }
    for name in ["treadmill", "an old one"] {
        let token = send("tokens", json!({"name": name, "scopes": ["read", "run"]})).await;
        if name != "treadmill" {
            send(&format!("tokens/{}/revoke", token["id"].as_str().unwrap()), json!({})).await;
        }
    }
}

/// A study that a script evaluates, and its trial that has results but no gait.
async fn by_script(site: &Site) -> (StudyId, String) {
    let study = site.service.study(|new| (new.evaluation, new.number_of_trials) = (Evaluation::Script, 3)).await;
    let ask = async || site.service.post(&format!("/api/v1/studies/{study}/ask"), &json!({})).await.json();
    let trial = ask().await["id"].as_str().unwrap().to_owned();
    let told = json!({"label": "converged", "gait_rmse_rad": 0.21});
    site.service.post(&format!("/api/v1/trials/{trial}/tell"), &told).await;
    // A trial that is being evaluated.
    ask().await;
    (study, trial)
}

/// A study in which nothing converged.
async fn study_without_gaits(site: &Site) -> StudyId {
    let study = site
        .service
        .study(|new| {
            (new.base_bounds.a5, new.base_bounds.a6, new.number_of_trials) = (0.039, 0.0, 2);
            let velocity = Dimension { name: "a1".to_owned(), values: vec![15.0, 20.0], lengthscale: 5.0 };
            new.search_space = Some(SearchSpace::new(vec![velocity]).unwrap().into());
        })
        .await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    study
}

/// A subject who withdrew, and a study of theirs.
async fn withdrawn(site: &Site) -> (String, StudyId) {
    let described = json!({"pseudonym": "S09", "height_m": 1.7, "body_mass_kg": 66});
    let subject = site.service.post("/api/v1/subjects", &described).await.json()["id"].as_str().unwrap().to_owned();
    let study = site.service.study(|new| (new.subject_id, new.number_of_trials) = (subject.parse().unwrap(), 2)).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    site.service.post(&format!("/api/v1/subjects/{subject}/withdraw"), &json!({"reason": "moved away"})).await;
    (subject, study)
}

/// Every page, with content: name and address.
async fn pages(site: &Site) -> Vec<(&'static str, String)> {
    let study = site.service.study(|new| (new.number_of_trials, new.name) = (24, Some(LONG_WORD.to_owned()))).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let human = (4, AnswerSource::People, Some(LONG_NAME.to_owned()));
    let other = site.service.study(|new| (new.number_of_trials, new.answer_source, new.name) = human).await;
    site.service.wait_for(other, &[StudyState::Waiting]).await;
    let trials = site.service.trials(study).await;
    let of = |state| trials.iter().find(|trial| trial.state == state).map(|trial| trial.id);
    let gait = of(TrialState::Converged).unwrap();
    let [no_gait, being_explained, explained] = trials_without_gaits(site).await;
    let taken = site.service.post_text(&format!("/rate/{other}"), "application/x-www-form-urlencoded", "").await;
    let pair = taken.headers["location"].to_str().unwrap().to_owned();
    let converged: Vec<_> = trials.iter().filter(|trial| trial.state == TrialState::Converged).collect();
    simulated::keep(&site.service.store, converged[0]).await;
    let gaits = json!({"trial_a": converged[0].id, "trial_b": converged[1].id, "notes": "treadmill, 1.1 m/s"});
    let session = site.service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &gaits).await.json();
    let session = session["id"].as_str().unwrap();
    for walk in 1..=2 {
        let walked = json!({"walk": walk, "note": "slow at first"});
        site.service.post(&format!("/api/v1/lab-sessions/{session}/walks"), &walked).await;
        let emg = electromyogram(f64::from(walk));
        let emg = json!({"walk": walk, "recording": emg, "reading": {"heel_strike_column": "heel"}});
        site.service.post(&format!("/api/v1/lab-sessions/{session}/measurement-files/emg"), &emg).await;
    }
    let joints = json!({"walk": 2, "recording": joint_angles()});
    site.service.post(&format!("/api/v1/lab-sessions/{session}/measurement-files/joint-angles"), &joints).await;
    site.service.post(&format!("/api/v1/lab-sessions/{session}/emg-results"), &json!({})).await;
    // A session that waits for the answer of the subject, and one with an answer.
    let gaits = json!({"trial_a": converged[0].id, "trial_b": converged[1].id});
    let mut walked = Vec::new();
    for _ in 0..2 {
        let session = site.service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &gaits).await.json();
        let session = session["id"].as_str().unwrap().to_owned();
        for walk in 1..=3 {
            site.service.post(&format!("/api/v1/lab-sessions/{session}/walks"), &json!({"walk": walk})).await;
        }
        walked.push(session);
    }
    let said = json!({"number": 1, "answer": "second", "note": "softer at the heel"});
    site.service.post(&format!("/api/v1/lab-sessions/{}/answers", walked[1]), &said).await;
    let told = format!("/api/v1/lab-sessions/{}/unblind", walked[1]);
    site.service.post(&told, &json!({"reason": "every walk was recorded"})).await;
    let unsafe_one = converged[2].id;
    let assessment = json!({"trial_a": unsafe_one, "trial_b": converged[3].id, "answer": "unsafe_a", "author": "K1",
        "note": "stumbled twice"});
    site.service.post(&format!("/api/v1/studies/{study}/assessments"), &assessment).await;
    let lifted = converged[4].id;
    let assessment = json!({"trial_a": lifted, "trial_b": converged[3].id, "answer": "unsafe_a", "author": "K1"});
    site.service.post(&format!("/api/v1/studies/{study}/assessments"), &assessment).await;
    let decision = json!({"decision": "cleared", "author": "K2", "reason": "walked slowly, with a harness"});
    site.service.post(&format!("/api/v1/trials/{lifted}/safety-reviews"), &decision).await;
    people(site).await;
    let (script, told) = by_script(site).await;
    let without_gaits = study_without_gaits(site).await;
    let (gone, closed) = withdrawn(site).await;
    vec![
        ("script-study", format!("/studies/{script}")),
        ("told-trial", format!("/trials/{told}")),
        ("study-without-gaits", format!("/studies/{without_gaits}")),
        ("withdrawn-subject", format!("/subjects/{gone}")),
        ("withdrawn-study", format!("/studies/{closed}")),
        ("account", "/account".to_owned()),
        ("lifted-gait", format!("/trials/{lifted}")),
        ("lab-question", format!("/lab/{}", walked[0])),
        ("lab-answered", format!("/lab/{}", walked[1])),
        ("lab-session-told", format!("/lab-sessions/{}", walked[1])),
        ("unsafe-gait", format!("/trials/{unsafe_one}")),
        ("figures", format!("/studies/{study}/figures?other={other}")),
        ("lab-sessions", format!("/studies/{study}/lab")),
        ("study-members", format!("/studies/{study}/members")),
        ("study-details", format!("/studies/{study}/details")),
        ("cloned-study", format!("/studies/new?like={study}&relax=a5=0.013,a7=35")),
        ("no-match", "/?text=nothing+has+this+name".to_owned()),
        ("lab-session", format!("/lab-sessions/{session}")),
        ("lab", "/lab".to_owned()),
        ("lab-walk", format!("/lab/{session}")),
        ("home", "/".to_owned()),
        ("subjects", "/subjects".to_owned()),
        ("subject", format!("/subjects/{}", site.service.subject().await)),
        ("muscles", format!("/subjects/{}/muscles", site.service.subject().await)),
        ("devices", "/devices".to_owned()),
        ("device", format!("/devices/{}", site.service.get(study).await.plan.device_id)),
        ("references", "/reference-gaits".to_owned()),
        ("reference", format!("/reference-gaits/{}", site.service.reference().await)),
        ("new-study", "/studies/new".to_owned()),
        ("study", format!("/studies/{study}")),
        ("analysis", format!("/studies/{study}/analysis?x=a5&y=a6")),
        ("atlas", format!("/studies/{study}/atlas")),
        ("side-by-side", format!("/studies/compare?study={study}&study={other}")),
        ("compare", format!("/studies/{other}/compare")),
        ("gait", format!("/trials/{gait}")),
        ("no-gait", format!("/trials/{no_gait}")),
        ("being-explained", format!("/trials/{being_explained}")),
        ("explained", format!("/trials/{explained}")),
        ("rate", "/rate".to_owned()),
        ("pair", pair),
        ("users", "/users".to_owned()),
        ("audit", "/audit".to_owned()),
        ("system", "/system".to_owned()),
        ("help", "/help".to_owned()),
        ("guide", "/help/clinician".to_owned()),
        ("glossary", "/help/glossary".to_owned()),
        ("interface", "/api".to_owned()),
        ("sign-in", "/sign-in".to_owned()),
        ("error", "/nothing".to_owned()),
    ]
}

/// Trials without a gait: not explained, being explained, and explained.
async fn trials_without_gaits(site: &Site) -> [TrialId; 3] {
    let study =
        site.service.study(|new| (new.number_of_trials, new.search_space) = (3, Some(without_gaits().into()))).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let trials = site.service.trials(study).await;
    let asked = site.service.post(&format!("/api/v1/trials/{}/explanation", trials[1].id), &json!({})).await;
    assert_eq!(asked.status, StatusCode::ACCEPTED, "{}", asked.text);
    let Trial { id, action, violations, .. } = &trials[2];
    let found = explanation(action, SolveStatus::Infeasible, violations);
    let mut writer = site.service.store.write().await.unwrap();
    assert!(explanations::insert(&mut writer, *id, "{}", &found).await.unwrap());
    commit(writer).await.unwrap();
    [trials[0].id, trials[1].id, *id]
}

/// Long names: one word of 60 letters, and 86 characters.
const LONG_WORD: &str = "Prothesengangoptimierungsverlaufsbeobachtungswiederholungen1";
const LONG_NAME: &str = "A second tuning of the person with the powered prosthesis, treadmill at 1.1 m/s, shoes";
const WIDTHS: [i64; 4] = [1280, 768, 390, 320];
/// Width of A4 between margins of 1 cm, in CSS pixels.
const PAPER: i64 = 718;

#[tokio::test(flavor = "multi_thread")]
async fn browser_every_page_fits_and_is_accessible() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let pictures = std::env::var_os("GAITWRIGHT_PICTURES").map(PathBuf::from);
    let (mut wrong, mut downloads) = (Vec::new(), BTreeSet::new());
    for (name, path) in pages(&site).await {
        let page = browser.open(&site.at(&path)).await;
        for scheme in ["light", "dark"] {
            page.prefer("prefers-color-scheme", scheme).await;
            for complaint in own_checks(&page).await.into_iter().chain(bare_times(&page, name).await) {
                wrong.push(format!("{name}, {scheme}: {complaint}"));
            }
            for width in WIDTHS {
                page.resize(width, 900).await;
                let beyond = page.beyond().await;
                if beyond != "0" {
                    wrong.push(format!("{name}: {beyond} px beyond {width} px"));
                }
                for complaint in cut_or_covered(&page).await {
                    wrong.push(format!("{name}, {width} px: {complaint}"));
                }
                if name == "analysis" && width == 390 {
                    wrong.extend(cut_tables(&page).await.into_iter().map(|cut| format!("{name}, {width} px: {cut}")));
                }
                if let Some(folder) = pictures.as_deref().filter(|_| width > 320) {
                    page.picture(&folder.join(format!("{name}-{width}-{scheme}.png"))).await;
                }
            }
            for complaint in too_small(&page).await {
                wrong.push(format!("{name}: {complaint}"));
            }
            page.resize(1280, 900).await;
        }
        downloads.extend(links_to_files(&page).await);
        page.be_paper().await;
        page.resize(PAPER, 1000).await;
        let beyond = page.beyond().await;
        if beyond != "0" {
            wrong.push(format!("{name}: {beyond} px beyond the paper"));
        }
        let broken = cut_or_covered(&page).await.into_iter().filter(|what| what.contains(" is broken in the heading "));
        wrong.extend(broken.map(|what| format!("{name}, on paper: {what}")));
        if name != "error" {
            page.is_clean(&site.origin).await;
        }
    }
    for (address, asks) in &downloads {
        wrong.extend(not_a_file(&site, address, *asks).await);
    }
    assert!(downloads.len() > 20, "{downloads:?}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    browser.close().await;
}

/// Tables whose last column is beyond their frame.
async fn cut_tables(page: &Tab) -> Vec<String> {
    let cut = "JSON.stringify([...document.querySelectorAll('.scroll:has(> table)')].filter(e => e.scrollWidth > e.clientWidth) \
        .map(e => `the table ${e.getAttribute('aria-label')} is ${e.scrollWidth - e.clientWidth} px too wide`))";
    serde_json::from_str(&page.value(cut).await).unwrap()
}

/// Guides, which may speak of times of day and of UTC.
const PROSE: [&str; 3] = ["help", "guide", "glossary"];

/// Times that are not in the time zone of the reader. The details of the audit trail are JSON, as they stand in the record.
async fn bare_times(page: &Tab, name: &str) -> Vec<String> {
    if PROSE.contains(&name) {
        return Vec::new();
    }
    let bare = r"JSON.stringify((() => {
        const time = /\d{4}-\d\d-\d\d[T ]\d\d:\d\d|\bUTC\b/;
        const found = [];
        const words = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
        for (let node = words.nextNode(); node; node = words.nextNode()) {
            const text = node.textContent.trim();
            if (time.test(text) && !text.startsWith('{') && !node.parentElement.closest('time[datetime][title], script')) found.push(text);
        }
        for (const element of document.querySelectorAll('[aria-label], [title]:not(time)')) {
            for (const text of [element.ariaLabel, element.title]) if (time.test(text)) found.push(text);
        }
        return found.map(text => `the time is not local: ${text}`);
    })())";
    serde_json::from_str(&page.value(bare).await).unwrap()
}

/// Links of a page to files of the REST interface: the address, and whether the link asks the browser to save it. Other tests
/// download figures, and the motion and controller files, which the gaits of the analytic solver do not have.
async fn links_to_files(page: &Tab) -> Vec<(String, bool)> {
    let links = "JSON.stringify([...document.querySelectorAll('a[href^=\"/api/v1/\"]')].map(a => \
        [a.getAttribute('href'), a.hasAttribute('download')]).filter(([address]) => \
        !['/figures/', '/gait.mot', '/controller.json'].some(other => address.includes(other))))";
    serde_json::from_str(&page.value(links).await).unwrap()
}

/// Fault of a file, if any: no header by which a browser saves it under a name that says what it is.
async fn not_a_file(site: &Site, address: &str, asks: bool) -> Option<String> {
    let file = site.service.fetch(address).await;
    let header = file.headers.get("content-disposition").map_or("", |value| value.to_str().unwrap());
    let name = header.strip_prefix("attachment; filename").unwrap_or_default().trim_matches(['=', '"']);
    let is_named = name.len() > 8 && name.contains('.') && (!address.contains("download=") || address.ends_with(name));
    let is_right = file.status == StatusCode::OK && asks && is_named;
    (!is_right).then(|| format!("{address}: {}, {header:?}, download attribute: {asks}", file.status))
}

/// Text of maps and of strides that is smaller than 9 points of the screen: drawings are scaled with their place.
async fn too_small(page: &Tab) -> Vec<String> {
    let small = "JSON.stringify([...document.querySelectorAll('svg.map text, svg.tiles text')].flatMap(t => { \
        const svg = t.ownerSVGElement; const size = parseFloat(getComputedStyle(t).fontSize) * svg.getScreenCTM().a; \
        return size < 9 ? [`${t.textContent} is ${size.toFixed(1)} px high`] : []; }).slice(0, 2))";
    serde_json::from_str(&page.value(small).await).unwrap()
}

/// Charts and their texts that reach beyond their frame, texts of a chart that cover each other, headings of a table that are
/// broken within a word, and buttons that stand lower than the controls beside them. What scrolls in its own frame may be wide.
async fn cut_or_covered(page: &Tab) -> Vec<String> {
    serde_json::from_str(&page.value(include_str!("layout.js")).await).unwrap()
}

async fn own_checks(page: &Tab) -> Vec<String> {
    serde_json::from_str(&page.value(include_str!("accessibility.js")).await).unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_every_page_passes_axe() {
    let (Some(axe), Some(browser)) = (Axe::find(), Chromium::launch().await) else { return };
    let site = Site::start(Analytic::default()).await;
    let mut wrong = Vec::new();
    for (name, path) in pages(&site).await {
        let page = browser.open(&site.at(&path)).await;
        wrong.extend(axe.complaints(&page).await.into_iter().map(|complaint| format!("{name}, {complaint}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    browser.close().await;
}
