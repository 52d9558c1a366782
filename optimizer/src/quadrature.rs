//! Quadrature over the equidistant nodes of a domain.

/// Composite Simpson weight of node k of an odd number of nodes; the weights sum to 1.
#[inline]
pub(crate) fn simpson(k: usize, points: usize) -> f64 {
    let weight = if k % 2 == 1 {
        4.0
    } else if k == 0 || k == points - 1 {
        1.0
    } else {
        2.0
    };
    weight / (6.0 * ((points - 1) / 2) as f64)
}
