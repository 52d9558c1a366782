//! The page of a gait.

use crate::axe::Axe;
use crate::chromium::{Chromium, Tab};
use crate::site::Site;
use gaitwright_store::TrialId;
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::TrialState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::explained::{Clearance, without_gaits};
use std::time::Duration;

async fn is_accessible(axe: Option<&Axe>, page: &Tab) {
    let Some(axe) = axe else { return };
    let complaints = axe.complaints(page).await;
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

async fn with_a_gait() -> (Site, TrialId) {
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 1).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let trial = site.service.trials(study).await[0].id;
    (site, trial)
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_animation_plays_pauses_and_is_scrubbed() {
    let Some(browser) = Chromium::launch().await else { return };
    let (site, trial) = with_a_gait().await;
    let page = browser.open(&site.at(&format!("/trials/{trial}"))).await;
    page.wait_for("[data-play]").await;
    let phase = "document.querySelector('[data-scrub]').value";
    let first = page.value(phase).await;
    tokio::time::sleep(Duration::from_millis(300)).await;
    assert_ne!(page.value(phase).await, first, "it plays by itself");
    page.click("[data-play]").await;
    let paused = page.value(phase).await;
    tokio::time::sleep(Duration::from_millis(200)).await;
    assert_eq!(page.value(phase).await, paused, "it stands still");
    let pose = "document.querySelector('[data-body] [data-segment=\"left.thigh\"]').getAttribute('transform')";
    let mut poses = Vec::new();
    for phase in [10, 60] {
        page.run(&format!(
            "const s = document.querySelector('[data-scrub]'); s.value = {phase}; s.dispatchEvent(new Event('input'))"
        ))
        .await;
        poses.push(page.value(pose).await);
    }
    assert_ne!(poses[0], poses[1], "another pose");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_walker_stays_in_sight_beside_and_above_the_charts() {
    let Some(browser) = Chromium::launch().await else { return };
    let (site, trial) = with_a_gait().await;
    let page = browser.open(&site.at(&format!("/trials/{trial}"))).await;
    page.wait_for("[data-play]").await;
    for (width, height, highest) in [(1280, 800, 800.0), (768, 1024, 300.0), (390, 844, 250.0)] {
        page.resize(width, height).await;
        page.run("document.querySelector('#torques').scrollIntoView()").await;
        let place = "(() => { const at = document.querySelector('.viewer svg.gait-walker').getBoundingClientRect(); \
            return at.top >= 0 && at.bottom <= innerHeight ? at.height : -1 })()";
        let shown: f64 = page.value(place).await.parse().unwrap();
        assert!(shown > 100.0 && shown <= highest, "{width} x {height}: {shown}");
        assert_eq!(page.beyond().await, "0");
    }
    // Beside the charts, the whole box is in sight: figure, controls and legend.
    page.resize(1280, 800).await;
    let (bottom, ..) = page.lowest(".viewer > .walker-box :is(.controls, .legend, .export)").await;
    assert!(bottom <= 800.0, "{bottom}");
    let scrolls = "(() => { const box = document.querySelector('.viewer > .walker-box'); return box.scrollHeight > box.clientHeight })()";
    assert_eq!(page.value(scrolls).await, "false");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_readout_does_not_cover_a_small_chart() {
    let Some(browser) = Chromium::launch().await else { return };
    let (site, trial) = with_a_gait().await;
    let page = browser.open(&site.at(&format!("/trials/{trial}"))).await;
    page.wait_for("[data-play]").await;
    page.resize(390, 844).await;
    // In the middle of the screen, and where there is no room below.
    for block in ["center", "end"] {
        let covered = format!(
            "(() => {{ const chart = document.querySelector('#angles svg.chart'); chart.scrollIntoView({{ block: '{block}' }}); \
             const at = chart.getBoundingClientRect(); chart.dispatchEvent(new PointerEvent('pointermove', {{ bubbles: true, \
               clientX: at.left + at.width / 2, clientY: at.top + at.height / 2 }})); \
             const box = document.querySelector('.readout').getBoundingClientRect(); \
             return [box.height > 0, box.top < at.bottom - 1 && at.top + 1 < box.bottom].join() }})()"
        );
        assert_eq!(page.value(&covered).await, "true,false", "{block}");
    }
    let names = page.text(".readout").await;
    assert!(names.contains("left leg: ") && names.contains("reference, right: "), "{names}");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_gait_is_shown_completely_with_coloured_muscles() {
    let Some(browser) = Chromium::launch().await else { return };
    let (site, trial) = with_a_gait().await;
    let page = browser.open_without_scripts(&site.at(&format!("/trials/{trial}"))).await;
    // Each leg over its own cycle; the stride as pictures.
    for (group, charts) in [
        ("angles", 4),
        ("forces", 2),
        ("torques", 3),
        ("powers", 3),
        ("muscles", 7),
        ("fibres", 7),
        ("limit-cycles", 4),
    ] {
        assert_eq!(page.count(&format!("#{group} svg.chart")).await, charts, "{group}");
    }
    assert_eq!(page.count("#powers tbody tr").await, 6);
    // The walker is complete without scripts.
    for (what, count) in [(".device", 3), (".muscle", 10), (".trunk", 1), (".left", 3)] {
        assert_eq!(page.count(&format!(".walker [data-body] {what}")).await, count, "{what}");
    }
    assert_eq!(page.count("svg.tiles").await, 1);
    assert_eq!(page.count("#bounds tbody tr").await, 8);
    let reached =
        "[...document.querySelectorAll('#bounds tbody tr')].every(row => /[0-9]/.test(row.cells[3].textContent))";
    assert_eq!(page.value(reached).await, "true", "of every bound it is said what the gait makes of it");
    assert_eq!(page.count("#solve .files a").await, 3);
    let bytes = page.value("document.documentElement.outerHTML.length").await;
    assert!(bytes.parse::<u32>().unwrap() < 400_000, "{bytes} bytes");
    // Muscles are scaled to their own peak.
    let page = browser.open(&site.at(&format!("/trials/{trial}"))).await;
    page.wait_for("[data-play]").await;
    let widest = "(() => { let widest = 0; const s = document.querySelector('[data-scrub]'); for (let p = 0; p <= 100; p += 0.5) { \
                  s.value = p; s.dispatchEvent(new Event('input')); \
                  widest = Math.max(widest, ...[...document.querySelectorAll('.muscle')].map(m => Number(m.getAttribute('stroke-width')))); \
                  } return widest })()";
    page.wait_until(&format!("{widest} === 5")).await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_has_one_cursor_for_walker_and_charts() {
    let Some(browser) = Chromium::launch().await else { return };
    let (site, trial) = with_a_gait().await;
    let page = browser.open(&site.at(&format!("/trials/{trial}"))).await;
    page.wait_for("[data-play]").await;
    page.wait_for("#angles .cursor").await;
    // Drags to the middle of the axis of the first chart, from the line of the right leg.
    let drag = "(() => { const c = document.querySelector('#angles svg.chart'); const m = c.getScreenCTM(); \
                const s = document.querySelector('[data-scrub]'); s.value = 40; s.dispatchEvent(new Event('input')); \
                const send = (kind, x) => c.dispatchEvent(new PointerEvent(kind, { bubbles: true, button: 0, \
                  clientX: m.e + m.a * x, clientY: m.f + m.d * 150 })); \
                send('pointerdown', 74 + 542 * 0.4); send('pointermove', 74 + 542 * 0.25); send('pointerup', 0); \
                const at = [...c.parentElement.querySelectorAll('.cursor')].map(l => Number(l.getAttribute('transform').match(/[\\d.]+/)[0])); \
                const percent = at.map(x => Math.round((x - 74) / 5.42)); return [s.value, ...percent].join(' ') })()";
    // The cycle of the left leg begins in the middle of the stride.
    assert_eq!(page.value(drag).await, "25 75 25");
    assert_eq!(page.text("[data-play]").await, "Play", "what is dragged does not play on");
    // The reference gait appears behind the walker.
    let ghost = "document.querySelector('[data-ghost]').getAttribute('visibility')";
    assert_eq!(page.value(ghost).await, "hidden");
    page.click("[data-overlay]").await;
    assert_eq!(page.value(ghost).await, "visible");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_lays_other_gaits_over_a_gait_without_scripts() {
    let Some(browser) = Chromium::launch().await else { return };
    let axe = Axe::find();
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 12).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let trials = site.service.trials(study).await;
    let trial = trials.iter().find(|trial| trial.state == TrialState::Converged).unwrap();
    let page = browser.open_without_scripts(&site.at(&format!("/trials/{}", trial.id))).await;
    // Without scripts, a click does not scroll.
    page.resize(1280, 6000).await;
    page.click_plainly("#overlay summary").await;
    for place in 1..=3 {
        page.click_plainly(&format!("#overlay label:nth-child({place}) input")).await;
    }
    page.click_plainly("#overlay form button").await;
    page.wait_for("#overlay a").await;
    page.wait_for("footer.foot").await;
    for (group, charts) in [("angles", 7), ("torques", 6), ("powers", 6), ("forces", 2)] {
        assert_eq!(page.count(&format!("#{group} svg.chart")).await, charts, "{group}");
    }
    // This gait, three others and, for angles, the reference; each has its colour and its dash.
    assert_eq!(page.count("#overlay input:checked").await, 3);
    let legend = page.text("#angles .legend").await;
    assert!(legend.contains(&format!("trial {}", trial.number)) && legend.contains("reference"), "{legend}");
    let lines = "(() => { const lines = [...document.querySelectorAll('#torques svg.chart')[0].querySelectorAll('.line')]; \
                 return new Set(lines.map(line => getComputedStyle(line).stroke + getComputedStyle(line).strokeDasharray)).size })()";
    assert_eq!(page.value(lines).await, "4");
    for (width, height) in [(1280, 800), (768, 1024), (390, 844)] {
        page.resize(width, height).await;
        assert_eq!(page.beyond().await, "0", "{width} x {height}");
    }
    let bytes = page.value("document.documentElement.outerHTML.length").await;
    assert!(bytes.parse::<u32>().unwrap() < 400_000, "{bytes} bytes");
    page.resize(1280, 6000).await;
    page.click_plainly("#overlay a").await;
    page.wait_until("document.querySelectorAll('#angles svg.chart').length === 4").await;
    // With scripts, the cursor stands in every chart, once for each gait.
    let mut others = trials.iter().filter(|other| other.state == TrialState::Converged && other.id != trial.id);
    let other = others.next_back().unwrap().id;
    let page = browser.open(&site.at(&format!("/trials/{}?other={other}", trial.id))).await;
    page.wait_for("#angles .cursor").await;
    is_accessible(axe.as_ref(), &page).await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_zooms_charts_to_a_part_of_the_cycle() {
    let Some(browser) = Chromium::launch().await else { return };
    let axe = Axe::find();
    let (site, trial) = with_a_gait().await;
    let page = browser.open(&site.at(&format!("/trials/{trial}"))).await;
    page.wait_for("[data-play]").await;
    page.wait_for("#angles .cursor").await;
    let scrub = "document.querySelector('[data-scrub]').value";
    page.click("[data-play]").await;
    let before = page.value(scrub).await;
    // Drags from 20 % to 60 % of the first chart, with a finger.
    page.click("#angles .zoom summary").await;
    page.wait_for("body.chooses_part").await;
    is_accessible(axe.as_ref(), &page).await;
    let drag = "const c = document.querySelector('#angles svg.chart'); const m = c.getScreenCTM(); \
                const send = (kind, x) => c.dispatchEvent(new PointerEvent(kind, { bubbles: true, button: 0, pointerType: 'touch', \
                  clientX: m.e + m.a * x, clientY: m.f + m.d * 200 })); \
                send('pointerdown', 74 + 542 * 0.2); send('pointermove', 74 + 542 * 0.5); send('pointerup', 74 + 542 * 0.6);";
    page.run(drag).await;
    let ends = "[...document.querySelectorAll('#angles svg.chart[data-right], #forces svg.chart[data-right]')].map(c => c.dataset.right)";
    let alike = |part: &str| format!("{ends}.every(right => right.endsWith(' {part}'))");
    page.wait_until(&alike("20 60")).await;
    assert_eq!(page.value(scrub).await, before, "the drag that chooses a part does not move the walker");
    assert_eq!(page.count("details.zoom[open]").await, 0);
    let ticks = "[...document.querySelectorAll('#angles svg.chart')[0].querySelectorAll('.tick.x:not([hidden])')].map(t => t.textContent).join(' ')";
    assert_eq!(page.value(ticks).await, "20 30 40 50 60");
    // Cursor and readout follow the zoomed axis: half of the right leg's cycle is at three quarters of this part.
    page.run("const s = document.querySelector('[data-scrub]'); s.value = 50; s.dispatchEvent(new Event('input'))")
        .await;
    let cursor = "[...document.querySelector('#angles svg.chart').parentElement.querySelectorAll('.cursor')] \
                  .map(c => [c.getAttribute('visibility'), Math.round(c.getAttribute('transform').match(/-?[\\d.]+/)[0])].join(' ')).join(', ')";
    let place = 74.0_f64 + 542.0 * 0.75;
    assert_eq!(page.value(cursor).await.split(", ").last(), Some(format!("visible {}", place.round()).as_str()));
    is_accessible(axe.as_ref(), &page).await;
    page.click("#angles .zoom_reset").await;
    page.wait_until(&alike("0 100")).await;
    // The same by typing.
    page.click("#forces .zoom summary").await;
    // Ends in the other order are swapped.
    page.fill("#forces .zoom [name=from]", "75").await;
    page.fill("#forces .zoom [name=to]", "50").await;
    page.click("#forces .zoom form button").await;
    page.wait_until(&alike("50 75")).await;
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_explains_a_trial_without_a_gait() {
    let Some(browser) = Chromium::launch().await else { return };
    let site = Site::start(Analytic::default()).await;
    let study = site.service.study(|new| new.number_of_trials = 40).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let trials = site.service.trials(study).await;
    let without = trials.iter().find(|trial| trial.state == TrialState::NotConverged).unwrap();
    let page = browser.open(&site.at(&format!("/trials/{}", without.id))).await;
    assert!(!page.text("#explanation").await.contains("swing foot clearance"), "rows of the problem are folded away");
    page.run("for (const d of document.querySelectorAll('#explanation details')) d.open = true").await;
    let text = page.text("#explanation").await;
    assert!(text.contains("swing foot clearance") && text.contains("--explain"), "{text}");
    page.is_clean(&site.origin).await;
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_shows_an_explanation_when_it_is_ready() {
    let Some(browser) = Chromium::launch().await else { return };
    let explainer = Clearance::slow(Duration::from_secs(2));
    let site = Site::start_explaining(Analytic::default(), explainer).await;
    let study =
        site.service.study(|new| (new.number_of_trials, new.search_space) = (3, Some(without_gaits().into()))).await;
    site.service.wait_for(study, &[StudyState::Finished]).await;
    let last = site.service.trials(study).await[2].id;
    let page = browser.open(&site.at(&format!("/trials/{last}"))).await;
    page.click("#explanation button").await;
    page.wait_for("#explanation .pulse").await;
    page.wait_for("#explanation li").await;
    let text = page.value("document.querySelector('#explanation').textContent").await;
    assert!(
        text.contains("Relaxing a5 (swing-foot clearance) alone, to 0.03 m")
            && !text.contains("is solving this trial again"),
        "{text}"
    );
    // The conflict in words comes first, and each way out leads to a study with it.
    let headline = page.text("#explanation .headline").await;
    assert!(headline.contains("swing-foot clearance of at least"), "{headline}");
    page.click("#explanation .ways a").await;
    page.wait_for("#bounds[open]").await;
    assert_eq!(page.value("document.querySelector('[name=fixed_a5]').value").await, "0.03");
    page.is_clean(&site.origin).await;
    browser.close().await;
}
