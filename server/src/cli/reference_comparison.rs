//! The Gait RMSE of a gait against reference gaits, as text.

use gait_optimizer::reference_comparison::ReferenceComparison;

const COORDINATES: [&str; 5] = ["torso", "left hip", "left knee", "left ankle", "right hip"];

/// One line for each reference gait, and one for its coordinates.
pub(super) fn in_words(comparisons: &[ReferenceComparison]) -> Vec<String> {
    comparisons.iter().flat_map(|comparison| [total(comparison), coordinates(comparison)]).collect()
}

fn total(comparison: &ReferenceComparison) -> String {
    let which = if comparison.of_the_problem { "; the one used in the problem" } else { "" };
    format!(
        "  Gait RMSE          {:.4} rad ({}{which}); {:.4} rad after the best time shift ({:.2} % of the stride)",
        comparison.gait_rmse_rad, comparison.reference_gait, comparison.aligned_gait_rmse_rad, comparison.shift_percent
    )
}

fn coordinates(comparison: &ReferenceComparison) -> String {
    let parts = COORDINATES.into_iter().zip(comparison.parts_deg).map(|(name, part)| format!("{name} {part:.1}°"));
    format!("                     {}", parts.collect::<Vec<_>>().join(", "))
}
