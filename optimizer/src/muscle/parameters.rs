//! Muscle parameters of a subject: the published table, scaled to the subject, and the measured values that override it.

use super::measured_parameters::{MuscleField, MuscleOverride};
use super::muscle_tendon_units::{MUSCLE_COUNT, MUSCLES, Muscle};
use crate::model_error::ModelError;
use crate::subject::Subject;
use serde::{Deserialize, Serialize};

/// Height and mass of the person in the published table (Geyer and Herr 2010).
const TABLE_HEIGHT_M: f64 = 1.8;
const TABLE_MASS_KG: f64 = 80.0;

/// Differences of a subject's muscles from the published table; the same for both legs.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MuscleParameters {
    /// Whether lengths and moment arms scale with body height, and forces with body mass, from the 1.8 m and 80 kg of
    /// the table. Overrides are not scaled.
    pub scaled_to_body: bool,
    /// Hamstrings.
    pub ham: MuscleOverride,
    /// Gluteus.
    pub glu: MuscleOverride,
    /// Hip flexors.
    pub hfl: MuscleOverride,
    /// Gastrocnemius.
    pub gas: MuscleOverride,
    /// Vasti.
    pub vas: MuscleOverride,
    /// Soleus.
    pub sol: MuscleOverride,
    /// Tibialis anterior.
    pub ta: MuscleOverride,
}

impl MuscleParameters {
    /// Whether the published table applies unchanged.
    pub fn is_published(&self) -> bool {
        *self == Self::default()
    }

    /// The kinds of muscles with their overrides.
    pub fn overrides(&self) -> [(&'static str, &MuscleOverride); 7] {
        [
            ("ham", &self.ham),
            ("glu", &self.glu),
            ("hfl", &self.hfl),
            ("gas", &self.gas),
            ("vas", &self.vas),
            ("sol", &self.sol),
            ("ta", &self.ta),
        ]
    }

    /// Checks the range of each override, and that moment arms exist only at joints that the muscle spans.
    ///
    /// # Errors
    /// [`ModelError`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        for (kind, given) in self.overrides() {
            for MuscleField { name, minimum, maximum, given: value, .. } in &MuscleOverride::FIELDS {
                if let Some(value) = value(given) {
                    ModelError::check_range(&format!("muscles.{kind}.{name}"), value, *minimum, *maximum)?;
                }
            }
            for (joint, lever) in given.levers() {
                let spans = MUSCLES.iter().filter(|m| is_of(m, kind)).any(|m| m.spans(joint));
                if let Some(value) = lever
                    && !spans
                {
                    return Err(ModelError::MustBeAbsent {
                        field: format!("muscles.{kind}.{}_lever_m", joint.name()),
                        value,
                        reason: format!("{kind} does not span the {}", joint.name()),
                    });
                }
            }
        }
        Ok(())
    }

    /// A muscle of this kind (`ham`) with the subject's parameters; `None` if the kind does not exist.
    pub fn muscle_of_kind(&self, subject: &Subject, kind: &str) -> Option<Muscle> {
        self.muscles(subject).into_iter().find(|muscle| is_of(muscle, kind))
    }

    /// The ten muscles of a subject.
    pub fn muscles(&self, subject: &Subject) -> [Muscle; MUSCLE_COUNT] {
        let (length, force) = if self.scaled_to_body {
            (subject.height_m / TABLE_HEIGHT_M, subject.body_mass_kg / TABLE_MASS_KG)
        } else {
            (1.0, 1.0)
        };
        MUSCLES.map(|published| {
            let given = self.overrides().into_iter().find(|(kind, _)| is_of(&published, kind)).map(|(_, given)| *given);
            let given = given.unwrap_or_default();
            let mut muscle = published;
            muscle.max_force_n = given.max_force_n.unwrap_or(published.max_force_n * force);
            muscle.max_speed = given.max_speed.unwrap_or(published.max_speed);
            muscle.optimal_length_m = given.optimal_length_m.unwrap_or(published.optimal_length_m * length);
            muscle.slack_length_m = given.slack_length_m.unwrap_or(published.slack_length_m * length);
            for attachment in muscle.attachments.iter_mut().flatten() {
                let lever = given.levers().into_iter().find(|(joint, _)| *joint == attachment.joint());
                attachment.lever_m = lever.and_then(|(_, lever)| lever).unwrap_or(attachment.lever_m * length);
            }
            muscle
        })
    }
}

/// Whether a muscle (`HAM_L`) is of a kind (`ham`).
fn is_of(muscle: &Muscle, kind: &str) -> bool {
    muscle.name.split('_').next().is_some_and(|name| name.eq_ignore_ascii_case(kind))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn read(text: &str) -> MuscleParameters {
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn default_parameters_are_the_published_table() {
        let small = Subject::new(1.5, 50.0).unwrap();
        assert_eq!(MuscleParameters::default().muscles(&small), MUSCLES);
        let table = Subject::new(TABLE_HEIGHT_M, TABLE_MASS_KG).unwrap();
        assert_eq!(read(r#"{"scaled_to_body": true}"#).muscles(&table), MUSCLES);
    }

    #[test]
    fn scaling_follows_height_and_mass_except_for_overrides() {
        let small = Subject::new(0.9 * TABLE_HEIGHT_M, 0.5 * TABLE_MASS_KG).unwrap();
        let muscles = read(r#"{"scaled_to_body": true, "sol": {"max_force_n": 3333.0}}"#).muscles(&small);
        let ham = (&muscles[0], &MUSCLES[0]);
        assert!((ham.0.slack_length_m - 0.9 * ham.1.slack_length_m).abs() < 1e-12);
        assert!((ham.0.max_force_n - 0.5 * ham.1.max_force_n).abs() < 1e-9);
        let lever = |muscle: &Muscle| muscle.attachments[1].unwrap().lever_m;
        assert!((lever(ham.0) - 0.9 * lever(ham.1)).abs() < 1e-12);
        let sol = muscles.iter().find(|muscle| muscle.name == "SOL_L").unwrap();
        assert!((sol.max_force_n - 3333.0).abs() < 1e-12);
    }

    #[test]
    fn overrides_apply_to_both_legs_and_are_validated() {
        let subject = Subject::builtin(1).unwrap();
        let muscles = read(r#"{"ham": {"hip_lever_m": 0.07}}"#).muscles(&subject);
        for name in ["HAM_L", "HAM_R"] {
            let ham = muscles.iter().find(|muscle| muscle.name == name).unwrap();
            assert!((ham.attachments[0].unwrap().lever_m - 0.07).abs() < 1e-12);
        }
        for (text, expected) in [
            (r#"{"ta": {"max_force_n": 1.0}}"#, "muscles.ta.max_force_n is 1; it must be 50 to 20000."),
            (
                r#"{"sol": {"knee_lever_m": 0.05}}"#,
                "muscles.sol.knee_lever_m must be absent, because sol does not span the knee.",
            ),
        ] {
            let refusal = read(text).validate().unwrap_err().to_string();
            assert!(refusal.contains(expected), "{refusal}");
        }
        assert!(serde_json::from_str::<MuscleParameters>(r#"{"soleus": {}}"#).is_err());
    }
}
