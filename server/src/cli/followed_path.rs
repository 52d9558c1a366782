//! The path of a continuation in words.

use gait_optimizer::{FoldReason, FollowedPath, TunedBounds};

/// How a gait was followed, and where its path ends.
pub(super) fn in_words(path: &FollowedPath) -> String {
    let steps = match path.steps {
        1 => "1 step".to_owned(),
        steps => format!("{steps} steps"),
    };
    let Some(fold) = path.fold else {
        return format!(
            "  same family        followed in {steps}; the joint angles change by at most {:.4} rad in a step",
            path.largest_change_rad
        );
    };
    let reason = match fold.reason {
        FoldReason::NoGait => "the next step has no gait nearby",
        FoldReason::Jump => "the next step has another gait only",
    };
    let bounds = TunedBounds::NAMES.iter().zip(fold.bounds.to_array());
    let bounds: Vec<String> = bounds.map(|(name, value)| format!("{name}={value:.4}")).collect();
    format!(
        "  another family     the path ends in a fold after {:.1} % ({steps}), at {}: {reason}",
        100.0 * fold.share,
        bounds.join(",")
    )
}
