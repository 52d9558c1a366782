//! Where an earlier solve ended, as a start.

use super::{GaitProblem, SolveError};
use crate::gait_problem::{GaitProgramme, mesh_transfer};
use crate::nlp::{NonlinearProgram, WarmPoint};
use crate::settings::Mesh;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Primal-dual point of an earlier solve of a problem of the same variant, on this mesh or another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WarmStart {
    /// Variant it belongs to.
    pub muscles: bool,
    /// Mesh it belongs to.
    pub mesh: Mesh,
    /// Scaled primal variables and all multipliers.
    pub point: WarmPoint,
}

/// The start on the mesh of `programme`. Refuses one of another variant or size.
pub(super) fn on_mesh_of<'a>(
    problem: &GaitProblem,
    programme: &GaitProgramme,
    warm: &'a WarmStart,
) -> Result<Cow<'a, WarmPoint>, SolveError> {
    if warm.muscles != problem.muscles {
        return Err(SolveError::WarmStartShape(format!(
            "it is {} muscles, the problem is {} muscles",
            if warm.muscles { "with" } else { "without" },
            if problem.muscles { "with" } else { "without" }
        )));
    }
    if warm.mesh == problem.settings.mesh {
        check_shape(programme, &warm.point)?;
        return Ok(Cow::Borrowed(&warm.point));
    }
    let mut of_its_mesh = problem.clone();
    of_its_mesh.settings.mesh = warm.mesh;
    let own = of_its_mesh.programme(problem.muscles)?;
    check_shape(&own, &warm.point)?;
    Ok(Cow::Owned(mesh_transfer::transfer(&own, programme, &warm.point)))
}

fn check_shape(programme: &GaitProgramme, point: &WarmPoint) -> Result<(), SolveError> {
    let (n, m) = (programme.variables(), programme.rows());
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
            return Err(SolveError::WarmStartShape(format!("{found} {name}, expected {expected}")));
        }
    }
    Ok(())
}
