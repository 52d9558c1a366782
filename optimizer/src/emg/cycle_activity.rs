//! Mean activity of a muscle over the gait cycle.

use super::envelope::Envelope;
use super::leg_strides::{CycleStart, LegStrides, is_left};
use crate::model_error::ModelError;
use crate::reference::{STRIDE_RANGE_S, is_plausible, strides_between};
use serde::{Deserialize, Serialize};

/// Number of points of a gait cycle: 0, 1, ..., 100 %.
pub const CYCLE_POINTS: usize = 101;

/// Activity of one channel at 0, 1, ..., 100 % of the gait cycle, as mean over strides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CycleActivity {
    /// Name of the channel.
    pub channel: String,
    /// Mean, in the unit of the recording or, after normalisation, relative to a peak.
    pub mean: Vec<f64>,
    /// Standard deviation over strides; 0 for one stride.
    pub standard_deviation: Vec<f64>,
    /// Number of strides.
    pub strides: usize,
    /// The heel strike at which the cycle begins. Results stored without it begin at that of the right foot.
    #[serde(default)]
    pub begins_at: CycleStart,
}

impl CycleActivity {
    /// Segments an envelope at heel strikes, in s and increasing. Drops strides of implausible duration and strides
    /// that the recording covers in part only.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] if no stride is left.
    pub fn cut(envelope: &Envelope, heel_strikes_s: &[f64]) -> Result<Self, ModelError> {
        Self::of_strides(envelope, &strides_between(heel_strikes_s))
    }

    /// The activity over the cycle in given strides, s.
    ///
    /// # Errors
    /// As [`Self::cut`].
    pub fn of_strides(envelope: &Envelope, strides: &[(f64, f64)]) -> Result<Self, ModelError> {
        let strides: Vec<(f64, f64)> = strides
            .iter()
            .copied()
            .filter(|stride| is_plausible(*stride))
            .filter(|(start, end)| *start >= envelope.start_s && *end <= envelope.end_s())
            .collect();
        if strides.is_empty() {
            let reason = format!("no stride within the recording lasts {} to {} s", STRIDE_RANGE_S.0, STRIDE_RANGE_S.1);
            return Err(ModelError::Malformed { what: format!("channel {}", envelope.channel), reason });
        }
        let count = strides.len() as f64;
        let (mut mean, mut standard_deviation) = (Vec::new(), Vec::new());
        for point in 0..CYCLE_POINTS {
            let share = point as f64 / (CYCLE_POINTS - 1) as f64;
            let samples: Vec<f64> = strides.iter().map(|(a, b)| envelope.at(a + share * (b - a))).collect();
            let middle = samples.iter().sum::<f64>() / count;
            let squares: f64 = samples.iter().map(|sample| (sample - middle).powi(2)).sum();
            mean.push(middle);
            standard_deviation.push(if strides.len() > 1 { (squares / (count - 1.0)).sqrt() } else { 0.0 });
        }
        let begins_at = CycleStart::RightHeelStrike;
        Ok(Self { channel: envelope.channel.clone(), mean, standard_deviation, strides: strides.len(), begins_at })
    }

    /// The same over the strides of the leg of the channel. If left heel strikes were not recorded, they are taken to be
    /// half a stride after the right ones.
    ///
    /// # Errors
    /// As [`Self::cut`].
    pub fn of_leg(envelope: &Envelope, strides: &LegStrides) -> Result<Self, ModelError> {
        if !is_left(&envelope.channel) {
            return Self::of_strides(envelope, &strides.right);
        }
        match &strides.left {
            Some(left) => Ok(Self { begins_at: CycleStart::LeftHeelStrike, ..Self::of_strides(envelope, left)? }),
            None => Ok(Self::of_strides(envelope, &strides.right)?.over_assumed_left_cycle()),
        }
    }

    /// The same cycle from the left heel strike, if that is half a stride after the right one. The cycle is periodic: its
    /// start follows its end.
    fn over_assumed_left_cycle(&self) -> Self {
        let last = CYCLE_POINTS - 1;
        let later = |values: &[f64]| {
            let place = |point: usize| if point > last { point - last } else { point };
            (0..CYCLE_POINTS).filter_map(|point| values.get(place(point + last / 2))).copied().collect()
        };
        Self {
            mean: later(&self.mean),
            standard_deviation: later(&self.standard_deviation),
            begins_at: CycleStart::AssumedLeftHeelStrike,
            ..self.clone()
        }
    }

    /// Largest mean activity over the cycle.
    pub fn peak(&self) -> f64 {
        self.mean.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Activity relative to the peak of normal walking. It may exceed 1.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] if normal walking has no activity.
    pub fn normalised_by(&self, normal_walking: &Self) -> Result<Self, ModelError> {
        let peak = normal_walking.peak();
        if peak.is_nan() || peak <= 0.0 {
            let reason =
                format!("the peak of the walk without the device is {peak}; normalisation needs a positive peak");
            return Err(ModelError::Malformed { what: format!("channel {}", self.channel), reason });
        }
        let divided = |values: &[f64]| values.iter().map(|value| value / peak).collect();
        Ok(Self { mean: divided(&self.mean), standard_deviation: divided(&self.standard_deviation), ..self.clone() })
    }

    /// The same channel of another gait.
    pub(super) fn same_channel<'a>(&self, gait: &'a [Self]) -> Result<&'a Self, ModelError> {
        let same = gait.iter().find(|activity| activity.channel == self.channel);
        same.ok_or_else(|| ModelError::Unknown {
            field: "channel".to_owned(),
            value: self.channel.clone(),
            known: format!(
                "one of {}, the channels of the other recording",
                gait.iter().map(|a| a.channel.as_str()).collect::<Vec<_>>().join(", ")
            ),
        })
    }

    /// Mean over the cycle.
    pub fn average(&self) -> f64 {
        self.mean.iter().sum::<f64>() / self.mean.len() as f64
    }
}
