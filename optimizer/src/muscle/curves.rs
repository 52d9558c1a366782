//! The three curves of a muscle-tendon unit, with first and second derivatives.
//!
//! The published curves (Geyer, Seyfarth and Blickhan 2003) have corners, which are smoothed here: the slope of the
//! force-velocity curve jumps from 6 to 19.4 at zero velocity, and the curvature of the tendon curve jumps at slack
//! length. Tests check the stated fit errors.

/// Value, first and second derivative of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveValue {
    /// Value.
    pub value: f64,
    /// First derivative.
    pub first: f64,
    /// Second derivative.
    pub second: f64,
}

/// Width of the force-length curve, in optimal fibre lengths.
const WIDTH: f64 = 0.56;
/// Logarithm of the relative force at one width from the optimum, ln 0.05.
const LN_C: f64 = -2.995_732_273_553_991;
/// Smoothing of |y|^3 at 0.
const FORCE_LENGTH_ROUNDING: f64 = 1e-6;

/// Force-length curve `exp(ln(0.05) |x - 1|^3 / 0.56^3)` at fibre length x (optimal fibre lengths), with |y|^3 smoothed
/// to `y^2 sqrt(y^2 + 1e-6)`. Largest difference from the published curve: 5.2e-7.
#[inline]
pub fn force_length(x: f64) -> CurveValue {
    let y = (x - 1.0) / WIDTH;
    let y2 = y * y;
    let r = (y2 + FORCE_LENGTH_ROUNDING).sqrt();
    // h = y^2 r;  h' = 2 y r + y^3 / r;  h'' = 2 r + 5 y^2 / r - y^4 / r^3
    let h = y2 * r;
    let h1 = 2.0 * y * r + y * y2 / r;
    let h2 = 2.0 * r + 5.0 * y2 / r - y2 * y2 / (r * r * r);
    let value = (LN_C * h).exp();
    let g1 = LN_C * h1 / WIDTH;
    let g2 = LN_C * h2 / (WIDTH * WIDTH);
    CurveValue { value, first: value * g1, second: value * (g1 * g1 + g2) }
}

/// Smoothing of the corner of the force-velocity curve.
const FORCE_VELOCITY_ROUNDING: f64 = 0.01;

/// Force-velocity curve at relative fibre velocity nu = v_ce / V (negative in shortening): concentric `(1 + nu)/(1 - 5
/// nu)` and eccentric `1.5 - 0.5 (1 - nu)/(1 + 37.8 nu)`, joined smoothly. Difference from the published curve on [-1,
/// 1]: RMS 0.004, largest 0.052 (at 0).
#[inline]
pub fn force_velocity(nu: f64) -> CurveValue {
    let d2 = FORCE_VELOCITY_ROUNDING * FORCE_VELOCITY_ROUNDING;
    let r = (nu * nu + d2).sqrt();
    let (a, b) = (0.5 * (nu - r), 0.5 * (nu + r));
    let a1 = 0.5 * (1.0 - nu / r);
    let b1 = 0.5 * (1.0 + nu / r);
    let curvature = 0.5 * d2 / (r * r * r);
    // c(a) = (1 + a)/(1 - 5 a): c' = 6/(1 - 5 a)^2, c'' = 60/(1 - 5 a)^3
    let ca = 1.0 / (1.0 - 5.0 * a);
    let c1 = 6.0 * ca * ca;
    let c2 = 60.0 * ca * ca * ca;
    // e(b) = 1.5 - 0.5 (1 - b)/(1 + 37.8 b): e' = 0.5 * 38.8/(1 + 37.8 b)^2, e'' = -38.8 * 37.8/(1 + 37.8 b)^3
    let eb = 1.0 / (1.0 + 37.8 * b);
    let e1 = 19.4 * eb * eb;
    let e2 = -38.8 * 37.8 * eb * eb * eb;
    CurveValue {
        value: (1.0 + a) * ca + 1.5 - 0.5 * (1.0 - b) * eb - 1.0,
        first: c1 * a1 + e1 * b1,
        second: c2 * a1 * a1 - c1 * curvature + e2 * b1 * b1 + e1 * curvature,
    }
}

/// Tendon strain at maximum isometric force.
const REFERENCE_STRAIN: f64 = 0.04;
/// Smoothing of the corner at slack length, strain.
const TENDON_ROUNDING: f64 = 0.002;

/// Tendon force / F_max at strain e: `(max(e, 0) / 0.04)^2`, with max(e, 0) smoothed to `(e + sqrt(e^2 + 0.002^2))/2`.
/// Largest difference from the published curve: 1.3e-3.
#[inline]
pub fn tendon_force(e: f64) -> CurveValue {
    let d2 = TENDON_ROUNDING * TENDON_ROUNDING;
    let r = (e * e + d2).sqrt();
    // The conjugate form avoids the cancellation of e + r in a slack tendon.
    let sum = if e >= 0.0 { e + r } else { d2 / (r - e) };
    let scale = 1.0 / (2.0 * REFERENCE_STRAIN);
    let g = scale * sum;
    let g1 = g / r;
    let g2 = scale * d2 / (r * r * r);
    CurveValue { value: g * g, first: 2.0 * g * g1, second: 2.0 * (g1 * g1 + g * g2) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(curve: fn(f64) -> CurveValue, x: f64) {
        let step = 1e-5;
        let (low, mid, high) = (curve(x - step), curve(x), curve(x + step));
        let first = (high.value - low.value) / (2.0 * step);
        let second = (high.first - low.first) / (2.0 * step);
        let scale = 1.0 + mid.first.abs() + mid.second.abs();
        assert!((first - mid.first).abs() < 3e-5 * scale, "first at {x}: {first} {}", mid.first);
        assert!((second - mid.second).abs() < 3e-4 * scale, "second at {x}: {second} {}", mid.second);
    }

    proptest! {
        #[test]
        fn derivatives_match_finite_differences(x in 0.3..1.6_f64, nu in -1.0..1.0_f64, e in -0.1..0.08_f64) {
            check(force_length, x);
            check(force_velocity, nu);
            check(tendon_force, e);
        }
    }

    #[test]
    fn fit_errors_are_within_their_documented_limits() {
        let published_fv = |nu: f64| {
            if nu < 0.0 { (1.0 + nu) / (1.0 - 5.0 * nu) } else { 1.5 - 0.5 * (1.0 - nu) / (1.0 + 37.8 * nu) }
        };
        let (mut square, mut worst) = (0.0_f64, 0.0_f64);
        let samples = 20_001_u32;
        for k in 0..samples {
            let nu = -1.0 + 2.0 * f64::from(k) / f64::from(samples - 1);
            let error = (force_velocity(nu).value - published_fv(nu)).abs();
            square += error * error;
            worst = worst.max(error);
        }
        let rms = (square / f64::from(samples)).sqrt();
        assert!(rms > 0.003 && rms < 0.0045, "{rms}");
        assert!(worst > 0.045 && worst < 0.053, "{worst}");
        let mut worst_se = 0.0_f64;
        let mut worst_fl = 0.0_f64;
        for k in 0..=2000_u32 {
            let e = -0.05 + 1e-4 * f64::from(k) * 0.5;
            worst_se = worst_se.max((tendon_force(e).value - (e.max(0.0) / 0.04).powi(2)).abs());
            let x = 0.4 + 1.2 * f64::from(k) / 2000.0;
            let published = (0.05_f64.ln() * ((x - 1.0) / 0.56).abs().powi(3)).exp();
            worst_fl = worst_fl.max((force_length(x).value - published).abs());
        }
        assert!(worst_se < 1.3e-3, "{worst_se}");
        // Within 0.01 of the optimum, where the smoothing acts.
        for k in -2000..=2000_i32 {
            let y = f64::from(k) * 5e-6;
            let published = (0.05_f64.ln() * (y / 0.56).abs().powi(3)).exp();
            worst_fl = worst_fl.max((force_length(1.0 + y).value - published).abs());
        }
        assert!((5.1e-7..5.2e-7).contains(&worst_fl), "{worst_fl}");
    }
}
