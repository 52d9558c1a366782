//! Checks the answers in an imported archive: each against its trials, and how often a person answered.

use super::super::archive_file::refuse;
use super::answer_changes::answer_changes;
use super::context::{at, of_gaits};
use crate::error::Error;
use crate::printable;
use crate::studies::gait_rmse_answers::answer;
use crate::studies::tie_break::ComparedGait;
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow, Source};
use gaitwright_store::lab_sessions::LabSession;
use gaitwright_store::studies::{AnswerSource, Study};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{
    Connection, FeedbackId, Instant, SafetyReportId, TrialId, assessments, blind_pairs, feedback, safety_reports,
    safety_reviews,
};
use std::collections::{HashMap, HashSet};

/// Checks the feedback log, assessments, blind pairs and safety reviews. The subject answers each lab session.
pub(super) async fn answers(
    db: &mut Connection,
    study: &Study,
    trials: &HashMap<TrialId, &Trial>,
    (subject, sessions): (&str, &[LabSession]),
) -> Result<(), Error> {
    let id = study.id;
    let rows = at("feedback", feedback::of_study(db, id, 0).await)?;
    let assessments = at("assessments", assessments::of_study(db, id).await)?;
    // A safety report is allowed after an answer.
    let of_reports: HashSet<FeedbackId> = assessments.iter().filter_map(|assessment| assessment.feedback_id).collect();
    let mut labelled = 0;
    let mut answered: HashMap<_, usize> = HashMap::new();
    for row in &rows {
        let what = format!("feedback {} ({})", row.seq, row.id);
        at(&what, check_feedback(row, study, trials))?;
        labelled += usize::from(matches!(row.content, FeedbackContent::Label { .. }));
        let Some(compared) = pair(&row.content).filter(|_| is_of_person(row) && !of_reports.contains(&row.id)) else {
            continue;
        };
        let author = printable::compared(&row.author);
        let walked = sessions.iter().filter(|session| sorted(session.trial_a, session.trial_b) == compared).count();
        let most = if author == printable::compared(subject) { 1 + walked } else { 1 };
        let count = answered.entry((compared, author)).or_default();
        *count += 1;
        if *count > most {
            return Err(refuse(format!("{what}: {} has already answered this comparison", row.author)));
        }
    }
    let results = trials.values().filter(|trial| trial.state.is_result()).count();
    if labelled != results {
        return Err(refuse(format!("the number of results is {results}, but the number of labels is {labelled}")));
    }
    let pairs: HashMap<_, _> = rows.iter().filter_map(|row| Some((row.id, pair(&row.content)?))).collect();
    for assessment in &assessments {
        let what = format!("assessment {}", assessment.id);
        at(&what, of_gaits(trials, [assessment.trial_a, assessment.trial_b]))?;
        let compared = [assessment.trial_a, assessment.trial_b].map(|id| trials.get(&id).copied());
        if let [Some(first), Some(second)] = compared {
            at(&what, after_both(assessment.created_at, [first, second]))?;
        }
        let wanted = sorted(assessment.trial_a, assessment.trial_b);
        if assessment.feedback_id.is_some_and(|id| pairs.get(&id) != Some(&wanted)) {
            return Err(refuse(format!("{what}: the preference derived from it is about other trials")));
        }
    }
    answer_changes(&rows, &assessments)?;
    let mut reports: HashSet<SafetyReportId> = HashSet::new();
    reports.extend(
        assessments.iter().filter(|assessment| assessment.answer.is_about_safety()).map(|a| SafetyReportId::from(a.id)),
    );
    for shown in at("blind_pairs", blind_pairs::of_study(db, id).await)? {
        at(format!("blind pair {}", shown.id), of_gaits(trials, [shown.trial_a, shown.trial_b]))?;
        reports.extend(shown.answer.filter(|answer| answer.is_about_safety()).map(|_| SafetyReportId::from(shown.id)));
    }
    reports.extend(at("safety_reports", safety_reports::of_study(db, id).await)?.iter().map(|report| report.id));
    let has_report = |session: &&LabSession| session.answers.iter().any(|answer| answer.answer.is_about_safety());
    reports.extend(sessions.iter().filter(has_report).map(|session| SafetyReportId::from(session.id)));
    for review in at("safety_reviews", safety_reviews::of_study(db, id).await)? {
        let what = format!("safety review {}", review.id);
        at(&what, of_gaits(trials, [review.trial_id]))?;
        if let Some(unknown) = review.reports.iter().find(|report| !reports.contains(report)) {
            return Err(refuse(format!("{what}: the archive has no safety report {unknown}")));
        }
    }
    Ok(())
}

/// A standing answer that a person gave once: raters are asked again.
fn is_of_person(row: &FeedbackRow) -> bool {
    matches!(row.source, Source::Subject | Source::Clinician | Source::Script)
        && !row.by_rater
        && row.retraction.is_none()
}

fn sorted(a: TrialId, b: TrialId) -> (TrialId, TrialId) {
    if a < b { (a, b) } else { (b, a) }
}

fn pair(content: &FeedbackContent) -> Option<(TrialId, TrialId)> {
    match *content {
        FeedbackContent::Preference { winner, loser } => Some(sorted(winner, loser)),
        FeedbackContent::NoDifference { a, b } => Some(sorted(a, b)),
        FeedbackContent::Label { .. } | FeedbackContent::Suggestion { .. } => None,
    }
}

/// Checks that an answer is not older than what it compares.
fn after_both(answered_at: Instant, compared: [&Trial; 2]) -> Result<(), String> {
    match compared.iter().find(|trial| trial.created_at > answered_at) {
        Some(trial) => Err(format!("it is from {answered_at}, before trial {} was planned", trial.number)),
        None => Ok(()),
    }
}

/// Checks a row of the feedback log against the trials that it names.
fn check_feedback(row: &FeedbackRow, study: &Study, trials: &HashMap<TrialId, &Trial>) -> Result<(), String> {
    let trial =
        |id: TrialId| trials.get(&id).copied().ok_or_else(|| format!("trial {id} does not belong to this study"));
    match row.content {
        FeedbackContent::Label { trial: id, label } => {
            let state = trial(id)?.state;
            if state.label() != Some(label) {
                return Err(format!("the label {} does not match the trial state {}", label.as_str(), state.as_str()));
            }
            if row.source != Source::Evaluation {
                let source = row.source.as_str();
                return Err(format!("the source of a label is {source}; it must be evaluation"));
            }
        }
        FeedbackContent::Preference { winner: a, loser: b } | FeedbackContent::NoDifference { a, b } => {
            let (a, b) = (trial(a)?, trial(b)?);
            after_both(row.created_at, [a, b])?;
            if a.state != TrialState::Converged || b.state != TrialState::Converged {
                return Err("it compares a trial that did not converge".to_owned());
            }
            match row.source {
                Source::Evaluation => {
                    return Err(
                        "the source of a preference is evaluation; it must be gait_rmse, subject, clinician or script"
                            .to_owned(),
                    );
                }
                Source::GaitRmse => {
                    if study.plan.answer_source == AnswerSource::People {
                        return Err("Gait RMSE answers a comparison in a study where people answer".to_owned());
                    }
                    let (Some(one), Some(other)) = (ComparedGait::of(a), ComparedGait::of(b)) else {
                        return Err(
                            "Gait RMSE answers a comparison, but one of the two trials has no Gait RMSE".to_owned()
                        );
                    };
                    let expected = answer(&study.plan.simulated_walks, one, other).content;
                    if pair(&expected) != pair(&row.content)
                        || std::mem::discriminant(&expected) != std::mem::discriminant(&row.content)
                        || matches!((expected, row.content), (FeedbackContent::Preference { winner, .. }, FeedbackContent::Preference { winner: told, .. }) if winner != told)
                    {
                        return Err("the preference contradicts Gait RMSE and simulated walks".to_owned());
                    }
                }
                Source::Subject | Source::Clinician | Source::Script => {}
            }
        }
        FeedbackContent::Suggestion { suggested, over } => {
            trial(over)?;
            if suggested.0 >= study.plan.search_space.len() {
                return Err(format!("action {} is not in the search space", suggested.0));
            }
        }
    }
    Ok(())
}
