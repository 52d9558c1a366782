//! Hermite-Simpson integration of z' = f over an interval of length h with nodes 0, m and 1: the coefficients of the
//! rows of midpoint and endpoint.

/// Coefficients of (z0, zm, z1).
pub(super) const STATE: [[f64; 3]; 2] = [[-0.5, 1.0, -0.5], [-1.0, 0.0, 1.0]];
/// Coefficients of h times (f0, fm, f1).
pub(super) const SLOPE: [[f64; 3]; 2] = [[-1.0 / 8.0, 0.0, 1.0 / 8.0], [-1.0 / 6.0, -4.0 / 6.0, -1.0 / 6.0]];
