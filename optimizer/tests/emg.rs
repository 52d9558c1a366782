//! Tests of EMG processing against SciPy and against values computed by hand.

#![allow(clippy::unwrap_used)]

mod golden_gaits;
mod noise;

use gait_optimizer::ModelError;
use gait_optimizer::emg::{
    CYCLE_POINTS, CycleActivity, CycleStart, EmgRecording, EmgSettings, Envelope, LegStrides, emg_rmse, model_activity,
};
use golden_gaits::golden_gait;
use noise::noise;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Written by `tests/data/emg_scipy.py`.
const SCIPY: &str = include_str!("data/emg_scipy.json");

/// The signal of the script: bursts of 83 Hz, a constant 211 Hz, a motion artefact of 7 Hz, and an offset.
fn raw(samples: usize) -> Vec<f64> {
    (0..samples)
        .map(|k| {
            let t = k as f64 / 1000.0;
            let burst = 0.1 + (TAU * t / 1.1).sin().max(0.0);
            burst * (TAU * 83.0 * t).sin() + 0.2 * (TAU * 211.0 * t + 1.0).sin() + 0.4 * (TAU * 7.0 * t).sin() + 0.5
        })
        .collect()
}

fn recording(samples: usize) -> EmgRecording {
    EmgRecording { start_s: 0.0, rate_hz: 1000.0, channels: vec![("TA".to_owned(), raw(samples))] }
}

#[test]
fn envelope_agrees_with_scipy() {
    let envelope = recording(4400).envelopes(&EmgSettings::default()).unwrap().remove(0);
    let scipy: Value = serde_json::from_str(SCIPY).unwrap();
    let every = usize::try_from(scipy["every"].as_u64().unwrap()).unwrap();
    let theirs: Vec<f64> = scipy["envelope"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert_eq!(theirs.len(), 84);
    for (ours, theirs) in envelope.values.iter().step_by(every).zip(theirs) {
        assert!((ours - theirs).abs() < 1e-9, "{ours} {theirs}");
    }
}

#[test]
fn invalid_settings_are_rejected_with_their_field() {
    let refusal = |change: &dyn Fn(&mut EmgSettings)| {
        let mut settings = EmgSettings::default();
        change(&mut settings);
        recording(4400).envelopes(&settings).unwrap_err().to_string()
    };
    assert!(refusal(&|s| s.band_high_hz = 500.0).starts_with("emg.band_high_hz is 500; it must be 21 to"));
    assert!(refusal(&|s| s.band_low_hz = 0.0).starts_with("emg.band_low_hz is 0;"));
    assert!(refusal(&|s| s.envelope_hz = f64::NAN).starts_with("emg.envelope_hz is NaN;"));
    assert!(refusal(&|s| s.order = 3).contains("emg.order is \"3\"; it must be 2, 4, 6 or 8."));
    let short = recording(27).envelopes(&EmgSettings::default()).unwrap_err().to_string();
    assert_eq!(short, "channel TA: the recording has 27 samples; the filters need at least 28.");
}

/// 0 to 2 s at 100 Hz, increasing by 1 per second.
#[test]
fn channels_without_muscle_signal_are_rejected() {
    let refused = |change: fn(&mut Vec<f64>)| {
        let mut changed = recording(2000);
        change(&mut changed.channels[0].1);
        changed.check_channels().unwrap_err().to_string()
    };
    assert_eq!(
        refused(|samples| samples.fill(0.25)),
        "channel TA: every sample is 0.25; check that the electrode was connected."
    );
    let artefact = refused(|samples| samples[700] = 1e6);
    assert!(
        artefact
            .starts_with("channel TA: the sample 1000000 at 0.7000 s is an artefact: it is more than 100 times as far"),
        "{artefact}"
    );
}

/// Bursts of noise of 0 to 1 twice a second, 4 s at 1000 Hz.
fn bursts() -> Vec<f64> {
    let burst = |k: usize| (TAU * 2.0 * k as f64 / 1000.0).sin().max(0.0) + 0.02;
    noise(4000).into_iter().enumerate().map(|(k, sample)| burst(k) * sample).collect()
}

#[test]
fn rectified_signals_and_envelopes_are_rejected() {
    let of =
        |samples: Vec<f64>| EmgRecording { start_s: 0.0, rate_hz: 1000.0, channels: vec![("TA".to_owned(), samples)] };
    let checked = |samples: Vec<f64>| of(samples).check_channels().map_err(|error| error.to_string());
    let scaled = |factor: f64, offset: f64| bursts().into_iter().map(|sample| factor * sample + offset).collect();
    assert_eq!(checked(bursts()), Ok(()));
    assert_eq!(checked(scaled(1e-6, 2e-3)), Ok(()), "a microvolt signal with an offset of amplifiers");
    let lowest = bursts().into_iter().fold(0.0, f64::min);
    assert_eq!(checked(scaled(1.0, -lowest)), Ok(()), "an offset that lifts all of it above zero, and no more");
    let moved = bursts().into_iter().enumerate().map(|(k, s)| s + 2.0 * (TAU * 1.8 * k as f64 / 1000.0).sin());
    assert_eq!(checked(moved.collect()), Ok(()), "movement five times as strong as the muscle");
    let rectified: Vec<f64> = bursts().into_iter().map(f64::abs).collect();
    let reason = checked(rectified.clone()).unwrap_err();
    assert!(reason.starts_with("channel TA: the signal is never negative and often near zero ("), "{reason}");
    println!("{reason}");
    // An envelope of this crate, a running mean over 100 ms, and an envelope with mean zero.
    let own = of(bursts()).envelopes(&EmgSettings::default()).unwrap().remove(0).values;
    let running: Vec<f64> = rectified.windows(100).map(|near| near.iter().sum::<f64>() / 100.0).collect();
    let about_zero = own.iter().map(|value| value - 0.3).collect();
    for (name, envelope) in [("own", own), ("running mean", running), ("about zero", about_zero)] {
        let reason = checked(envelope).unwrap_err();
        println!("{name}: {reason}");
        assert!(
            reason.contains("% of the signal (RMS) is between 20 and 450 Hz; a raw signal has at least 10 %. This looks like an envelope"),
            "{reason}"
        );
    }
    // Too short for the filters.
    assert_eq!(checked(bursts()[..25].to_vec()), Ok(()));
}

fn ramp() -> Envelope {
    let values = (0..=200).map(|k| f64::from(k) / 100.0).collect();
    Envelope { channel: "TA".to_owned(), start_s: 0.0, rate_hz: 100.0, values }
}

#[test]
fn cycle_is_the_mean_of_complete_strides() {
    // Two strides, from 0.0 and from 0.9. A third one would end after the recording, and a fourth one is too short.
    let cycle = CycleActivity::cut(&ramp(), &[0.0, 0.9, 1.8, 1.9, 2.9]).unwrap();
    assert_eq!((cycle.strides, cycle.mean.len()), (2, CYCLE_POINTS));
    // In the middle of the cycle: 0.45 and 1.35, mean 0.9, standard deviation 0.9 / sqrt(2).
    assert!((cycle.mean[50] - 0.9).abs() < 1e-12);
    assert!((cycle.standard_deviation[50] - 0.9 / 2.0_f64.sqrt()).abs() < 1e-12);
    assert!((cycle.peak() - 1.35).abs() < 1e-12 && (cycle.average() - 0.9).abs() < 1e-12);
    let none = CycleActivity::cut(&ramp(), &[0.0, 0.2]).unwrap_err().to_string();
    assert!(none.contains("no stride within the recording lasts 0.8 to 1.6 s"), "{none}");
}

/// The time since the last right heel strike, for strides of 1 s; 10 s at 1000 Hz.
fn since_right_heel_strike(channel: &str) -> Envelope {
    let values = (0..10_000).map(|k| f64::from(k % 1000) / 1000.0).collect();
    Envelope { channel: channel.to_owned(), start_s: 0.0, rate_hz: 1000.0, values }
}

#[test]
fn cycle_of_the_left_leg_begins_at_its_own_heel_strike() {
    let right: Vec<(f64, f64)> = (0..8).map(|stride| (f64::from(stride), f64::from(stride) + 1.0)).collect();
    let recorded = LegStrides {
        left: Some(right.iter().map(|(start, end)| (start + 0.6, end + 0.6)).collect()),
        right: right.clone(),
    };
    let assumed = LegStrides { right, left: None };
    for (channel, strides, begins_at, begin) in [
        ("TA_R", &recorded, CycleStart::RightHeelStrike, 0.0),
        ("TA", &assumed, CycleStart::RightHeelStrike, 0.0),
        ("TA_L", &recorded, CycleStart::LeftHeelStrike, 0.6),
        ("TA_L", &assumed, CycleStart::AssumedLeftHeelStrike, 0.5),
    ] {
        let cycle = CycleActivity::of_leg(&since_right_heel_strike(channel), strides).unwrap();
        assert_eq!((cycle.begins_at, cycle.strides, cycle.mean.len()), (begins_at, 8, CYCLE_POINTS));
        // In the middle of what follows the strike, and after the next right heel strike.
        for point in [0, 20, 90] {
            let expected = (begin + point as f64 / 100.0) % 1.0;
            assert!((cycle.mean[point] - expected).abs() < 2e-3, "{channel} {point}: {} {expected}", cycle.mean[point]);
        }
    }
}

fn flat(channel: &str, level: f64) -> CycleActivity {
    CycleActivity {
        channel: channel.to_owned(),
        mean: vec![level; CYCLE_POINTS],
        standard_deviation: vec![0.0; CYCLE_POINTS],
        strides: 1,
        begins_at: CycleStart::RightHeelStrike,
    }
}

#[test]
fn emg_rmse_matches_a_value_computed_by_hand() {
    let normal = [flat("TA", 0.5), flat("BF", 0.25)];
    // One channel differs by 0.2 at 51 of 101 points, the other by 0.3 at all points.
    let mut gait = [flat("BF", 0.55), flat("TA", 0.5)];
    gait[1].mean[..51].fill(0.7);
    let by_hand = (51.0 / 101.0_f64).sqrt() * 0.2 + 0.3;
    assert!((emg_rmse(&gait, &normal).unwrap().total - by_hand).abs() < 1e-12);
    let parts = emg_rmse(&gait, &normal).unwrap().parts;
    assert!((parts[0] - (51.0 / 101.0_f64).sqrt() * 0.2).abs() < 1e-12 && (parts[1] - 0.3).abs() < 1e-12);
    // More than ten times the peak of normal walking is doubtful.
    gait[0].mean[7] = 2.5;
    assert_eq!(emg_rmse(&gait, &normal).unwrap().warnings, [""; 0]);
    gait[0].mean[7] = 2.75;
    let doubted = [
        "the peak of BF is 11.0 times that of the walk without the device; check that both recordings have the same unit",
    ];
    assert_eq!(emg_rmse(&gait, &normal).unwrap().warnings, doubted);
    assert!(matches!(emg_rmse(&gait[..1], &normal), Err(ModelError::Unknown { value, .. }) if value == "TA"));

    let walked = flat("TA", 0.6).normalised_by(&normal[0]).unwrap();
    assert!((walked.mean[3] - 1.2).abs() < 1e-12, "prosthetic walking may exceed normal walking");
    assert!(walked.normalised_by(&flat("TA", 0.0)).is_err());
}

#[test]
fn malformed_tables_are_rejected_with_their_place() {
    let table = |change: &dyn Fn(&mut String)| {
        let mut text = "# site A\ntime_s,TA,BF\n".to_owned();
        for k in 0..60 {
            writeln!(text, "{},0.{k},1", f64::from(k) / 1000.0).unwrap();
        }
        change(&mut text);
        EmgRecording::from_csv("emg.csv", &text, None)
    };
    let whole = table(&|_| {}).unwrap();
    assert!((whole.rate_hz - 1000.0).abs() < 1e-6);
    assert!(whole.channels.iter().map(|(name, samples)| (name.as_str(), samples.len())).eq([("TA", 60), ("BF", 60)]));
    for (from, to, expected) in [
        ("\n0.01,0.10,1", "\n0.01,x,1", "emg.csv, line 13, column 2"),
        ("\n0.03,0.30,1\n", "\n0.0301,0.30,1\n0.0302,0,0\n", "rows must be evenly spaced"),
        ("time_s,", "time,", "it must be \"time_s\""),
        ("TA,BF", "TA,TA", "occurs twice"),
    ] {
        let refusal = table(&|text| *text = text.replace(from, to)).unwrap_err().to_string();
        assert!(refusal.contains(expected), "{refusal}");
    }
}

#[test]
fn table_without_time_needs_a_rate_and_foot_switch_gives_heel_strikes() {
    let mut text = "EMG 1,switch\n".to_owned();
    for k in 0..2500 {
        // The switch is closed for 0.6 s from 0.3 s, 1.4 s and 2.5 s.
        let down = k >= 300 && (k - 300) % 1100 < 600;
        writeln!(text, "0.5,{}", u8::from(down)).unwrap();
    }
    let recording = EmgRecording::from_csv("emg.csv", &text, Some(1000.0)).unwrap();
    assert!((recording.rate_hz - 1000.0).abs() < 1e-9 && (recording.end_s() - 2.499).abs() < 1e-9);
    let strikes = recording.strikes_of_column("emg.csv", "switch", 0.5).unwrap();
    assert_eq!(strikes.len(), 2, "{strikes:?}");
    for (strike, expected) in strikes.iter().zip([0.2995, 1.3995]) {
        assert!((strike - expected).abs() < 1e-9, "{strike}");
    }
    let chosen = recording.select("emg.csv", [("TA_L", "EMG 1")]).unwrap();
    assert_eq!(chosen.channels, [("TA_L".to_owned(), vec![0.5; 2500])]);
    let refusals = [
        EmgRecording::from_csv("emg.csv", &text, None).unwrap_err().to_string(),
        EmgRecording::from_csv("emg.csv", &text, Some(1.0)).unwrap_err().to_string(),
        recording.select("emg.csv", [("TA_L", "TA")]).unwrap_err().to_string(),
        recording.strikes_of_column("emg.csv", "EMG 1", 0.9).unwrap_err().to_string(),
        recording.check_strikes("emg.csv", &[0.3, 9.0]).unwrap_err().to_string(),
    ];
    for (refusal, expected) in refusals.iter().zip([
        "it must be \"time_s\"",
        "rate_hz is 1; it must be 100 to 20000.",
        "column \"TA\" (left tibialis anterior) is missing; the columns are EMG 1, switch",
        "no heel strike; a stride needs two. A heel strike is a rise above 0.9 that lasts at least 0.05 s, after",
        "heel_strikes_s is 9;",
    ]) {
        assert!(refusal.contains(expected), "{refusal}");
    }
}

#[test]
fn opensim_columns_become_channels() {
    let mut text = "emg\nversion=1\nnRows=40\nnColumns=2\nendheader\ntime TA\n".to_owned();
    for k in 0..40 {
        writeln!(text, "{}\t0.{k}", f64::from(k) / 1000.0).unwrap();
    }
    let recording = EmgRecording::from_opensim("emg.sto", &text).unwrap();
    assert_eq!(recording.channels[0].0, "TA");
    let half = EmgRecording::from_opensim("emg.sto", &text.replace("nRows=40", "nRows=41")).unwrap_err().to_string();
    assert!(
        half.contains("emg.sto, line 3: the header has nRows=41, but the file has 40; check that the file is complete"),
        "{half}"
    );
}

#[test]
fn model_activations_are_compared_with_channels_of_their_muscle() {
    let (_, gait) = golden_gait(1, true);
    let sole = |channel: &str| model_activity(&gait, &flat(channel, 0.5));
    assert!(sole("RF_L").is_none() && sole("SOL_L").is_none(), "the model has no rectus femoris");
    let biceps = sole("BF_R").unwrap();
    assert_eq!((biceps.muscle.as_str(), biceps.activation.len(), biceps.correlation), ("HAM_R", CYCLE_POINTS, None));
    let first = gait.domains[0].muscles.as_ref().unwrap().activation[0][7];
    assert!((biceps.activation[0] - first).abs() < 1e-12);
    let mut same = flat("BF_R", 0.0);
    same.mean.clone_from(&biceps.activation);
    let against_itself = model_activity(&gait, &same).unwrap();
    assert!(against_itself.rms_difference < 1e-12 && (against_itself.correlation.unwrap() - 1.0).abs() < 1e-12);
}

#[test]
fn activation_of_a_left_muscle_begins_at_left_heel_strike_like_its_channel() {
    let (_, gait) = golden_gait(1, true);
    let left = gait.domains.iter().find(|domain| domain.name == "DS2_L").unwrap();
    let from = |begins_at| CycleActivity { begins_at, ..flat("TA_L", 0.5) };
    let recorded = model_activity(&gait, &from(CycleStart::LeftHeelStrike)).unwrap();
    let first = left.muscles.as_ref().unwrap().activation[0][6];
    assert!((recorded.activation[0] - first).abs() < 1e-6, "{} {first}", recorded.activation[0]);
    let before = gait.domains.iter().take_while(|domain| domain.name != "DS2_L").last().unwrap();
    let last = before.muscles.as_ref().unwrap().activation.last().unwrap()[6];
    assert!((recorded.activation[100] - last).abs() < 1e-6, "{} {last}", recorded.activation[100]);
    let assumed = model_activity(&gait, &from(CycleStart::AssumedLeftHeelStrike)).unwrap();
    assert_eq!(assumed.activation, recorded.activation);
    // A measurement that follows the model from left heel strike agrees with it there and nowhere else.
    let same = |begins_at| CycleActivity { mean: recorded.activation.clone(), ..from(begins_at) };
    let agrees = |begins_at| model_activity(&gait, &same(begins_at)).unwrap().correlation.unwrap();
    assert!(agrees(CycleStart::LeftHeelStrike) > 0.999_999);
    assert!(agrees(CycleStart::RightHeelStrike) < 0.9, "{}", agrees(CycleStart::RightHeelStrike));
}
