//! Where an earlier solve ended, as a start.

use super::{GaitProblem, SolveError};
use crate::gait_problem::GaitProgramme;
use crate::nlp::{NonlinearProgram, WarmPoint};
use crate::settings::Mesh;
use serde::{Deserialize, Serialize};

/// Primal-dual point of an earlier solve of a problem of the same mesh and variant.
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

/// Refuses a start of another variant, mesh or size.
pub(super) fn check_shape(
    problem: &GaitProblem,
    programme: &GaitProgramme,
    warm: &WarmStart,
) -> Result<(), SolveError> {
    if warm.muscles != problem.muscles {
        return Err(SolveError::WarmStartShape(format!(
            "it is {} muscles, the problem is {} muscles",
            if warm.muscles { "with" } else { "without" },
            if problem.muscles { "with" } else { "without" }
        )));
    }
    if warm.mesh != problem.settings.mesh {
        return Err(SolveError::WarmStartShape(format!(
            "its mesh is {}, the problem's is {} (intervals of DS2,DS3,SS2,SS1)",
            in_words(&warm.mesh),
            in_words(&problem.settings.mesh)
        )));
    }
    let (n, m) = (programme.variables(), programme.rows());
    let point = &warm.point;
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

fn in_words(mesh: &Mesh) -> String {
    format!("{},{},{},{}", mesh.ds2, mesh.ds3, mesh.ss2, mesh.ss1)
}
