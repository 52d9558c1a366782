//! Digital Butterworth filters as cascades of second-order sections: analogue prototype, band transformation, and
//! bilinear transformation with prewarped edges (Oppenheim and Schafer, Discrete-Time Signal Processing).

use nalgebra::Complex;
use std::f64::consts::PI;

/// A section `(b0 + b1 z^-1 + b2 z^-2) / (1 + a1 z^-1 + a2 z^-2)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SecondOrderSection {
    pub(crate) b: [f64; 3],
    pub(crate) a: [f64; 2],
}

/// Twice the sampling rate, in units in which the Nyquist frequency is 1.
const TWICE_RATE: f64 = 4.0;

/// Poles in the upper half plane of the analogue low-pass with edge 1 rad/s; `order` is even.
fn prototype(order: usize) -> impl Iterator<Item = Complex<f64>> {
    let angle = move |k: usize| PI * (2 * k + 1) as f64 / (2 * order) as f64;
    (0..order / 2).map(move |k| Complex::new(-angle(k).sin(), angle(k).cos()))
}

/// Analogue frequency that the bilinear transformation maps to `share` of the Nyquist frequency.
fn prewarped(share: f64) -> f64 {
    TWICE_RATE * (0.5 * PI * share).tan()
}

/// The section of an analogue pole and its conjugate with the given numerator, scaled to gain 1 at `z`.
fn section(pole: Complex<f64>, b: [f64; 3], z: Complex<f64>) -> SecondOrderSection {
    let digital = (Complex::from(TWICE_RATE) + pole) / (Complex::from(TWICE_RATE) - pole);
    let a = [-2.0 * digital.re, digital.norm_sqr()];
    let back = z.inv();
    let gain = ((back * b[2] + b[1]) * back + b[0]) / ((back * a[1] + a[0]) * back + 1.0);
    SecondOrderSection { b: b.map(|c| c / gain.norm()), a }
}

/// Low-pass of an even order; `edge` is a share of the Nyquist frequency.
pub(crate) fn low_pass(order: usize, edge: f64) -> Vec<SecondOrderSection> {
    let warped = prewarped(edge);
    // Gain 1 at zero frequency.
    prototype(order).map(|pole| section(pole * warped, [1.0, 2.0, 1.0], Complex::from(1.0))).collect()
}

/// Band-pass of an even order per edge; edges are shares of the Nyquist frequency.
pub(crate) fn band_pass(order: usize, low: f64, high: f64) -> Vec<SecondOrderSection> {
    let (low, high) = (prewarped(low), prewarped(high));
    let (width, centre) = (high - low, (low * high).sqrt());
    // Gain 1 at the centre of the band.
    let turn = 2.0 * (centre / TWICE_RATE).atan();
    let at_centre = Complex::from_polar(1.0, turn);
    prototype(order)
        .flat_map(|pole| {
            let half = pole * (0.5 * width);
            let root = (half * half - Complex::from(centre * centre)).sqrt();
            [half + root, half - root]
        })
        .map(|pole| section(pole, [1.0, 0.0, -1.0], at_centre))
        .collect()
}
