//! Bernstein basis of degree 5, of which Bezier polynomials are sums, with its first four derivatives.

/// Degree of the curves of the outputs.
pub const BEZIER_DEGREE: usize = 5;
/// Number of coefficients of an output.
pub const BEZIER_COEFFICIENTS: usize = BEZIER_DEGREE + 1;

/// `basis(s)[r][i]` is the r-th derivative with respect to s of `C(5, i) s^i (1 - s)^(5 - i)`, r = 0 to 4.
///
/// Outside \[0, 1\] the polynomials continue.
#[inline]
pub fn basis(s: f64) -> [[f64; BEZIER_COEFFICIENTS]; 5] {
    let mut result = [[0.0; BEZIER_COEFFICIENTS]; 5];
    // From Bernstein polynomials of degree 5 - r by r differentiations,
    // B'_{i,n} = n (B_{i-1,n-1} - B_{i,n-1}).
    for (r, row) in result.iter_mut().enumerate() {
        let low = BEZIER_DEGREE - r;
        let mut values = [0.0; BEZIER_COEFFICIENTS];
        bernstein(low, s, &mut values);
        for n in low + 1..=BEZIER_DEGREE {
            let factor = n as f64;
            for i in (0..=n).rev() {
                let left = if i > 0 { values[i - 1] } else { 0.0 };
                let right = if i < n { values[i] } else { 0.0 };
                values[i] = factor * (left - right);
            }
        }
        *row = values;
    }
    result
}

/// Writes the Bernstein polynomials of degree n at s to `values[..=n]`.
#[inline]
fn bernstein(n: usize, s: f64, values: &mut [f64; BEZIER_COEFFICIENTS]) {
    values[0] = 1.0;
    let rest = 1.0 - s;
    for degree in 1..=n {
        for i in (0..=degree).rev() {
            let left = if i > 0 { s * values[i - 1] } else { 0.0 };
            let right = if i < degree { rest * values[i] } else { 0.0 };
            values[i] = left + right;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn derivatives_match_differences_and_values_sum_to_one(s in -0.2..1.2_f64) {
            let h = 1e-5;
            let (low, mid, high) = (basis(s - h), basis(s), basis(s + h));
            prop_assert!((mid[0].iter().sum::<f64>() - 1.0).abs() < 1e-12);
            for r in 0..4 {
                for i in 0..BEZIER_COEFFICIENTS {
                    let difference = (high[r][i] - low[r][i]) / (2.0 * h);
                    prop_assert!((difference - mid[r + 1][i]).abs() < 1e-5 * (1.0 + mid[r + 1][i].abs()));
                }
            }
        }
    }

    #[test]
    fn curve_passes_through_its_end_coefficients() {
        assert_eq!(basis(0.0)[0], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(basis(1.0)[0], [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(basis(0.0)[1], [-5.0, 5.0, 0.0, 0.0, 0.0, 0.0]);
    }
}
