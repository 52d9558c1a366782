//! The height of the ground along the path: a plateau for each step, joined by ramps.

use super::random_stream::RandomStream;

/// Length of a ramp between plateaus, m (assumption). It lies under the swing foot, between two footholds.
const RAMP_M: f64 = 0.1;
/// Number of plateaus that are drawn. The last one continues.
const PLATEAUS: usize = 64;

/// The ground height along the path.
#[derive(Debug, Clone)]
pub(super) struct Terrain {
    spacing_m: f64,
    heights_m: Vec<f64>,
}

impl Terrain {
    pub(super) fn level() -> Self {
        Self { spacing_m: 1.0, heights_m: vec![0.0] }
    }

    /// Plateaus at the mean step length with heights uniform in `-largest_m..largest_m`. The first one is level: a
    /// simulated walk starts on it, and so is the one behind the start, because the trailing foot stands there.
    pub(super) fn random(spacing_m: f64, largest_m: f64, random: &mut RandomStream) -> Self {
        let heights = (0..PLATEAUS).map(|k| if k == 0 { 0.0 } else { random.within(largest_m) }).collect();
        Self { spacing_m, heights_m: heights }
    }

    /// Height in m and slope at a place in m from the first foothold.
    pub(super) fn at(&self, x: f64) -> (f64, f64) {
        let position = x / self.spacing_m + 0.5;
        let last = self.heights_m.len() - 1;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // clamped to the plateaus
        let plateau = position.floor().clamp(0.0, last as f64) as usize;
        let here = self.heights_m[plateau];
        if plateau == last {
            return (here, 0.0);
        }
        let from_ramp = (position - plateau as f64 - 1.0) * self.spacing_m + RAMP_M;
        if from_ramp <= 0.0 {
            return (here, 0.0);
        }
        let slope = (self.heights_m[plateau + 1] - here) / RAMP_M;
        (here + slope * from_ramp, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_continuous_and_within_their_range() {
        let terrain = Terrain::random(0.7, 0.01, &mut RandomStream::new(3, 1));
        let step = 1e-4;
        let mut rises = 0;
        for k in -10_000..600_000 {
            let (height, slope) = terrain.at(f64::from(k) * step);
            let (next, _) = terrain.at(f64::from(k + 1) * step);
            assert!(height.abs() <= 0.01 && (next - height).abs() <= 0.2 * step + 1e-12);
            rises += usize::from(slope != 0.0);
        }
        assert!(rises > 1000);
        assert_eq!(terrain.at(-1.0), (0.0, 0.0));
        assert_eq!(terrain.at(0.2), (0.0, 0.0));
    }
}
