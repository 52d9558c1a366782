//! Finds two gaits of a study that a person can still compare although the study itself asks for nothing.

use super::feedback_log;
use super::identical_gaits::pooled;
use super::snapshot::StudySnapshot;
use super::walkable::WalkablePair;
use crate::error::Error;
use crate::printable;
use gaitwright_compute::OnPool;
use gaitwright_store::assessments::Assessment;
use gaitwright_store::feedback::{FeedbackContent, Source};
use gaitwright_store::trials::Trial;
use gaitwright_store::{Connection, TrialId};
use std::collections::{HashMap, HashSet};

/// Pairs of different walkable gaits, the newest first, about which this person has no answer; without a person, about
/// which nobody has one. Trials with the same gait count as one.
pub fn unanswered_pairs(
    _: &OnPool,
    snapshot: &StudySnapshot,
    assessments: &[Assessment],
    person: Option<&str>,
) -> Vec<WalkablePair> {
    let pools = pooled(snapshot.trials.iter().collect());
    let pool_of: HashMap<TrialId, usize> =
        pools.iter().enumerate().flat_map(|(at, pool)| pool.iter().map(move |trial| (trial.id, at))).collect();
    let unordered = |(a, b): (TrialId, TrialId)| {
        let (a, b) = (*pool_of.get(&a)?, *pool_of.get(&b)?);
        Some((a.min(b), a.max(b)))
    };
    let counts = |author: &str| person.is_none_or(|person| printable::is_same_name(person, author));
    let preferences = snapshot.feedback.iter().filter_map(|row| match row.content {
        _ if row.retraction.is_some() || row.source == Source::GaitRmse || !counts(&row.author) => None,
        FeedbackContent::Preference { winner, loser } => Some((winner, loser)),
        FeedbackContent::NoDifference { a, b } => Some((a, b)),
        FeedbackContent::Label { .. } | FeedbackContent::Suggestion { .. } => None,
    });
    let assessed = assessments
        .iter()
        .filter(|assessment| assessment.retraction.is_none() && counts(&assessment.author))
        .map(Assessment::pair);
    let answered: HashSet<(usize, usize)> = preferences.chain(assessed).filter_map(unordered).collect();
    let newest_of =
        |pool: &Vec<&Trial>| pool.iter().rev().find_map(|trial| Some((snapshot.walkable(trial).ok()?, trial.id)));
    let mut gaits: Vec<_> = pools.iter().filter_map(newest_of).collect();
    gaits.sort_by_key(|(_, id)| snapshot.trial(*id).map(|trial| trial.number));
    let mut open = Vec::new();
    for (at, (second, of_second)) in gaits.iter().enumerate().rev() {
        for (first, of_first) in gaits[..at].iter().rev() {
            let is_answered = unordered((*of_first, *of_second)).is_none_or(|pair| answered.contains(&pair));
            let trials = snapshot.trial(*of_first).zip(snapshot.trial(*of_second)).filter(|_| !is_answered);
            open.extend(trials.and_then(|(a, b)| WalkablePair::of((first.clone(), a), (second.clone(), b))));
        }
    }
    open
}

/// The first of these pairs about which this person has no answer at all, blinded answers and suggestions included.
///
/// # Errors
/// Errors of the database.
pub async fn first_without_answer(
    db: &mut Connection,
    snapshot: &StudySnapshot,
    pairs: &[WalkablePair],
    person: Option<&str>,
) -> Result<Option<WalkablePair>, Error> {
    let Some(person) = person else { return Ok(pairs.first().cloned()) };
    for pair in pairs {
        if feedback_log::current_answer(db, snapshot.study.id, pair.trials(), person).await?.is_none() {
            return Ok(Some(pair.clone()));
        }
    }
    Ok(None)
}
