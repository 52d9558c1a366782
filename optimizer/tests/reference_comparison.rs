//! Distances of golden gaits from reference gaits.

#![allow(clippy::unwrap_used)]

mod golden_gaits;

use gait_optimizer::gait_rmse::gait_rmse;
use gait_optimizer::reference::REFERENCE_ROWS;
use gait_optimizer::reference_comparison::compare_with_references;
use gait_optimizer::{Gait, ReferenceGait};
use golden_gaits::golden_gait;

/// The five human coordinates of a gait as a reference gait, delayed by a fraction of the stride.
fn reference_of(gait: &Gait, delay: f64, standard_deviation_rad: Option<f64>) -> ReferenceGait {
    let rows = (0..REFERENCE_ROWS).map(|row| {
        let fraction = row as f64 / (REFERENCE_ROWS - 1) as f64;
        let angles = gait.coordinates_at((fraction - delay).rem_euclid(1.0) * gait.stride_time_s);
        std::array::from_fn(|i| angles[2 + i])
    });
    ReferenceGait {
        name: "itself".to_owned(),
        provenance: String::new(),
        angles_rad: rows.collect(),
        standard_deviation_rad: standard_deviation_rad.map(|value| vec![[value; 5]; REFERENCE_ROWS]),
        height_m: None,
        body_mass_kg: None,
    }
}

#[test]
fn built_in_reference_gaits_are_compared_whichever_one_the_problem_has() {
    let (_, gait) = golden_gait(1, true);
    let builtin = ReferenceGait::all_builtin().unwrap();
    for (_, of_the_problem) in &builtin {
        let comparisons = compare_with_references(&gait, of_the_problem).unwrap();
        assert_eq!(comparisons.len(), builtin.len());
        assert_eq!(comparisons[0].reference_gait, of_the_problem.name);
        assert_eq!(comparisons.iter().filter(|one| one.of_the_problem).count(), 1);
        for comparison in &comparisons {
            let (_, reference) = builtin.iter().find(|(_, one)| one.name == comparison.reference_gait).unwrap();
            assert_eq!(comparison.gait_rmse_rad, gait_rmse(&gait, reference).total);
            assert!(comparison.aligned_gait_rmse_rad <= comparison.gait_rmse_rad);
            let sum_rad: f64 = comparison.parts_deg.iter().map(|part| part.to_radians()).sum();
            assert!((sum_rad - comparison.gait_rmse_rad).abs() < 1e-12, "{comparison:?}");
            let deviations = reference.standard_deviation_rad.is_some();
            assert_eq!(comparison.parts_in_standard_deviations.is_some(), deviations);
        }
    }
    assert_eq!(compare_with_references(&gait, &reference_of(&gait, 0.0, None)).unwrap().len(), builtin.len() + 1);
}

#[test]
fn late_gait_is_aligned_by_the_delay() {
    let (_, gait) = golden_gait(2, true);
    // The reference gait is ahead of the gait by 3 % of the stride.
    let comparison = &compare_with_references(&gait, &reference_of(&gait, -0.03, None)).unwrap()[0];
    assert!((comparison.shift_percent - 3.0).abs() < 1e-9, "{comparison:?}");
    assert!(comparison.aligned_gait_rmse_rad < 0.2 * comparison.gait_rmse_rad, "{comparison:?}");
}

#[test]
fn difference_of_one_standard_deviation_counts_as_one() {
    let (_, gait) = golden_gait(1, false);
    let mut reference = reference_of(&gait, 0.0, Some(0.05));
    reference.angles_rad.iter_mut().for_each(|row| row[2] += 0.05);
    let comparison = &compare_with_references(&gait, &reference).unwrap()[0];
    let parts = comparison.parts_in_standard_deviations.unwrap();
    assert!((parts[2] - 1.0).abs() < 1e-9 && parts[0].abs() < 1e-9, "{parts:?}");
    reference.standard_deviation_rad.as_mut().unwrap()[7][2] = 0.0;
    assert_eq!(compare_with_references(&gait, &reference).unwrap()[0].parts_in_standard_deviations, None);
}

#[test]
fn built_in_reference_gaits_differ_as_two_groups_of_people_do() {
    let [(_, falisse), (_, fukuchi)] = ReferenceGait::all_builtin().unwrap();
    fukuchi.validate().unwrap();
    // The two share the torso. Distances between published sets of healthy adults are about 0.46 rad.
    let squares = (0..100).map(|row| {
        let pairs = falisse.angles_rad[row].iter().zip(fukuchi.angles_rad[row]);
        pairs.map(|(one, other)| (one - other).powi(2)).collect::<Vec<_>>()
    });
    let sums = squares.fold(vec![0.0; 5], |sum, row| sum.iter().zip(row).map(|(s, r)| s + r).collect());
    let total: f64 = sums.iter().map(|sum| (sum / 100.0).sqrt()).sum();
    assert!(sums[0] == 0.0 && (0.40..0.50).contains(&total), "{total}");
}
