//! Flags in errors of the rules, which name fields.

use gaitwright_service::error::Error;

/// The error with the name of the flag in place of the field that it sets. The others keep their names.
pub(super) fn of_flags(error: impl Into<Error>, flags: &[(&str, &str)]) -> Error {
    match error.into() {
        Error::Invalid(refused) => match flags.iter().find(|(field, _)| *field == refused.field) {
            Some((field, flag)) => refused.renamed(field, flag).into(),
            None => Error::Invalid(refused),
        },
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gait_optimizer::Subject;

    #[test]
    fn error_names_the_flag_of_its_field_alone() {
        let flags = [("height_m", "--height-m")];
        let refused = |height, mass| of_flags(Subject::new(height, mass).unwrap_err(), &flags).to_string();
        assert_eq!(refused(5.0, 70.0), "--height-m is 5; it must be 1.4 to 2.2.");
        assert_eq!(refused(1.7, 7.0), "body_mass_kg is 7; it must be 35 to 160.");
    }
}
