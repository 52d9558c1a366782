//! The charts of a gait.

mod drawn_gait;
mod ground_forces;
mod group;
mod joint_accelerations;
mod joint_angles;
mod joint_torques;
mod leg_cycle;
mod legs;
mod limit_cycles;
mod muscle_states;
mod overlaid_gait;
mod reference_curve;
mod solve_charts;

pub use drawn_gait::drawn;
pub use group::Group;
pub use joint_angles::{
    MeasuredAngle, measured_beside_gaits, measured_beside_reference, of_reference, of_reference_in_one_chart,
    with_reference,
};
pub use limit_cycles::{limit_cycle, limit_cycles};
pub use reference_curve::band_in_words;
pub use solve_charts::solve;

use crate::{Animation, Chart, Figure, GaitWalker, Stroke};
use drawn_gait::STRIDE;
use gait_optimizer::gait::stick_figure::StickFigure;
use gait_optimizer::gait::{PhaseProgress, progress};
use gait_optimizer::{Gait, ModelError, ReferenceGait};
use leg_cycle::Cycle;

/// The phases of the stride, in their order, for either leg.
pub const PHASES: [(&str, &str); 4] = [
    ("DS2", "double support: heel of the leading foot and toe of the trailing foot on the ground"),
    ("DS3", "double support: leading foot flat, toe of the trailing foot still on the ground"),
    ("SS2", "single support on the flat foot while the other leg swings"),
    ("SS1", "single support on the toe until the other heel strikes"),
];

/// The gait as a picture that moves, for download.
pub fn animation(walker: GaitWalker) -> Figure {
    Figure::animation("Walking", Animation::new(walker))
}

/// The stride as a row of pictures.
pub fn tiles(figures: Vec<StickFigure>) -> Figure {
    Figure::tiles("The stride", figures)
}

/// All figures of a gait.
///
/// # Errors
/// When its subject or device is invalid.
pub fn of_gait(gait: &Gait, reference: &ReferenceGait) -> Result<Vec<Group>, ModelError> {
    let gait = &drawn(gait);
    let cycle = Cycle::of(gait);
    let mass_kg = gait.subject.body_mass_kg;
    let mut groups = vec![joint_angles::angles(&cycle, reference), ground_forces::forces(&cycle, mass_kg)];
    groups.extend(joint_torques::torques_and_powers(&cycle, mass_kg));
    if gait.muscles {
        groups.push(muscle_states::activations(&cycle));
        groups.push(muscle_states::forces(&cycle, gait));
        groups.push(muscle_states::fibre_lengths(&cycle));
    }
    groups.push(joint_accelerations::accelerations(&cycle));
    groups.push(progress_of(&cycle, gait)?);
    groups.push(limit_cycles::limit_cycle_group(&cycle));
    Ok(groups)
}

/// The figures of overlaid gaits, a chart for each joint of each leg. Groups have the names of those of one gait. Each gait
/// comes with its name.
pub fn of_several(gaits: &[(&str, &Gait)], reference: &ReferenceGait) -> Vec<Group> {
    let gaits = overlaid_gait::named(gaits);
    let gaits = overlaid_gait::overlaid(&gaits);
    let mut groups = vec![joint_angles::angles_of_several(&gaits, reference)];
    groups.extend(joint_torques::torques_and_powers_of_several(&gaits));
    groups
}

/// Phase and hip velocity, which the virtual constraints control in most domains.
fn progress_of(cycle: &Cycle<'_>, gait: &Gait) -> Result<Group, ModelError> {
    let made = progress(gait)?;
    let over = |value: fn(&PhaseProgress) -> f64| {
        let mut values = made.iter();
        cycle.over(|_| values.next().map_or(f64::NAN, value))
    };
    let velocity = Chart::new("Hip velocity", STRIDE, "velocity, m/s")
        .with("linearised", 0, Stroke::Solid, over(|point| point.hip_velocity_m_s))
        .with("hip", 1, Stroke::Dashed, cycle.over(|point| point.qd[0]));
    let phase = Chart::new("Phase", STRIDE, "phase variable, 0 to 1").with(
        "phase",
        0,
        Stroke::Solid,
        over(|point| point.phase),
    );
    let charts = vec![cycle.marked(velocity), cycle.marked(phase)];
    let hint = "The phase replaces time: it rises from 0 at the planned start of a domain to 1 at its planned end, in proportion \
                to the linearised position of the hip over the stance toe. Its velocity is constant in all domains but SS1.";
    Ok(Group::new("phase", "Hip velocity and phase", hint, charts))
}
