//! The program itself behind the pages, with the real optimiser: from an empty folder to a recommended gait.

use crate::chromium::Chromium;
use skipped_tests::skipped;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Longer than three trials take on a busy machine.
const PATIENCE: Duration = Duration::from_mins(5);

/// A service as a process, killed when dropped.
struct Program(Child);

impl Drop for Program {
    fn drop(&mut self) {
        // It may have ended by itself already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts the program with an empty record; returns it with the sign-in link of its first administrator.
/// `GAITWRIGHT_PROGRAM` may name an installed program.
fn serve(folder: &Path) -> (Program, String) {
    let own = env!("CARGO_BIN_EXE_gaitwright-cli").into();
    let program = std::env::var_os("GAITWRIGHT_PROGRAM").unwrap_or(own);
    let mut command = Command::new(program);
    command.args(["serve", "--listen", "127.0.0.1:0"]).current_dir(folder).stderr(Stdio::piped());
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("GAITWRIGHT_")) {
        command.env_remove(name);
    }
    let mut child = command.spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
    let program = Program(child);
    let link =
        lines.find_map(|line| line.split_whitespace().find(|word| word.contains("/sign-in/")).map(str::to_owned));
    let link = link.expect("the program ended before it printed a sign-in link");
    // Reads on, so that the pipe does not fill up.
    std::thread::spawn(move || lines.for_each(drop));
    (program, link)
}

#[tokio::test(flavor = "multi_thread")]
async fn browser_leads_from_an_empty_folder_to_a_recommended_gait_with_the_program() {
    if std::env::var_os("GAITWRIGHT_LONG_TESTS").or(std::env::var_os("GAITWRIGHT_PROGRAM")).is_none() {
        return skipped("set GAITWRIGHT_LONG_TESTS=1");
    }
    let Some(browser) = Chromium::launch().await else { return };
    let folder = tempfile::tempdir().unwrap();
    let (program, link) = serve(folder.path());
    let origin = link.split("/sign-in/").next().unwrap().to_owned();
    let page = browser.open(&link).await;
    page.click("main button").await;
    page.click("a.button").await;
    page.wait_for("#number_of_trials").await;
    page.fill("#number_of_trials", "3").await;
    page.click("button[type=submit]").await;
    page.wait_for(".running[data-trial]").await;
    let begun = Instant::now();
    while page.count("[data-part=state] .state.finished").await == 0 {
        assert!(begun.elapsed() < PATIENCE, "{}", page.text("main").await);
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    page.wait_for(".outcome [data-phase]").await;
    let phase = "document.querySelector('.outcome [data-phase]').textContent";
    let before = page.value(phase).await;
    page.wait_until(&format!("{phase} !== {before:?}")).await;
    let controller_file = "[data-part=best] a[download][href*=controller]";
    while page.count(controller_file).await == 0 {
        assert!(begun.elapsed() < PATIENCE, "{}", page.text("main").await);
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    page.click("[data-part=best] a.button[href^='/trials/']").await;
    page.wait_until("location.pathname.startsWith('/trials/')").await;
    page.wait_until("document.querySelectorAll('svg.chart').length >= 12").await;
    page.wait_for(".walker svg.gait-walker").await;
    page.is_clean(&origin).await;
    browser.close().await;
    drop(program);
}
