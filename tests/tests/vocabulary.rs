//! One word for each concept: the words that the glossary retired occur nowhere in the repository.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};
use std::process::Command;

/// A retired word and the word of the glossary. It counts wherever no letter, digit or underscore precedes or follows it.
const RETIRED: [(&str, &str); 59] = [
    ("basin", "local optimum"),
    ("belief", "analysis, posterior"),
    ("beliefs", "analyses, posteriors"),
    ("Belief", "Analysis"),
    ("feedback_mode", "answer_source"),
    ("FeedbackMode", "AnswerSource"),
    ("trial_budget", "number_of_trials"),
    ("gait_beliefs", "gait_utilities"),
    ("GaitBelief", "GaitUtility"),
    ("get_belief_figure", "get_analysis_figure"),
    ("Comparisons are answered by", "Source of answers"),
    ("Total number of trials", "Number of trials"),
    ("\"tie\"", "no_difference"),
    ("'tie'", "no_difference"),
    ("Tie", "NoDifference"),
    ("tie_noise", "no_difference_noise"),
    ("tie_width", "no_difference_width"),
    ("audit_action_length", "audit_change_length"),
    ("blind-pairs/{token}", "code"),
    ("rate/pair/{token}", "code"),
    ("blind_pairs_token_length", "code"),
    ("NewMotion", "NewJointAngles"),
    ("MotionReading", "JointAngleReading"),
    ("add_motion_file", "add_joint_angle_file"),
    ("measurement-files/motion", "measurement-files/joint-angles"),
    ("unexpected_answers", "surprising_answers"),
    ("UnexpectedAnswer", "SurprisingAnswer"),
    ("retractions_author_length", "feedback_retractions"),
    ("unblindings_reason_length", "rater_unblindings"),
    ("Permission", "right"),
    ("--mass-kg", "--body-mass-kg"),
    ("gait_simulated", "execution_reported"),
    ("GaitSimulated", "ExecutionReported"),
    ("trial.simulate", "trial.report_execution"),
    ("WalksOnGround", "SimulatedWalksOnGround"),
    ("walks_number", "number_of_simulated_walks"),
    ("WalkerFigure", "GaitWalker"),
    ("gait-figure", "gait-walker"),
    ("BlindFigure", "BlindStickFigure"),
    ("trials_converged_has_figures", "trials_converged_has_values"),
    ("GaitFigures", "GaitValues"),
    ("open_question", "pending_comparison"),
    ("awaited_question", "awaited_comparison"),
    ("comparisons_to_ask", "proposed_comparisons"),
    ("what_to_ask", "proposed_comparison"),
    ("Bounds that matter", "Main effects"),
    ("feasibility phase", "restoration phase"),
    ("elastic phase", "restoration phase"),
    ("rehearsal", "prefetch"),
    ("form of the record", "schema of the record"),
    ("cold guess", "initial guess"),
    ("verdict", "certificate, assessment"),
    ("gaitwright_jobs", "gaitwright_solve_jobs"),
    ("jobs_by_state", "solve_jobs_by_state"),
    ("job_dispatch", "solve_dispatch"),
    ("tell_outcome", "tell_result"),
    ("ScriptOutcome", "ReportedResult"),
    ("\"convergence\"", "evaluation"),
    ("'convergence'", "evaluation"),
];

/// Files with other rules: this list, the changelog, and texts of others.
const OTHER: [&str; 5] = ["tests/tests/vocabulary.rs", "CHANGELOG.md", "Cargo.lock", "LICENSE-APACHE", "LICENSE-MIT"];

/// Every tracked text file of the repository, by its path, with its text.
fn texts() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let listed = Command::new("git").args(["ls-files", "-z"]).current_dir(&root).output();
    let Some(listed) = listed.ok().filter(|listed| listed.status.success()) else {
        skipped_tests::skipped("git is missing, or this is no clone");
        return Vec::new();
    };
    let paths = String::from_utf8(listed.stdout).unwrap();
    let read = |path: &str| {
        let file: PathBuf = root.join(path);
        // Binary files, symbolic links to folders and deleted files have no text.
        Some((path.to_owned(), std::fs::read_to_string(file).ok()?))
    };
    paths.split('\0').filter(|path| !OTHER.contains(path)).filter_map(read).collect()
}

fn is_of_a_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The numbers of the lines that contain a word.
fn lines_with(text: &str, word: &str) -> Vec<usize> {
    let whole = |line: &str| {
        line.match_indices(word).any(|(at, found)| {
            !line[..at].ends_with(is_of_a_word) && !line[at + found.len()..].starts_with(is_of_a_word)
        })
    };
    text.lines().enumerate().filter(|(_, line)| whole(line)).map(|(place, _)| place + 1).collect()
}

#[test]
fn retired_words_occur_nowhere() {
    let mut found = Vec::new();
    for (path, text) in texts() {
        for (word, instead) in RETIRED {
            for line in lines_with(&text, word) {
                found.push(format!("{path}:{line}: \"{word}\"; the word is \"{instead}\""));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn only_whole_words_are_found() {
    assert_eq!(lines_with("a\nthe belief, and\nbeliefs\nmy_belief\nbelief", "belief"), [2, 5]);
}
