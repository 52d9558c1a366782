//! The fields of the form for a new study: their defaults, those of a clone, and their labels.

use super::super::subjects::unused_pseudonym;
use crate::refused_fields::{FieldLabels, TypedForm};
use crate::units::Units;
use gait_learner::{LearnerSettings, Method};
use gait_optimizer::TunedBounds;
use gaitwright_service::error::Error;
use gaitwright_store::StudyId;
use gaitwright_store::studies::SimulatedWalksEffect;
use serde::Deserialize;
use std::collections::BTreeMap;

/// The fields as typed, to show a refused form again.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct NewStudyFields {
    /// The study whose set-up applies to everything that the form does not show.
    #[serde(default)]
    pub(super) like: String,
    #[serde(default)]
    pub(super) name: String,
    pub(super) subject: String,
    /// Present when ticked.
    #[serde(default)]
    pub(super) restricted: Option<String>,
    #[serde(default)]
    pub(super) pseudonym: String,
    #[serde(default)]
    pub(super) height_m: String,
    #[serde(default)]
    pub(super) body_mass_kg: String,
    /// The units in which the form was shown.
    #[serde(default)]
    pub(super) units: Units,
    #[serde(default)]
    pub(super) device: String,
    #[serde(default)]
    pub(super) reference_gait: String,
    pub(super) muscles: String,
    pub(super) answer_source: String,
    #[serde(default = "linecospar")]
    pub(super) learner: String,
    pub(super) number_of_trials: String,
    #[serde(default)]
    pub(super) unchanged_limit: String,
    pub(super) parallel_trials: String,
    pub(super) seed: String,
    /// Present when ticked.
    #[serde(default)]
    pub(super) repeat_results: Option<String>,
    /// Present when ticked.
    #[serde(default)]
    pub(super) warm_start_from_root: Option<String>,
    /// Present when ticked. The solves then start from the root, too.
    #[serde(default)]
    pub(super) use_atlas: Option<String>,
    #[serde(rename = "simulated_walks.effect", default = "no_simulated_walks")]
    pub(super) simulated_walks_effect: String,
    #[serde(rename = "simulated_walks.number_of_simulated_walks", default)]
    pub(super) number_of_simulated_walks: String,
    #[serde(rename = "simulated_walks.gait_rmse_tolerance_rad", default)]
    pub(super) gait_rmse_tolerance_rad: String,
    #[serde(rename = "simulated_walks.least_mean_strides", default)]
    pub(super) least_mean_strides: String,
    #[serde(default)]
    pub(super) nearest_within_percent: String,
    #[serde(default)]
    pub(super) initial_guesses: String,
    #[serde(default)]
    pub(super) local_optimum: String,
    /// Whether bounds were relaxed in a clone, so that the table of bounds has to be shown.
    #[serde(skip)]
    pub(super) relaxed: bool,
    /// The entries of the search space, which the editor reads.
    #[serde(flatten)]
    pub(super) space: BTreeMap<String, String>,
}

fn no_simulated_walks() -> String {
    SimulatedWalksEffect::None.as_str().to_owned()
}

fn linecospar() -> String {
    LEARNERS[0].0.to_owned()
}

impl Default for NewStudyFields {
    fn default() -> Self {
        let text = str::to_owned;
        Self {
            like: String::new(),
            name: String::new(),
            subject: String::new(),
            restricted: None,
            pseudonym: String::new(),
            height_m: String::new(),
            body_mass_kg: String::new(),
            units: Units::default(),
            device: String::new(),
            reference_gait: String::new(),
            muscles: text("on"),
            answer_source: text("gait_rmse"),
            learner: linecospar(),
            number_of_trials: text("15"),
            unchanged_limit: String::new(),
            parallel_trials: text("1"),
            seed: text("1"),
            repeat_results: None,
            warm_start_from_root: None,
            use_atlas: None,
            simulated_walks_effect: no_simulated_walks(),
            number_of_simulated_walks: String::new(),
            gait_rmse_tolerance_rad: String::new(),
            least_mean_strides: String::new(),
            nearest_within_percent: String::new(),
            initial_guesses: String::new(),
            local_optimum: String::new(),
            relaxed: false,
            space: BTreeMap::new(),
        }
    }
}

/// The option of the learner that keeps the settings of the cloned study, which the form cannot show.
pub(super) const KEPT_LEARNER: &str = "kept";

impl NewStudyFields {
    /// The study whose set-up applies, if any.
    pub(super) fn cloned(&self) -> Result<Option<StudyId>, Error> {
        let unknown = || Error::NotFound { what: "study".to_owned(), id: self.like.clone() };
        if self.like.is_empty() { Ok(None) } else { self.like.parse().map(Some).map_err(|_| unknown()) }
    }
}

impl TypedForm for NewStudyFields {
    const LABELS: FieldLabels = &[
        ("subject", "Subject"),
        ("pseudonym", "Pseudonym"),
        ("height_m", "Height"),
        ("body_mass_kg", "Body mass"),
        ("device", "Device"),
        ("reference_gait", "Reference gait"),
        ("muscles", "Variant"),
        ("answer_source", "Source of answers"),
        ("number_of_trials", "Number of trials"),
        ("name", "Name"),
        ("learner", "Learner"),
        ("unchanged_limit", "Stop early after"),
        ("parallel_trials", "Parallel trials"),
        ("seed", "Seed"),
        ("repeat_results", "Repeat known results"),
        ("use_atlas", "Take gaits from an atlas"),
        ("simulated_walks.effect", "Simulated walks"),
        ("simulated_walks.number_of_simulated_walks", "Number of simulated walks on each kind of ground"),
        ("simulated_walks.gait_rmse_tolerance_rad", "Gait RMSE tolerance, rad"),
        ("simulated_walks.least_mean_strides", "Minimum mean strides"),
        ("initial_guesses", "Initial guesses"),
        ("nearest_within_percent", "Objective tolerance, %"),
        ("local_optimum", "Local optimum"),
    ];

    /// The table of bounds is before the source of answers.
    fn labels(&self) -> Vec<(String, String)> {
        let mut labels = self.units.with_headings(Self::LABELS);
        let after =
            labels.split_off(labels.iter().position(|(name, _)| name == "answer_source").unwrap_or(labels.len()));
        for bound in TunedBounds::NAMES {
            labels.push((bound.to_owned(), bound.to_owned()));
            for (part, label) in
                [("tuned", "Tuned"), ("values", "Values"), ("lengthscale", "Lengthscale"), ("fixed", "Fixed value")]
            {
                labels.push((format!("{part}_{bound}"), format!("{label} of {bound}")));
            }
        }
        labels.extend(after);
        labels
    }

    /// A bound has one row in the table, whatever part of the study refuses it.
    fn field_of(&self, refused: &str) -> String {
        let last = refused.rsplit('.').next().filter(|last| TunedBounds::NAMES.contains(last));
        match last.unwrap_or(refused) {
            "device_id" => "device",
            "reference_gait_id" => "reference_gait",
            "atlas" => "use_atlas",
            other => other,
        }
        .to_owned()
    }

    fn field_in_conflict(&self) -> Option<&'static str> {
        Some(if self.subject == NEW_SUBJECT { "pseudonym" } else { "subject" })
    }

    fn repair(&mut self, field: &str) -> bool {
        let default = Self::default();
        let is_new = self.subject == NEW_SUBJECT;
        let text = |new: &str| if is_new { new.to_owned() } else { String::new() };
        match field {
            "name" => self.name.clear(),
            // A pseudonym that no subject can have.
            "pseudonym" => self.pseudonym = text(&unused_pseudonym()),
            "height_m" => self.height_m = text("1.75"),
            "body_mass_kg" => self.body_mass_kg = text("70"),
            "muscles" => self.muscles = default.muscles,
            "answer_source" => self.answer_source = default.answer_source,
            "learner" => self.learner = default.learner,
            "number_of_trials" => self.number_of_trials = default.number_of_trials,
            "unchanged_limit" => self.unchanged_limit.clear(),
            "parallel_trials" => self.parallel_trials = default.parallel_trials,
            "seed" => self.seed = default.seed,
            "repeat_results" => self.repeat_results = None,
            "use_atlas" => self.use_atlas = None,
            "simulated_walks.effect" => self.simulated_walks_effect = default.simulated_walks_effect,
            "simulated_walks.number_of_simulated_walks" => self.number_of_simulated_walks.clear(),
            "simulated_walks.gait_rmse_tolerance_rad" => self.gait_rmse_tolerance_rad.clear(),
            "simulated_walks.least_mean_strides" => self.least_mean_strides.clear(),
            "nearest_within_percent" => self.nearest_within_percent.clear(),
            "initial_guesses" => self.initial_guesses.clear(),
            "local_optimum" => self.local_optimum.clear(),
            _ => {
                let bound = field.rsplit('_').next().unwrap_or_default();
                if !TunedBounds::NAMES.contains(&bound) {
                    return false;
                }
                for part in ["values", "lengthscale", "fixed"] {
                    if field == bound || field == format!("tuned_{bound}") || field == format!("{part}_{bound}") {
                        self.space.remove(&format!("{part}_{bound}"));
                    }
                }
                if field == format!("tuned_{bound}") {
                    self.space.insert(field.to_owned(), "on".to_owned());
                }
            }
        }
        true
    }
}

/// The learners to choose from: value, label, and when to choose it. The benchmarks of the learner support this advice.
pub(super) const LEARNERS: [(&str, &str, &str); 3] = [
    ("linecospar", "LineCoSpar", "the method of the paper; for answers from people, which may sometimes be wrong"),
    ("eubo", "EUBO", "for answers from Gait RMSE; after 10 comparisons, closer to the best gait than LineCoSpar"),
    (
        "eubo_uncertain",
        "EUBO for uncertain answers",
        "for studies with 50 answers or more from people who are often unsure",
    ),
];

pub(super) fn learner(name: &str) -> Option<LearnerSettings> {
    match name {
        "linecospar" => Some(LearnerSettings::of(Method::LineCoSpar)),
        "eubo" => Some(LearnerSettings::of(Method::Eubo)),
        "eubo_uncertain" => Some(LearnerSettings::for_uncertain_answers()),
        _ => None,
    }
}

/// Effects of simulated walks: effect, label and explanation.
pub(super) const SIMULATED_WALKS_EFFECTS: [(SimulatedWalksEffect, &str, &str); 4] = [
    (SimulatedWalksEffect::None, "Nothing", "walks are simulated only on request, on the page of a gait"),
    (SimulatedWalksEffect::Report, "Report", "each gait gets an execution report; trials are not affected"),
    (
        SimulatedWalksEffect::TieBreak,
        "Break ties",
        "of two gaits with nearly the same Gait RMSE, the one with more mean strides is better",
    ),
    (
        SimulatedWalksEffect::Label,
        "Label gaits",
        "a gait with too few mean strides is not executable: the learner avoids it, and it is never recommended",
    ),
];

/// The option of the subject field that stands for a new subject.
pub(super) const NEW_SUBJECT: &str = "new";

/// The fields that describe a new subject.
pub(super) const DESCRIPTION: [&str; 3] = ["pseudonym", "height_m", "body_mass_kg"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relaxed_bound_keeps_its_looser_values() {
        let text = |text: &str| text.to_owned();
        let entries = [
            ("tuned_a5", "on"),
            ("values_a5", "0, 0.02, 0.04"),
            ("tuned_a7", "on"),
            ("values_a7", "10, 20, 30"),
            ("fixed_a6", "5.73"),
        ];
        let space = entries.iter().map(|(name, value)| (text(name), text(value))).collect();
        let mut fields = NewStudyFields { space, ..NewStudyFields::default() };
        fields.relax("a5=0.03,a7=30,a6=0.2").unwrap();
        assert_eq!(fields.space["values_a5"], "0, 0.02, 0.03", "a lower bound is looser where it is smaller");
        assert!(!fields.space.contains_key("tuned_a7"), "one value is not tuned");
        assert_eq!((fields.space["fixed_a7"].as_str(), fields.space["fixed_a6"].as_str()), ("30", "11.46"));
        assert!(fields.relax("a9=1").is_err() && fields.relax("a7=500").is_err());
    }

    #[test]
    fn every_field_of_the_form_can_be_repaired() {
        let mut fields = NewStudyFields { subject: NEW_SUBJECT.to_owned(), ..NewStudyFields::default() };
        for field in ["name", "pseudonym", "height_m", "seed", "values_a5", "tuned_a1", "a3"] {
            assert!(fields.repair(field), "{field}");
        }
        assert!(!fields.repair("subject") && !fields.repair("device"), "a list offers nothing else");
        assert!(fields.pseudonym.chars().all(char::is_alphabetic) && fields.pseudonym.len() <= 40);
    }
}
