//! The actions on a random line through the best action (LineCoSpar, Tucker et al. 2020).
//!
//! The line points to a uniformly random action and extends in both directions to the boundary of the grid. Lengths are
//! in grid steps, because in raw units only the dimensions with large numbers would move. Points are rounded to the
//! grid.

use crate::action::ActionIndex;
use crate::random::Random;
use crate::search_space::SearchSpace;

/// The distinct actions of a random line, without its origin: forward from the nearest, then backward from the nearest.
pub(crate) fn through(space: &SearchSpace, origin: ActionIndex, random: &mut Random) -> Vec<ActionIndex> {
    let shape = space.shape();
    let start = space.levels(origin);
    let target: Vec<f64> = shape.iter().map(|&n| random.below(n as u64) as f64).collect();
    let offset: Vec<f64> = target.iter().zip(&start).map(|(t, &s)| t - s as f64).collect();
    let length = offset.iter().map(|o| o * o).sum::<f64>().sqrt();
    let mut line = Vec::new();
    if length == 0.0 {
        return line;
    }
    for sign in [1.0, -1.0] {
        for step in 1_u32.. {
            let mut levels = Vec::with_capacity(shape.len());
            for ((&s, o), &n) in start.iter().zip(&offset).zip(&shape) {
                let x = s as f64 + sign * f64::from(step) * o / length;
                if x < -1e-9 || x > (n - 1) as f64 + 1e-9 {
                    break;
                }
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "within 0..n, checked above"
                )]
                levels.push(x.round_ties_even() as usize);
            }
            if levels.len() < shape.len() {
                break;
            }
            if let Ok(action) = space.index_of_levels(&levels)
                && action != origin
                && !line.contains(&action)
            {
                line.push(action);
            }
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search_space::Dimension;

    #[test]
    fn lines_move_every_dimension_and_have_distinct_actions() {
        let dimensions = [2, 3, 3, 3, 4, 6, 3, 3]
            .iter()
            .enumerate()
            .map(|(d, &n)| {
                // Units that differ as in Table I of the paper.
                let step = 10_f64.powi(1 - i32::try_from(d).unwrap());
                let values = (0..n).map(|i| f64::from(i) * step).collect();
                Dimension { name: format!("a{}", d + 1), values, lengthscale: step }
            })
            .collect();
        let space = SearchSpace::new(dimensions).unwrap();
        let mut random = Random::new(3, 0);
        let (mut moved, mut count) = ([0_u32; 8], 0);
        for _ in 0..2000 {
            let origin = ActionIndex(random.below(space.len()));
            let start = space.levels(origin);
            let line = through(&space, origin, &mut random);
            count += line.len();
            let mut sorted = line.clone();
            sorted.sort_unstable();
            sorted.dedup();
            assert_eq!(sorted.len(), line.len());
            for d in 0..8 {
                moved[d] += u32::from(line.iter().any(|&a| space.levels(a)[d] != start[d]));
            }
        }
        // In raw units, at most 26 of the 2,000 lines move the dimensions with small numbers.
        assert!(moved.iter().all(|&m| m > 800), "{moved:?}");
        assert!((2.5..4.0).contains(&(count as f64 / 2000.0)), "{count}");
    }
}
