//! The process is killed (SIGKILL) at arbitrary instants, during concurrent writes.
//!
//! `GAITWRIGHT_KILLS=200` kills it more often.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_tests::client::{get, post};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

const TRIALS: u32 = 15;

/// A service as a process, killed when dropped.
struct Process {
    child: Child,
    address: String,
}

impl Process {
    fn start(database: &Path) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_serve-analytic"))
            .arg(database)
            .args(["127.0.0.1:0", "4"])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        Self { child, address: line.trim().trim_start_matches("http://").to_owned() }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

/// Pseudo-random numbers, the same in every run.
fn splitmix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn start_study(address: &str) -> String {
    let subjects = get(address, "/api/v1/subjects").unwrap().items();
    let subject = subjects.as_array().unwrap().iter().find(|s| s["pseudonym"] == "paper-1").unwrap()["id"].clone();
    let made =
        post(address, "/api/v1/studies", &json!({"subject_id": subject, "number_of_trials": TRIALS, "seed": 11}));
    made.unwrap().json()["id"].as_str().unwrap().to_owned()
}

fn wait_until_finished(address: &str, study: &str) {
    for _ in 0..3000 {
        if get(address, &format!("/api/v1/studies/{study}")).unwrap().json()["state"] == "finished" {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("the study does not finish");
}

/// The certificate of the best gait, and the number of the one that passes where it does not, once the service is done.
fn certificates_of(address: &str, study: &str) -> (Value, Value) {
    for _ in 0..3000 {
        let found = get(address, &format!("/api/v1/studies/{study}/recommendation")).unwrap().json();
        if found["certifying"] == false {
            return (found["certificate"].clone(), found["passing"]["number"].clone());
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("the gaits of the study are not certified");
}

/// The explanations of all trials without a gait, once the service has finished.
fn explained(address: &str, study: &str) -> Vec<String> {
    let trials = get(address, &format!("/api/v1/studies/{study}/trials")).unwrap().items();
    let without_gait = trials.as_array().unwrap().iter().filter(|trial| trial["state"] == "not_converged");
    without_gait.map(|trial| sentences(address, trial["id"].as_str().unwrap())).collect()
}

fn sentences(address: &str, trial: &str) -> String {
    for _ in 0..3000 {
        let found = get(address, &format!("/api/v1/trials/{trial}/explanation")).unwrap();
        if found.status == 200 {
            return found.json()["sentences"].to_string();
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("the trial is not explained");
}

/// Everything but identifiers and times.
fn essence(address: &str, study: &str) -> Vec<String> {
    let trials = get(address, &format!("/api/v1/studies/{study}/trials")).unwrap().items();
    let trials = trials.as_array().unwrap();
    let number = |id: &Value| trials.iter().find(|t| t["id"] == *id).map(|t| t["number"].clone());
    trials
        .iter()
        .map(|t| {
            let from = number(&t["warm_started_from"]);
            format!("{} {} {} {} {from:?}", t["number"], t["action_index"], t["state"], t["gait_rmse_rad"])
        })
        .collect()
}

/// Every subject, page by page.
fn pseudonyms(address: &str) -> Vec<String> {
    let (mut found, mut cursor) = (Vec::new(), String::new());
    loop {
        let page = get(address, &format!("/api/v1/subjects?limit=1000{cursor}")).unwrap().json();
        let subjects = page["items"].as_array().unwrap();
        found.extend(subjects.iter().map(|subject| subject["pseudonym"].as_str().unwrap().to_owned()));
        let Some(next) = page["next"].as_str() else { return found };
        cursor = format!("&cursor={next}");
    }
}

fn labels(address: &str, study: &str) -> usize {
    let answers = get(address, &format!("/api/v1/studies/{study}/preferences")).unwrap().items();
    answers.as_array().unwrap().len()
}

#[test]
fn killed_service_loses_no_acknowledged_write_and_finishes_with_the_same_trials() {
    let kills: u32 = std::env::var("GAITWRIGHT_KILLS").ok().and_then(|text| text.parse().ok()).unwrap_or(12);
    let folder = tempfile::tempdir().unwrap();

    let quiet = Process::start(&folder.path().join("quiet.db"));
    let undisturbed = start_study(&quiet.address);
    wait_until_finished(&quiet.address, &undisturbed);
    let expected = essence(&quiet.address, &undisturbed);
    let expected_answers = labels(&quiet.address, &undisturbed);
    let certified = certificates_of(&quiet.address, &undisturbed);
    assert!(["passed", "failed"].contains(&certified.0.as_str().unwrap()), "{certified:?}");
    let whys = explained(&quiet.address, &undisturbed);
    assert!(!whys.is_empty(), "trials without a gait");
    assert_eq!(expected.len(), TRIALS as usize);
    drop(quiet);

    let database = folder.path().join("killed.db");
    let mut random = 20_261_121;
    let mut study: Option<String> = None;
    let address = Mutex::new(String::new());
    let acknowledged = Mutex::new(Vec::<String>::new());
    let (stop, counter) = (AtomicBool::new(false), AtomicU32::new(0));
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                while !stop.load(Ordering::Relaxed) {
                    let pseudonym = format!("W{}", counter.fetch_add(1, Ordering::Relaxed));
                    let body = json!({"pseudonym": pseudonym, "height_m": 1.7, "body_mass_kg": 70.0});
                    let present = address.lock().unwrap().clone();
                    if post(&present, "/api/v1/subjects", &body).is_ok_and(|reply| reply.status == 201) {
                        acknowledged.lock().unwrap().push(pseudonym);
                    }
                    std::thread::sleep(Duration::from_millis(3));
                }
            });
        }
        for _ in 0..kills {
            let process = Process::start(&database);
            address.lock().unwrap().clone_from(&process.address);
            if study.is_none() {
                study = Some(start_study(&process.address));
            }
            std::thread::sleep(Duration::from_millis(splitmix(&mut random) % 500));
        }
        stop.store(true, Ordering::Relaxed);
    });

    let study = study.unwrap();
    let process = Process::start(&database);
    wait_until_finished(&process.address, &study);
    assert_eq!(essence(&process.address, &study), expected);
    assert_eq!(labels(&process.address, &study), expected_answers, "no answer is given twice");
    assert_eq!(certificates_of(&process.address, &study), certified);
    assert_eq!(explained(&process.address, &study), whys);
    let present = pseudonyms(&process.address);
    let acknowledged = acknowledged.into_inner().unwrap();
    assert!(!acknowledged.is_empty());
    for pseudonym in &acknowledged {
        assert!(present.contains(pseudonym), "{pseudonym} was acknowledged and is lost");
    }
    println!("{kills} kills, {} acknowledged writes, all there", acknowledged.len());
}

/// Has the gait of a trial certified, and returns whether it passed.
fn is_certified(address: &str, trial: &Value) -> bool {
    let path = format!("/api/v1/trials/{}/certificate", trial.as_str().unwrap());
    post(address, &path, &json!({})).unwrap();
    for _ in 0..3000 {
        let certificate = get(address, &path).unwrap();
        if certificate.status == 200 {
            return certificate.json()["passed"] == true;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("the gait is not certified");
}

/// The preferences of a study that count, each with its identifier and content.
fn in_force(address: &str, study: &str) -> Vec<(String, Value)> {
    let answers = get(address, &format!("/api/v1/studies/{study}/preferences?limit=1000")).unwrap().items();
    let standing = answers.as_array().unwrap().iter().filter(|answer| answer["retraction"].is_null());
    standing.map(|answer| (answer["id"].as_str().unwrap().to_owned(), answer["content"].clone())).collect()
}

/// An undo retracts the changed answer and brings the former one back in one transaction: after a kill, one of the two
/// counts, and the former one if the undo was acknowledged.
#[test]
fn killed_undo_has_happened_wholly_or_not_at_all() {
    let kills: u32 = std::env::var("GAITWRIGHT_KILLS").ok().and_then(|text| text.parse().ok()).unwrap_or(12);
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("undo.db");
    let mut random = 20_261_128;
    let (mut acknowledged, mut done, mut not_done) = (0, 0, 0);
    let mut process = Process::start(&database);
    let study = start_study(&process.address);
    wait_until_finished(&process.address, &study);
    let trials = get(&process.address, &format!("/api/v1/studies/{study}/trials")).unwrap().items();
    let converged = trials.as_array().unwrap().iter().filter(|trial| trial["state"] == "converged");
    let mut walkable = converged.map(|trial| &trial["id"]).filter(|id| is_certified(&process.address, id));
    let (a, b) = (walkable.next().unwrap(), walkable.next().unwrap());
    let computed = in_force(&process.address, &study).len();
    let list = format!("/api/v1/studies/{study}/preferences");
    let answer = |address: &str, preferred: &str, replaces: Option<&str>| {
        let body = json!({"trial_a": a, "trial_b": b, "answer": preferred, "source": "clinician", "author": "K",
            "replaces": replaces});
        let given = post(address, &list, &body).unwrap();
        assert_eq!(given.status, 201, "{}", given.body);
        given.json()["id"].as_str().unwrap().to_owned()
    };
    answer(&process.address, "a", None);
    // Kills are spread over twice the time that an undisturbed undo takes.
    let mut usual = Duration::ZERO;
    for kill in 0..=kills {
        let standing = in_force(&process.address, &study);
        assert_eq!(standing.len(), computed + 1);
        let (former, former_content) = standing.last().unwrap().clone();
        let changed = answer(&process.address, "b", Some(&former));
        let (address, path) = (process.address.clone(), format!("/api/v1/preferences/{changed}/undo"));
        let undo = std::thread::spawn(move || post(&address, &path, &json!({})).is_ok_and(|reply| reply.status < 300));
        let begun = std::time::Instant::now();
        if kill == 0 {
            while !undo.is_finished() {
                std::thread::sleep(Duration::from_micros(100));
            }
            usual = begun.elapsed();
        } else {
            let longest = u64::try_from(2 * usual.as_micros()).unwrap();
            std::thread::sleep(Duration::from_micros(splitmix(&mut random) % longest));
        }
        drop(process);
        let confirmed = undo.join().unwrap();
        assert!(confirmed || kill > 0, "an undisturbed undo");
        process = Process::start(&database);
        let standing = in_force(&process.address, &study);
        assert_eq!(standing.len(), computed + 1, "exactly one answer about the two gaits counts");
        let (id, content) = standing.last().unwrap().clone();
        let happened = id != changed;
        assert_eq!(content == former_content, happened, "{content}");
        assert!(happened || !confirmed, "the undo was acknowledged and is lost");
        acknowledged += u32::from(confirmed);
        if happened {
            done += 1;
        } else {
            not_done += 1;
            let undone = post(&process.address, &format!("/api/v1/preferences/{changed}/undo"), &json!({})).unwrap();
            assert!(undone.status < 300, "{}", undone.body);
        }
    }
    println!("{kills} kills: {acknowledged} undos acknowledged, {done} happened, {not_done} did not");
}

#[test]
fn second_process_is_refused_while_the_first_owns_the_record() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let _first = Process::start(&database);
    let second = Command::new(env!("CARGO_BIN_EXE_gaitwright-cli"))
        .args(["serve", "--no-sign-in", "--listen", "127.0.0.1:0", "--database"])
        .arg(&database)
        .output()
        .unwrap();
    assert!(!second.status.success());
    let text = String::from_utf8_lossy(&second.stderr);
    assert!(text.contains("in use by another Gaitwright process"), "{text}");
}
