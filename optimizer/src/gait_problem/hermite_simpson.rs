//! Hermite-Simpson integration of z' = f over an interval of length h with nodes 0, m and 1: the rows of midpoint and
//! endpoint, and their coefficients.

/// Coefficients of (z0, zm, z1).
pub(super) const STATE: [[f64; 3]; 2] = [[-0.5, 1.0, -0.5], [-1.0, 0.0, 1.0]];
/// Coefficients of h times (f0, fm, f1).
pub(super) const SLOPE: [[f64; 3]; 2] = [[-1.0 / 8.0, 0.0, 1.0 / 8.0], [-1.0 / 6.0, -4.0 / 6.0, -1.0 / 6.0]];

/// Values of the rows of midpoint and endpoint.
pub(super) fn values(h: f64, [z0, zm, z1]: [f64; 3], [f0, fm, f1]: [f64; 3]) -> [f64; 2] {
    [zm - 0.5 * (z0 + z1) - h / 8.0 * (f0 - f1), z1 - z0 - h / 6.0 * (f0 + 4.0 * fm + f1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_the_sums_of_the_coefficients() {
        let (h, z, f) = (0.3, [0.7, -1.1, 0.4], [2.0, -0.6, 1.3]);
        for (kind, value) in values(h, z, f).into_iter().enumerate() {
            let sum: f64 = (0..3).map(|i| STATE[kind][i] * z[i] + h * SLOPE[kind][i] * f[i]).sum();
            assert!((value - sum).abs() < 1e-15, "{value} {sum}");
        }
    }
}
