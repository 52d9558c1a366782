//! Alternations of the muscle activations from node to node, a sign of an activation that the mesh does not resolve.

use crate::gait::Gait;
use crate::muscle::MUSCLE_COUNT;

/// Smallest step of an activation that counts in an alternation.
const ALTERNATING_STEP: f64 = 0.005;

/// Number of alternations of a curve: three consecutive steps of alternating sign, each of more than 0.005.
pub fn alternations(curve: &[f64]) -> usize {
    let steps: Vec<f64> = curve.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let alternate =
        |s: &&[f64]| s[0] * s[1] < 0.0 && s[1] * s[2] < 0.0 && s.iter().all(|step| step.abs() > ALTERNATING_STEP);
    steps.windows(3).filter(alternate).count()
}

/// Number of alternations of the muscle activations from node to node, over all muscles and domains.
pub fn activation_alternations(gait: &Gait) -> usize {
    let muscles = gait.domains.iter().filter_map(|domain| domain.muscles.as_ref());
    muscles
        .flat_map(|trajectory| {
            (0..MUSCLE_COUNT).map(|m| alternations(&trajectory.activation.iter().map(|all| all[m]).collect::<Vec<_>>()))
        })
        .sum()
}
