//! The gaits that the cold start of a trial reached, side by side on its page.

use crate::format;
use gait_optimizer::ModelError;
use gait_optimizer::ReferenceGait;
use gait_optimizer::reference_comparison::compare_with_references;
use gait_optimizer::spatiotemporal::Spatiotemporal;
use gaitwright_charts::{Figure, GaitWalker, gait_charts};
use gaitwright_service::studies::local_optima::FoundLocalOptimum;
use gaitwright_store::TrialId;

/// A local optimum as the page shows it.
pub(super) struct ShownLocalOptimum {
    pub(super) number: u32,
    /// Whether its gait is the result of the trial.
    pub(super) is_result: bool,
    /// Address of the moving figure.
    pub(super) animation: String,
    /// The stride in pictures, for readers who prefer no motion.
    pub(super) pictures: String,
    /// Name and value of each property.
    pub(super) values: Vec<(String, String)>,
}

/// The local optima of a trial. None if there is only its own gait.
pub(super) fn shown(
    trial: TrialId,
    found: &[FoundLocalOptimum],
    reference: &ReferenceGait,
) -> Result<Vec<ShownLocalOptimum>, ModelError> {
    if found.len() < 2 {
        return Ok(Vec::new());
    }
    found.iter().map(|one| ShownLocalOptimum::new(trial, one, reference)).collect()
}

impl ShownLocalOptimum {
    fn new(trial: TrialId, found: &FoundLocalOptimum, reference: &ReferenceGait) -> Result<Self, ModelError> {
        let FoundLocalOptimum { number, is_result, objective, gait, .. } = found;
        let address = |figure: &Figure| {
            let which = if *is_result { String::new() } else { format!("?local_optimum={number}") };
            format!("/api/v1/trials/{trial}/figures/{}.svg{which}", figure.name)
        };
        let text = |name: &str, value: String| (name.to_owned(), value);
        let mut values = vec![text("Objective", format::decimal(Some(*objective)))];
        // Values of a malformed gait would be false.
        if gait.validate().is_ok() {
            for compared in compare_with_references(gait, reference)? {
                let name = format!("Gait RMSE, rad, against {}", compared.reference_gait);
                values.push((name, format::decimal(Some(compared.gait_rmse_rad))));
            }
            let strides = Spatiotemporal::of(gait)?;
            values.extend([
                text("Walking speed, m/s", format!("{:.2}", strides.speed_m_s)),
                text("Stride length, m", format!("{:.3}", strides.stride_length_m)),
                text("Double support, % of the stride", format!("{:.1}", strides.double_support_percent)),
                text(
                    "Step length, left / right",
                    format!("{:.2}", strides.left.step_length_m / strides.right.step_length_m),
                ),
            ]);
        }
        Ok(Self {
            number: *number,
            is_result: *is_result,
            animation: address(&gait_charts::animation(GaitWalker::new(gait)?)),
            pictures: address(&gait_charts::tiles(gait_optimizer::gait::stick_figure::stick_figures(gait)?)),
            values,
        })
    }
}
