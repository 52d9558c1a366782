//! The gait problem: the nonlinear program of the paper with variables, rows C1 to C12, objective and bounds.
//!
//! | constraint | rows here |
//! |---|---|
//! | C1 dynamics and contact | [`motion_and_contact_rows`], Hermite-Simpson of the zero dynamics in [`zero_dynamics_collocation`] |
//! | C2 (partial) hybrid zero dynamics, impact invariance, periodicity | [`virtual_constraint_rows`], [`hip_velocity_rows`], [`transitions`] |
//! | C3 physical limits: friction, touchdown; unilateral contact, clearance | [`contact_limits`]; [`foot_clearance`] |
//! | C4 bounds of the gait: tuned bounds, joints, torques, speed, steps | [`variable_bounds`], `joint_ranges`, [`stride`] |
//! | C5-C7 muscle force equilibrium | [`muscle_force_and_torque_rows`] |
//! | C8 fibre kinematics | [`fibre_collocation`] |
//! | C9-C12 joint torques of the muscles | [`muscle_force_and_torque_rows`] |

pub(crate) mod active_and_unchanged_bounds;
pub(crate) mod active_constraint;
mod contact_force_bounds;
pub mod contact_limits;
mod elimination_tree;
mod evaluation;
pub mod fibre_collocation;
pub mod foot_clearance;
mod gait_of_variables;
mod hermite_simpson;
pub mod hip_velocity_rows;
pub mod inter_node_check;
mod joint_ranges;
pub mod layout;
pub mod margins;
pub mod mesh_transfer;
pub mod motion_and_contact_rows;
pub mod muscle_force_and_torque_rows;
pub mod objective;
mod problem_definition;
pub mod program_data;
pub mod row_names;
pub mod rows;
pub mod sparse_entries;
pub mod stride;
pub mod transitions;
pub mod variable_bounds;
pub mod virtual_constraint_rows;
pub mod zero_dynamics_collocation;

pub(crate) use active_and_unchanged_bounds::ConvergedGait;
pub use active_and_unchanged_bounds::UnchangedBound;
pub use evaluation::RowViolation;
pub use gait_of_variables::gait_of;
pub use layout::{Layout, PointVariables};
pub use problem_definition::GaitProblem;
pub use program_data::{GaitProgram, ObjectiveWeights};
pub use row_names::{RowKind, RowName};
pub use rows::RowTable;
