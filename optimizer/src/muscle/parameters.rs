//! Muscle parameters of a subject: the published table, scaled to the subject or overridden by measured values.

use super::attachment::Joint;
use super::muscle_tendon_units::{MUSCLE_COUNT, MUSCLES, Muscle};
use crate::model_error::ModelError;
use crate::subject::Subject;
use serde::{Deserialize, Serialize};

/// Height and mass of the person in the published table (Geyer and Herr 2010).
const TABLE_HEIGHT_M: f64 = 1.8;
const TABLE_MASS_KG: f64 = 80.0;

/// Measured values of one kind of muscle, which override the table. Missing fields keep the table's values.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MuscleOverride {
    /// Maximum isometric force, N.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_force_n: Option<f64>,
    /// Maximum shortening speed, optimal fibre lengths per second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_speed: Option<f64>,
    /// Optimal fibre length, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optimal_length_m: Option<f64>,
    /// Tendon slack length, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slack_length_m: Option<f64>,
    /// Largest moment arm at the hip, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hip_lever_m: Option<f64>,
    /// Largest moment arm at the knee, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub knee_lever_m: Option<f64>,
    /// Largest moment arm at the ankle, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ankle_lever_m: Option<f64>,
}

/// A parameter of a kind of muscle.
#[derive(Debug, Clone, Copy)]
pub struct MuscleField {
    /// Name with unit, as in JSON: `max_force_n`.
    pub name: &'static str,
    /// Description with unit.
    pub meaning: &'static str,
    /// Smallest allowed value.
    pub minimum: f64,
    /// Largest allowed value.
    pub maximum: f64,
    /// The override of a subject.
    pub given: fn(&MuscleOverride) -> Option<f64>,
    /// The value of a muscle; `None` if the muscle does not span the joint.
    pub value: fn(&Muscle) -> Option<f64>,
}

const LEVER_RANGE_M: (f64, f64) = (0.005, 0.2);

const fn field(
    name: &'static str,
    meaning: &'static str,
    (minimum, maximum): (f64, f64),
    given: fn(&MuscleOverride) -> Option<f64>,
    value: fn(&Muscle) -> Option<f64>,
) -> MuscleField {
    MuscleField { name, meaning, minimum, maximum, given, value }
}

impl MuscleOverride {
    /// The parameters, in order.
    pub const FIELDS: [MuscleField; 7] = [
        field(
            "max_force_n",
            "maximum isometric force, N",
            (50.0, 20_000.0),
            |g| g.max_force_n,
            |m| Some(m.max_force_n),
        ),
        field(
            "max_speed",
            "maximum shortening speed, optimal fibre lengths per second",
            (2.0, 30.0),
            |g| g.max_speed,
            |m| Some(m.max_speed),
        ),
        field(
            "optimal_length_m",
            "optimal fibre length, m",
            (0.01, 0.3),
            |g| g.optimal_length_m,
            |m| Some(m.optimal_length_m),
        ),
        field(
            "slack_length_m",
            "tendon slack length, m",
            (0.02, 0.8),
            |g| g.slack_length_m,
            |m| Some(m.slack_length_m),
        ),
        field(
            "hip_lever_m",
            "largest moment arm at the hip, m",
            LEVER_RANGE_M,
            |g| g.hip_lever_m,
            |m| lever(m, Joint::Hip),
        ),
        field(
            "knee_lever_m",
            "largest moment arm at the knee, m",
            LEVER_RANGE_M,
            |g| g.knee_lever_m,
            |m| lever(m, Joint::Knee),
        ),
        field(
            "ankle_lever_m",
            "largest moment arm at the ankle, m",
            LEVER_RANGE_M,
            |g| g.ankle_lever_m,
            |m| lever(m, Joint::Ankle),
        ),
    ];
}

/// Largest moment arm of a muscle at a joint, m; `None` if the muscle does not span it.
fn lever(muscle: &Muscle, joint: Joint) -> Option<f64> {
    muscle.attachments.iter().flatten().find(|attachment| attachment.joint() == joint).map(|found| found.lever_m)
}

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

impl MuscleOverride {
    fn levers(&self) -> [(Joint, Option<f64>); 3] {
        [(Joint::Hip, self.hip_lever_m), (Joint::Knee, self.knee_lever_m), (Joint::Ankle, self.ankle_lever_m)]
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
