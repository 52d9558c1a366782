//! Flags for the subject and the variant.

use super::flag_names::of_flags;
use super::flag_numbers::{number, subject};
use clap::{Args, ValueEnum};
use gait_optimizer::Subject;
use gaitwright_service::error::Error;

/// The subject: one of the paper's, or a height and a mass.
#[derive(Debug, Clone, Args)]
pub(super) struct SubjectFlags {
    /// Subject from the paper: 1 (female, 1.727 m, 65.7 kg) or 2 (male, 1.803 m, 75 kg) (default: 1).
    #[arg(long, value_name = "NUMBER", value_parser = subject, allow_negative_numbers = true, conflicts_with_all = ["height_m", "body_mass_kg"])]
    subject: Option<u32>,
    /// Body height, m. Give it with --body-mass-kg, in place of --subject.
    #[arg(long, value_name = "METRES", value_parser = number, allow_negative_numbers = true, requires = "body_mass_kg")]
    height_m: Option<f64>,
    /// Body mass, kg. Give it with --height-m, in place of --subject.
    #[arg(long, value_name = "KILOGRAMS", value_parser = number, allow_negative_numbers = true, requires = "height_m")]
    body_mass_kg: Option<f64>,
}

impl SubjectFlags {
    /// The subject, validated.
    pub(super) fn subject(&self) -> Result<Subject, Error> {
        let subject = match (self.height_m, self.body_mass_kg) {
            (Some(height), Some(mass)) => Subject::new(height, mass),
            _ => Subject::builtin(self.subject.unwrap_or(1)),
        };
        let flags = [("height_m", "--height-m"), ("body_mass_kg", "--body-mass-kg"), ("subject", "--subject")];
        subject.map_err(|error| of_flags(error, &flags))
    }
}

/// Whether to solve with muscles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Switch {
    /// With muscles (constraints C1 to C12 of the paper).
    On,
    /// Without muscles (constraints C1 to C4 of the paper).
    Off,
}

impl Switch {
    pub(super) fn is_on(self) -> bool {
        self == Self::On
    }
}
