//! The distances of a gait from reference gaits, as text.

use gait_optimizer::reference_comparison::ReferenceComparison;

const COORDINATES: [&str; 5] = ["torso", "left hip", "left knee", "left ankle", "right hip"];

/// One line for each reference gait, and one for its coordinates.
pub(super) fn in_words(comparisons: &[ReferenceComparison]) -> Vec<String> {
    comparisons.iter().flat_map(|comparison| [distance(comparison), coordinates(comparison)]).collect()
}

fn distance(comparison: &ReferenceComparison) -> String {
    let which = if comparison.of_the_problem { "; the one used in the problem" } else { "" };
    format!(
        "  Gait RMSE          {:.4} rad ({}{which}); {:.4} rad if shifted by {:.2} % of the stride",
        comparison.gait_rmse_rad, comparison.reference_gait, comparison.aligned_gait_rmse_rad, comparison.shift_percent
    )
}

fn coordinates(comparison: &ReferenceComparison) -> String {
    let parts = COORDINATES.into_iter().zip(comparison.parts_deg).map(|(name, part)| format!("{name} {part:.1}°"));
    format!("                     {}", parts.collect::<Vec<_>>().join(", "))
}
