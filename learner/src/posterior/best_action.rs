//! How likely each action is to be the best, from joint samples.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use crate::action::ActionIndex;
use crate::error::Result;
use crate::grid_sample::posterior_sample;
use crate::posterior::Posterior;
use crate::random::Random;
use crate::whole_grid::WholeGrid;

/// Probability that an action is the best of a set.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BestProbability {
    /// The action.
    pub action: ActionIndex,
    /// Share of joint samples in which its utility is the highest.
    pub probability: f64,
}

impl Posterior {
    /// Probability that each visited action is the best of them, from `draws` joint samples; most likely first.
    ///
    /// With separate labels, infeasible actions are left out if a feasible one exists.
    ///
    /// # Errors
    /// If the covariance cannot be factored.
    pub fn best_of_visited(&self, draws: usize, seed: u64) -> Result<Vec<BestProbability>> {
        let mut actions: Vec<ActionIndex> = Vec::new();
        for &action in self.visited() {
            if !actions.contains(&action) {
                actions.push(action);
            }
        }
        if self.feasibility.is_some() && actions.iter().any(|a| !self.infeasible.contains(a)) {
            actions.retain(|a| !self.infeasible.contains(a));
        }
        if actions.is_empty() {
            return Ok(Vec::new());
        }
        let sampler = self.sampler(&actions)?;
        let mut random = Random::new(seed, u64::MAX);
        let mut wins = vec![0_usize; actions.len()];
        for _ in 0..draws.max(1) {
            let sample = sampler.sample(&mut random);
            wins[argmax(&sample)] += 1;
        }
        Ok(ranked(actions.into_iter().zip(wins), draws.max(1)))
    }

    /// Probability that an action is the best of the whole grid, from `draws` joint samples; most likely first, without
    /// the actions that were never the best.
    ///
    /// # Errors
    /// If the grid has more than 2^20 actions or the covariance cannot be factored.
    pub fn best_of_grid(&self, draws: usize, seed: u64) -> Result<Vec<BestProbability>> {
        self.space().enumerable()?;
        let grid = WholeGrid::new(self.space(), &self.utility);
        let mut random = Random::new(seed, u64::MAX - 1);
        let mut wins: HashMap<ActionIndex, usize> = HashMap::new();
        for _ in 0..draws.max(1) {
            let sample = posterior_sample(self.space(), &self.utility, &grid, &mut random)?;
            *wins.entry(ActionIndex(argmax(&sample) as u64)).or_default() += 1;
        }
        Ok(ranked(wins.into_iter(), draws.max(1)))
    }
}

/// Position of the largest value, the first of several.
fn argmax(values: &[f64]) -> usize {
    let mut best = 0;
    for (i, value) in values.iter().enumerate() {
        if *value > values[best] {
            best = i;
        }
    }
    best
}

/// Turns counts of wins into probabilities, the largest first.
fn ranked(wins: impl Iterator<Item = (ActionIndex, usize)>, draws: usize) -> Vec<BestProbability> {
    let mut ranked: Vec<(usize, ActionIndex)> = wins.map(|(action, wins)| (wins, action)).collect();
    ranked.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    ranked
        .into_iter()
        .map(|(wins, action)| BestProbability { action, probability: wins as f64 / draws as f64 })
        .collect()
}
