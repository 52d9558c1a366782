//! The limits of all quantities of a certificate, and between the nodes their thresholds.

use super::checked_quantity::Quantity;
use super::findings::MeasuredQuantity;

/// Vertical force above which a gait laboratory registers contact, N. Smaller violations are irrelevant in practice.
const CONTACT_THRESHOLD_N: f64 = 20.0;
/// Friction of that force at a coefficient of 0.6, N.
const FRICTION_THRESHOLD_N: f64 = 12.0;

// Residuals of the constraints.

// At nodes: 1e-6, the tolerance of a converged gait, times the scale of the row in the gait problem.
pub(super) const FORCE: MeasuredQuantity = MeasuredQuantity::new("C1 equations of motion, forces", "N", 1e-4, None);
pub(super) const MOMENT: MeasuredQuantity = MeasuredQuantity::new("C1 equations of motion, moments", "N m", 1e-4, None);
pub(super) const CONTACT_POSITION: MeasuredQuantity =
    MeasuredQuantity::new("C1 contact position", "m", 1e-6, Some(1e-3));
pub(super) const CONTACT_VELOCITY: MeasuredQuantity =
    MeasuredQuantity::new("C1 contact velocity", "m/s", 1e-6, Some(0.02));
pub(super) const CONTACT_ACCELERATION: MeasuredQuantity =
    MeasuredQuantity::new("C1 contact acceleration", "m/s²", 1e-5, Some(2.0));
pub(super) const OUTPUT: MeasuredQuantity = MeasuredQuantity::new("C2 virtual constraints", "rad", 1e-6, Some(1e-3));
pub(super) const OUTPUT_RATE: MeasuredQuantity =
    MeasuredQuantity::new("C2 virtual constraints, rate", "rad/s", 1e-6, Some(0.05));
pub(super) const HIP_POSITION: MeasuredQuantity = MeasuredQuantity::new("C2 hip position", "m", 1e-6, Some(1e-3));
pub(super) const HIP_VELOCITY: MeasuredQuantity = MeasuredQuantity::new("C2 hip velocity", "m/s", 1e-6, Some(0.02));
pub(super) const NORMAL_FORCE: MeasuredQuantity = MeasuredQuantity::new("C3 unilateral contact", "N", 1e-3, Some(5.0));
pub(super) const FRICTION: MeasuredQuantity =
    MeasuredQuantity::new("C3 friction cone", "N", 1e-3, Some(FRICTION_THRESHOLD_N));
pub(super) const KEPT_LOAD: MeasuredQuantity =
    MeasuredQuantity::new("C3 load of contacts before they lift off", "N", 1e-3, None);
pub(super) const PROGRESS: MeasuredQuantity =
    MeasuredQuantity::new("C3 forward hip velocity in SS1", "m/s", 1e-6, Some(0.02));
pub(super) const DEPTH: MeasuredQuantity =
    MeasuredQuantity::new("C3 depth of the feet below the ground", "m", 1e-7, Some(1e-3));
pub(super) const CLEARANCE: MeasuredQuantity =
    MeasuredQuantity::new("C3 shortfall of swing clearance (a5)", "m", 1e-7, Some(1e-3));
pub(super) const ANGLE: MeasuredQuantity =
    MeasuredQuantity::new("C4 joint angles beyond a6, a7, a8", "rad", 1e-6, Some(0.01));
pub(super) const SPEED: MeasuredQuantity = MeasuredQuantity::new("C4 velocities beyond a1", "rad/s", 3e-6, Some(0.1));
pub(super) const ACCELERATION: MeasuredQuantity =
    MeasuredQuantity::new("C4 accelerations beyond a2", "rad/s²", 3e-5, Some(5.0));
pub(super) const TORQUE: MeasuredQuantity =
    MeasuredQuantity::new("C4 torques beyond their limits", "N m", 1e-4, Some(2.0));
pub(super) const IMPACT: Quantity = Quantity::limited("C2 velocities after impacts", "rad/s", 1e-5);
pub(super) const IMPULSE: Quantity = Quantity::limited("C2 impulses of the impacts", "N s", 1e-4);
pub(super) const IMPULSE_SIZE: Quantity = Quantity::limited("C3 impulses beyond their limit", "N s", 1e-4);
pub(super) const IMPACT_FRICTION: Quantity = Quantity::limited("C3 friction cone of heel strikes", "N s", 1e-4);
pub(super) const RESET: Quantity = Quantity::limited("C2 continuity of the stride", "rad", 3e-6);
pub(super) const TOUCHDOWN: Quantity = Quantity::limited("C3 touchdown speed", "m/s", 1e-6);
pub(super) const STRIDE: Quantity = Quantity::limited("C4 hip velocity (a3, a4), steps, speed, durations", "", 1e-6);

// Residuals of the muscle constraints.

pub(super) const MUSCLE_FORCE: MeasuredQuantity =
    MeasuredQuantity::new("C5-C7 equilibrium of fibre and tendon", "F_max", 1e-6, None);
pub(super) const MUSCLE_VELOCITY: MeasuredQuantity =
    MeasuredQuantity::new("C8 fibre velocity", "l_opt/s", 1e-4, Some(0.5));
pub(super) const MUSCLE_LENGTH: MeasuredQuantity =
    MeasuredQuantity::new("C8 fibre lengths from their velocities", "l_opt", 1e-6, None);
pub(super) const MUSCLE_TORQUE: MeasuredQuantity =
    MeasuredQuantity::new("C9-C12 joint torques of the muscles", "N m", 1e-4, None);
pub(super) const MUSCLE_RANGE: MeasuredQuantity =
    MeasuredQuantity::new("C5-C8 activations, fibre lengths and velocities", "", 3e-6, Some(0.05));
pub(super) const MUSCLE_RESET: Quantity = Quantity::limited("C2 continuity of fibre lengths", "l_opt", 1e-6);

// The simulated walk of the closed loop.

pub(super) const CLOSED_LOOP_ORBIT_ANGLE: Quantity = Quantity::limited("orbit error, angles", "rad", 5e-3);
pub(super) const CLOSED_LOOP_ORBIT_RATE: Quantity = Quantity::limited("orbit error, rates", "rad/s", 0.05);
// An optimal gait unloads the trailing foot completely, on the boundary of contact and friction, and the simulation may
// cross it by the mesh error. The limit is the force below which a gait laboratory does not register contact.
pub(super) const CLOSED_LOOP_NORMAL_FORCE: Quantity = Quantity::limited("unilateral contact", "N", CONTACT_THRESHOLD_N);
pub(super) const CLOSED_LOOP_FRICTION: Quantity = Quantity::limited("friction cone", "N", FRICTION_THRESHOLD_N);
pub(super) const CLOSED_LOOP_TORQUE: Quantity = Quantity::limited("torques beyond their limits", "N m", 5.0);
pub(super) const CLOSED_LOOP_ANGLE: Quantity = Quantity::limited("joint angles beyond their limits", "rad", 0.01);
pub(super) const CLOSED_LOOP_SPEED: Quantity = Quantity::limited("velocities beyond their limits", "rad/s", 0.2);
pub(super) const CLOSED_LOOP_DEPTH: Quantity = Quantity::limited("depth of the feet below the ground", "m", 1e-3);
pub(super) const CLOSED_LOOP_IMPULSE: Quantity = Quantity::limited("tensile landing impulse", "N s", 0.0);
