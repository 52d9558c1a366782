//! Bounds of contact forces: forces press on the ground, the load of the trailing foot decreases, and a contact unloads
//! before it ends.

use crate::body::Axis;
use crate::settings::GaitLimits;
use crate::walking::{ContactRow, Domain, DomainKind};

/// Smallest vertical force under the trailing foot, N: it decreases linearly from heel strike to toe-off.
fn trailing_load(kind: DomainKind, sigma: f64, at_heel_strike_n: f64) -> f64 {
    match kind {
        DomainKind::Ds2 => at_heel_strike_n * (1.0 - 0.5 * sigma),
        DomainKind::Ds3 => at_heel_strike_n * 0.5 * (1.0 - sigma),
        DomainKind::Ss2 | DomainKind::Ss1 => 0.0,
    }
}

/// Bounds of contact force `c` of a domain, N, at the share `sigma` of its duration; `last` at its end.
pub(super) fn contact_force_bounds(
    limits: &GaitLimits,
    domain: Domain,
    c: usize,
    row: ContactRow,
    sigma: f64,
    last: bool,
    load_at_heel_strike_n: f64,
) -> (f64, f64) {
    if last && domain.unloaded_rows().contains(&c) {
        return (0.0, 0.0);
    }
    let largest = limits.contact_force_max_n;
    let mut low = match row.axis {
        Axis::X => -largest,
        Axis::Z if row.side != domain.stance => trailing_load(domain.kind, sigma, load_at_heel_strike_n),
        Axis::Z => 0.0,
    };
    if domain.unloading_row() == Some(c) {
        low = low.max(limits.liftoff_force_n * (1.0 - sigma));
    }
    (low, largest)
}
