//! Deserialisation of settings: missing fields take the recommended values of the method.

use serde::{Deserialize, Deserializer};

use super::{Inference, Labels, LearnerSettings, Method, Partner, Start};
use crate::interval_likelihood::Link;

/// Wraps the value of a present field, so that `null` stays distinct from a missing field.
fn given<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}

macro_rules! settings {
    ($($field:ident: $type:ty,)*) => {
        /// Settings of which any may be missing.
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct PartialSettings {
            #[serde(default, deserialize_with = "given")]
            method: Option<Method>,
            $(#[serde(default, deserialize_with = "given")]
            $field: Option<$type>,)*
        }

        impl From<PartialSettings> for LearnerSettings {
            fn from(given: PartialSettings) -> Self {
                let rest = given.method.map_or_else(Self::default, Self::of);
                Self { method: rest.method, $($field: given.$field.unwrap_or(rest.$field),)* }
            }
        }
    };
}

settings! {
    inference: Inference,
    link: Link,
    signal_variance: f64,
    nugget: f64,
    lengthscale_factor: f64,
    labels: Labels,
    start: Start,
    preference_noise: f64,
    ordinal_noise: f64,
    ordinal_thresholds: Vec<f64>,
    coactive_noise: f64,
    no_difference_noise: f64,
    no_difference_width: f64,
    avoidance: Option<f64>,
    samples_per_iteration: usize,
    repeats: bool,
    lines: usize,
    line_trials: Option<usize>,
    partner: Partner,
    buffer: usize,
}

impl<'de> Deserialize<'de> for LearnerSettings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        PartialSettings::deserialize(deserializer).map(Self::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> LearnerSettings {
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn method_alone_gives_its_recommended_settings() {
        for method in [Method::LineCoSpar, Method::Eubo, Method::Thompson, Method::InformationGain, Method::Random] {
            let name = serde_json::to_string(&method).unwrap();
            assert_eq!(read(&format!("{{\"method\":{name}}}")), LearnerSettings::of(method));
        }
        assert_eq!(read("{}"), LearnerSettings::default());
    }

    #[test]
    fn given_field_changes_that_field_only() {
        let eubo = LearnerSettings::of(Method::Eubo);
        assert_eq!(
            read(r#"{"preference_noise":0.05,"avoidance":-0.45,"method":"eubo"}"#),
            LearnerSettings { preference_noise: 0.05, avoidance: Some(-0.45), ..eubo.clone() }
        );
        assert_eq!(read(r#"{"method":"eubo","avoidance":null}"#), eubo);
        assert_eq!(
            read(r#"{"start":"centre"}"#),
            LearnerSettings { start: Start::Centre, ..LearnerSettings::default() }
        );
        for refused in [r#"{"method":null}"#, r#"{"method":"guess"}"#, r#"{"nose":1}"#, r#"{"buffer":null}"#] {
            assert!(serde_json::from_str::<LearnerSettings>(refused).is_err(), "{refused}");
        }
    }

    #[test]
    fn settings_round_trip_through_json() {
        let changed = LearnerSettings {
            avoidance: Some(-0.3),
            ordinal_thresholds: vec![-0.5, 0.3],
            repeats: true,
            ..LearnerSettings::of(Method::Eubo)
        };
        for settings in
            [changed, LearnerSettings::published(Method::Eubo), LearnerSettings::published(Method::LineCoSpar)]
        {
            let text = serde_json::to_string(&settings).unwrap();
            assert_eq!(read(&text), settings);
            assert_eq!(serde_json::to_string(&read(&text)).unwrap(), text);
        }
    }

    #[test]
    fn complete_document_overrides_every_recommendation() {
        let stored = r#"{"method":"eubo","inference":"laplace","link":"logistic","signal_variance":1.0,"nugget":1e-5,
            "lengthscale_factor":1.0,"labels":"in_utility",
            "start":"random","preference_noise":0.02,"ordinal_noise":0.1,"ordinal_thresholds":[0.0],
            "coactive_noise":0.02,"no_difference_noise":0.02,"no_difference_width":0.02,"avoidance":null,
            "samples_per_iteration":1,"repeats":false,"lines":0,"line_trials":null,
            "partner":"incumbent","buffer":1}"#;
        assert_eq!(read(stored), LearnerSettings { method: Method::Eubo, ..LearnerSettings::of(Method::LineCoSpar) });
    }
}
