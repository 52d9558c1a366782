//! Warm starts: the result of a solve as a starting point.

use super::error::SolveError;
use crate::gait_problem::margins::Margins;
use crate::gait_problem::{GaitProblem, GaitProgram, mesh_transfer};
use crate::settings::Mesh;
use interior_point::{NonlinearProgram, WarmPoint};
use serde::{Deserialize, Serialize};

/// The primal-dual point of a solve of the same variant, on any mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WarmStart {
    /// Variant of the solve.
    pub muscles: bool,
    /// Mesh of the solve.
    pub mesh: Mesh,
    /// Scaled primal variables and all multipliers.
    pub point: WarmPoint,
    /// Bounds that were tightened because of violations between nodes.
    #[serde(default, skip_serializing_if = "Margins::is_empty")]
    pub margins: Margins,
}

/// A starting point on the mesh of a problem.
pub(super) struct MeshStart {
    pub(super) point: WarmPoint,
    pub(super) margins: Margins,
    pub(super) strategy: &'static str,
}

/// Converts a warm start to the mesh of `program`. Margins belong to a mesh and are dropped on another one.
///
/// # Errors
/// [`SolveError::WarmStartShape`] if variant or dimensions differ.
pub(super) fn on_mesh_of(
    problem: &GaitProblem,
    program: &GaitProgram,
    warm: &WarmStart,
) -> Result<MeshStart, SolveError> {
    if warm.muscles != problem.muscles {
        return Err(SolveError::WarmStartShape(format!(
            "the gait has {}, but the problem has {}",
            if warm.muscles { "muscles" } else { "no muscles" },
            if problem.muscles { "muscles" } else { "none" }
        )));
    }
    if warm.mesh == problem.settings.mesh {
        check_shape(program, warm)?;
        return Ok(MeshStart { point: warm.point.clone(), margins: warm.margins.clone(), strategy: "warm start" });
    }
    let mut of_its_mesh = problem.clone();
    of_its_mesh.settings.mesh = warm.mesh;
    let own = of_its_mesh.program(problem.muscles)?;
    check_shape(&own, warm)?;
    Ok(MeshStart {
        point: mesh_transfer::transfer(&own, program, &warm.point),
        margins: Margins::default(),
        strategy: "warm start from another mesh",
    })
}

pub(crate) fn check_shape(program: &GaitProgram, warm: &WarmStart) -> Result<(), SolveError> {
    let point = &warm.point;
    let (n, m) = (program.variables(), program.rows());
    for (name, found, expected) in [
        ("variables", point.x.len(), n),
        ("lower multipliers", point.lower_multipliers.len(), n),
        ("upper multipliers", point.upper_multipliers.len(), n),
        ("row multipliers", point.row_multipliers.len(), m),
        ("slacks", point.slacks.len(), m),
        ("lower slack multipliers", point.slack_lower_multipliers.len(), m),
        ("upper slack multipliers", point.slack_upper_multipliers.len(), m),
    ] {
        if found != expected {
            return Err(SolveError::WarmStartShape(format!("it has {found} {name}; the problem has {expected}")));
        }
    }
    if !warm.margins.fit(n, m) {
        return Err(SolveError::WarmStartShape(
            "its margins are negative, or do not match its variables and rows".to_owned(),
        ));
    }
    Ok(())
}
