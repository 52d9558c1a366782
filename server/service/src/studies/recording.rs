//! Reference gaits from recordings: one way in for the form, the REST interface and the command line.

use crate::error::Error;
use crate::printable;
use gait_optimizer::reference::{AngleUnit, HeelStrikes, Recording, Walker, distance};
use gait_optimizer::{ReferenceGait as Definition, Subject};
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::reference_gaits::{self, ReferenceGait};
use gaitwright_store::{Connection, Store, Writer};
use serde::{Deserialize, Serialize};
use serde_json::json;
use utoipa::ToSchema;

/// Longest name, characters.
const LONGEST_NAME: usize = 200;
/// The right foot's force in the files of OpenSim's examples.
const FORCE_COLUMN: &str = "ground_force_vy";
/// The right foot's force in the `fp` tables of Camargo 2021.
const CAMARGO_FORCE_COLUMN: &str = "Treadmill_R_vy";
/// Longest provenance: comments of a recording become part of it.
const LONGEST_PROVENANCE_BYTES: usize = 20_000;

/// Forms of recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// OpenSim motion or storage file (.mot, .sto) of a gait model.
    #[default]
    Opensim,
    /// The `data` table of an `ik` file of Camargo 2021, written by MATLAB's writetable.
    Camargo,
    /// CSV: time_s, torso_rad, hip_L_rad, knee_L_rad, ankle_L_rad, hip_R_rad; optionally knee_R_rad, right_force_n.
    Csv,
}

/// Units of angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    /// Degrees.
    Degrees,
    /// Radians.
    Radians,
}

impl From<Unit> for AngleUnit {
    fn from(unit: Unit) -> Self {
        match unit {
            Unit::Degrees => Self::Degrees,
            Unit::Radians => Self::Radians,
        }
    }
}

/// How right heel strikes are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Strikes {
    /// Where the vertical force under the right foot rises above 20 N.
    Force,
    /// Where the right heel is farthest ahead of the pelvis.
    #[default]
    Kinematics,
    /// The first and the last row: the recording is one stride, as exported gaits are.
    Ends,
}

/// A recording to make a reference gait of.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewReferenceGait {
    /// Name shown to people.
    pub name: String,
    /// Form of the recording.
    #[serde(default)]
    pub form: Form,
    /// The file's text.
    pub recording: String,
    /// Unit of an OpenSim file whose header does not say it.
    #[serde(default)]
    pub unit: Option<Unit>,
    /// Column of the vertical force under the right foot in an OpenSim file; where `forces` is given, by default
    /// `ground_force_vy`, and `Treadmill_R_vy` in a table of Camargo 2021.
    #[serde(default)]
    pub force_column: Option<String>,
    /// Text of the file that has this column, where it is not the recording itself: an OpenSim file, or the `fp` table
    /// beside an `ik` table of Camargo 2021. Both have one clock.
    #[serde(default)]
    pub forces: Option<String>,
    /// How right heel strikes are found where they are not given.
    #[serde(default)]
    pub strikes: Strikes,
    /// Right heel strikes, s; empty: to be found.
    #[serde(default)]
    pub heel_strikes_s: Vec<f64>,
    /// Height of the person, for matching, m.
    #[serde(default)]
    pub height_m: Option<f64>,
    /// Body mass of the person, for matching, kg.
    #[serde(default)]
    pub body_mass_kg: Option<f64>,
}

impl NewReferenceGait {
    /// Cuts the recording at heel strikes and averages its strides; in errors and provenance `what` names the recording,
    /// `forces` the file of the forces.
    ///
    /// # Errors
    /// [`Error::Invalid`] with field, or line and column, and the reason.
    pub fn definition(&self, what: &str, forces: &str) -> Result<Definition, Error> {
        let name = printable::name("name", &self.name, LONGEST_NAME)?;
        let recording = match self.form {
            Form::Opensim => {
                let unit = self.unit.map(AngleUnit::from);
                let here = self.force_column.as_deref().filter(|_| self.forces.is_none());
                Recording::from_opensim(what, &self.recording, unit, here)?
            }
            Form::Camargo => Recording::from_camargo_csv(what, &self.recording)?,
            Form::Csv => Recording::from_csv(what, &self.recording)?,
        };
        let recording = match &self.forces {
            Some(text) => {
                let column = self.force_column.as_deref();
                match self.form {
                    Form::Camargo => {
                        recording.with_camargo_forces(forces, text, column.unwrap_or(CAMARGO_FORCE_COLUMN))?
                    }
                    Form::Opensim | Form::Csv => {
                        recording.with_force_file(forces, text, column.unwrap_or(FORCE_COLUMN))?
                    }
                }
            }
            None => recording,
        };
        let strikes = match self.strikes {
            _ if !self.heel_strikes_s.is_empty() => HeelStrikes::Given(self.heel_strikes_s.clone()),
            Strikes::Force => HeelStrikes::Force,
            Strikes::Kinematics => HeelStrikes::Kinematics,
            Strikes::Ends => HeelStrikes::Ends,
        };
        let walker = Walker { height_m: self.height_m, body_mass_kg: self.body_mass_kg };
        let definition = recording.reference(name, &strikes, walker)?;
        if definition.provenance.len() > LONGEST_PROVENANCE_BYTES {
            let allowed = format!("at most {LONGEST_PROVENANCE_BYTES} bytes of comments before its columns");
            return Err(Error::invalid("recording", definition.provenance.len(), &allowed));
        }
        Ok(definition)
    }

    /// The same on a thread of its own: seconds for a long recording.
    ///
    /// # Errors
    /// As [`Self::definition`].
    pub async fn definition_aside(self, store: &mut Store) -> Result<Definition, Error> {
        store.compute(move |_| self.definition("recording", "forces")).await?
    }
}

/// Checks a reference gait.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub(super) fn check(definition: &Definition) -> Result<(), Error> {
    printable::name("name", &definition.name, LONGEST_NAME)?;
    if definition.provenance.len() > LONGEST_PROVENANCE_BYTES {
        let allowed = format!("at most {LONGEST_PROVENANCE_BYTES} bytes");
        return Err(Error::invalid("provenance", definition.provenance.len(), &allowed));
    }
    Ok(definition.validate()?)
}

/// Writes a reference gait; the one that is there already where it is the very same.
///
/// # Errors
/// [`Error::Invalid`] for a name that does not print, or what the database reports.
pub async fn add(writer: &mut Writer, actor: &Actor, definition: &Definition) -> Result<ReferenceGait, Error> {
    check(definition)?;
    let (reference, added) = reference_gaits::ensure(writer, definition).await?;
    if added {
        let detail =
            json!({ "name": reference.name, "height_m": definition.height_m, "body_mass_kg": definition.body_mass_kg });
        let target = format!("reference gait {}", reference.id);
        audit::append(writer, actor, "reference_gait.import", &target, &detail).await?;
    }
    Ok(reference)
}

/// A reference gait and how far its walker is from a subject.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct Match {
    /// The reference gait.
    pub reference_gait: ReferenceGait,
    /// `sqrt((dh / 0.10 m)^2 + (dm / 15 kg)^2)`; none when the reference does not say whose it is.
    pub distance: Option<f64>,
}

/// Every reference gait, the nearest to the subject in height and body mass first; those that do not say whose they
/// are come last.
///
/// # Errors
/// What the database reports.
pub async fn matches(db: &mut Connection, subject: &Subject) -> Result<Vec<Match>, Error> {
    let mut found: Vec<Match> = reference_gaits::all(db)
        .await?
        .into_iter()
        .map(|reference_gait| Match { distance: distance(subject, &reference_gait.definition), reference_gait })
        .collect();
    found.sort_by(|a, b| {
        let far = |m: &Match| m.distance.unwrap_or(f64::INFINITY);
        far(a).total_cmp(&far(b))
    });
    Ok(found)
}

/// The reference gait nearest to a subject; none where no reference says whose it is.
///
/// # Errors
/// What the database reports.
pub async fn nearest(db: &mut Connection, subject: &Subject) -> Result<Option<ReferenceGait>, Error> {
    let matches = matches(db, subject).await?;
    Ok(matches.into_iter().find(|found| found.distance.is_some()).map(|found| found.reference_gait))
}
