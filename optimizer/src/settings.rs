//! Settings of the gait problem other than the tuned bounds: mesh, limits, and weights of the objective.

mod gait_limits;
mod naturalness;
mod regularisation;

pub use gait_limits::{GaitLimits, PerDomainKind};
pub use naturalness::Naturalness;
pub use regularisation::Regularisation;

use crate::model_error::ModelError;
use crate::muscle::MuscleParameters;
use serde::{Deserialize, Serialize};

/// Number of mesh intervals of each kind of domain. A domain with N intervals has 2N + 1 equidistant nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mesh {
    /// Intervals of DS2, double support on stance heel and trailing toe.
    pub ds2: usize,
    /// Intervals of DS3, double support on the flat stance foot and the trailing toe.
    pub ds3: usize,
    /// Intervals of SS2, single support on the flat stance foot.
    pub ss2: usize,
    /// Intervals of SS1, single support on the stance toe.
    pub ss1: usize,
}

impl Default for Mesh {
    fn default() -> Self {
        Self { ds2: 4, ds3: 4, ss2: 6, ss1: 6 }
    }
}

impl Mesh {
    /// Largest number of intervals of a domain.
    pub const MAX_INTERVALS: usize = 100;

    /// Checks that each domain has 1 to [`Self::MAX_INTERVALS`] intervals.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        for (field, value) in
            [("mesh.ds2", self.ds2), ("mesh.ds3", self.ds3), ("mesh.ss2", self.ss2), ("mesh.ss1", self.ss1)]
        {
            ModelError::check_range(field, value as f64, 1.0, Self::MAX_INTERVALS as f64)?;
        }
        Ok(())
    }
}

/// Settings of the gait problem other than subject, device and tuned bounds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct GaitSettings {
    /// Number of mesh intervals of each kind of domain.
    pub mesh: Mesh,
    /// Limits of the gait.
    pub limits: GaitLimits,
    /// Regularisation of the objective.
    pub regularisation: Regularisation,
    /// Naturalness terms beyond the paper.
    #[serde(skip_serializing_if = "Naturalness::is_off")]
    pub naturalness: Naturalness,
    /// Differences of the subject's muscles from the published table.
    #[serde(skip_serializing_if = "MuscleParameters::is_published")]
    pub muscles: MuscleParameters,
}

impl GaitSettings {
    /// The settings of the reference problem, which an independent implementation solves (`tests/data`, `benches/casadi`):
    /// the defaults without the weight on the bend of activations.
    pub fn reference_problem() -> Self {
        Self { regularisation: Regularisation { activation_bend: 0.0, ..Regularisation::default() }, ..Self::default() }
    }

    /// Checks each setting.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        self.mesh.validate()?;
        self.limits.validate()?;
        self.regularisation.validate()?;
        self.naturalness.validate()?;
        self.muscles.validate()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn missing_fields_have_defaults() {
        for same in ["{}", r#"{"regularisation": {"torque": 0.003}}"#] {
            assert_eq!(serde_json::from_str::<GaitSettings>(same).unwrap(), GaitSettings::default(), "{same}");
        }
        let reference = r#"{"regularisation": {"activation_bend": 0}}"#;
        assert_eq!(serde_json::from_str::<GaitSettings>(reference).unwrap(), GaitSettings::reference_problem());
        assert_ne!(GaitSettings::default(), GaitSettings::reference_problem());
    }

    #[test]
    fn disabled_options_are_not_serialised() {
        let text = serde_json::to_string(&GaitSettings::default()).unwrap();
        assert!(!text.contains("naturalness") && !text.contains("muscles"), "{text}");
        let given: GaitSettings = serde_json::from_str(r#"{"naturalness": {"trailing_load_share": 0.3}}"#).unwrap();
        let again: GaitSettings = serde_json::from_str(&serde_json::to_string(&given).unwrap()).unwrap();
        assert_eq!(given, again);
        let refused: GaitSettings = serde_json::from_str(r#"{"naturalness": {"reference_weight": -1}}"#).unwrap();
        let refusal = refused.validate().unwrap_err().to_string();
        assert_eq!(refusal, "naturalness.reference_weight is -1; it must be 0 to 100.");
    }
}
