//! Contour lines of values on a grid, by marching squares.

/// A line of equal values. Places are in rows and columns of the grid: `(0.5, 2.0)` is half a row below the first row, in
/// the third column.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contour {
    /// The value.
    level: f64,
    /// Pieces of the line, which meet where they cross from one square of four values to the next.
    pub(super) pieces: Vec<[(f64, f64); 2]>,
}

/// At most this many lines, so that each can be told from the next.
const MAX_LEVELS: usize = 5;
/// Levels are multiples of it, because cells show two decimals.
const MIN_STEP: f64 = 0.01;

/// Contour lines of a grid at three to five round levels, fewer if the values hardly differ.
pub(super) fn contours(grid: &[Vec<f64>]) -> Vec<Contour> {
    let values = || grid.iter().flatten().copied().filter(|value| value.is_finite());
    let range = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    let drawn = round_levels(range).into_iter().map(|level| Contour { level, pieces: pieces(grid, level) });
    drawn.filter(|contour| !contour.pieces.is_empty()).collect()
}

/// Multiples of the smallest round step that gives few enough of them between two values.
fn round_levels((low, high): (f64, f64)) -> Vec<f64> {
    if !(high - low).is_finite() || high - low < MIN_STEP {
        return Vec::new();
    }
    let power = 10_f64.powf(((high - low) / 10.0).log10().floor());
    let steps = [1.0, 2.0, 2.5, 5.0, 10.0, 20.0, 25.0, 50.0, 100.0].map(|round| round * power);
    let between = |step: f64| {
        // The smallest step is at least a hundredth of the range.
        let levels = (0..=101).map(|place| ((low / step).floor() + f64::from(place)) * step);
        levels.filter(|level| *level > low && *level < high).collect::<Vec<_>>()
    };
    let is_shown = |step: &f64| {
        let hundredths = step / MIN_STEP;
        hundredths > 0.5 && (hundredths - hundredths.round()).abs() < 1e-6
    };
    let fitting = steps.into_iter().filter(is_shown).map(between);
    fitting.into_iter().find(|levels| levels.len() <= MAX_LEVELS).unwrap_or_default()
}

/// The pieces of one level.
fn pieces(grid: &[Vec<f64>], level: f64) -> Vec<[(f64, f64); 2]> {
    let mut pieces = Vec::new();
    for (row, (upper, lower)) in grid.iter().zip(grid.iter().skip(1)).enumerate() {
        for column in 1..upper.len().min(lower.len()) {
            let corners = [upper[column - 1], upper[column], lower[column], lower[column - 1]];
            if corners.iter().all(|value| value.is_finite()) {
                let (top, left) = (row as f64, (column - 1) as f64);
                let pieces_here = in_square(corners, level).map(|piece| piece.map(|(y, x)| (top + y, left + x)));
                // A corner at the level is the end of the pieces beside it, and no piece.
                pieces.extend(pieces_here.filter(|[from, to]| from != to));
            }
        }
    }
    pieces
}

/// The pieces in a square with these values at its corners, clockwise from the upper left one.
fn in_square(corners: [f64; 4], level: f64) -> impl Iterator<Item = [(f64, f64); 2]> {
    const PLACES: [(f64, f64); 4] = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)];
    // A corner at the level counts as above it, so a line crosses each side once or not at all.
    let above = corners.map(|value| value >= level);
    let crossing = |side: usize| {
        let (from, to) = (side, (side + 1) % 4);
        let share = (level - corners[from]) / (corners[to] - corners[from]);
        let along = |from: f64, to: f64| from + share * (to - from);
        (above[from] != above[to]).then(|| (along(PLACES[from].0, PLACES[to].0), along(PLACES[from].1, PLACES[to].1)))
    };
    let [top, right, bottom, left] = [0, 1, 2, 3].map(crossing);
    let pieces = match (top, right, bottom, left) {
        (Some(top), Some(right), Some(bottom), Some(left)) => {
            // A saddle: the value in the middle decides which corners are connected.
            let middle = corners.iter().sum::<f64>() / 4.0 >= level;
            if middle == above[0] {
                [Some([top, right]), Some([bottom, left])]
            } else {
                [Some([top, left]), Some([right, bottom])]
            }
        }
        sides => {
            let mut ends = [sides.0, sides.1, sides.2, sides.3].into_iter().flatten();
            [ends.next().zip(ends.next()).map(|(from, to)| [from, to]), None]
        }
    };
    pieces.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(rows: usize, columns: usize, value: impl Fn(f64, f64) -> f64) -> Vec<Vec<f64>> {
        (0..rows).map(|row| (0..columns).map(|column| value(row as f64, column as f64)).collect()).collect()
    }

    #[test]
    fn contours_of_a_plane_are_straight_and_evenly_spaced() {
        let found = contours(&grid(4, 6, |row, column| 0.1 * row + 0.2 * column));
        let levels: Vec<f64> = found.iter().map(|contour| contour.level).collect();
        assert_eq!(levels, [0.25, 0.5, 0.75, 1.0, 1.25]);
        for Contour { level, pieces } in &found {
            assert!(!pieces.is_empty());
            for (row, column) in pieces.iter().flatten() {
                assert!((0.1 * row + 0.2 * column - level).abs() < 1e-12, "{level} at {row}, {column}");
            }
        }
    }

    #[test]
    fn contours_of_a_bowl_are_closed_around_its_minimum() {
        let found = contours(&grid(9, 9, |row, column| 0.3 + (row - 4.0).powi(2) + (column - 4.0).powi(2)));
        assert_eq!(found.iter().map(|contour| contour.level).collect::<Vec<_>>(), [10.0, 20.0, 30.0]);
        let inner = &found[0].pieces;
        for end in inner.iter().flatten() {
            let met = inner.iter().flatten().filter(|other| (other.0 - end.0).hypot(other.1 - end.1) < 1e-9).count();
            assert_eq!(met, 2, "the line has an end at {end:?}");
            // Linear interpolation between whole places of a parabola is off by at most a quarter.
            let height = (end.0 - 4.0).powi(2) + (end.1 - 4.0).powi(2);
            assert!((height - 9.7).abs() <= 0.25 + 1e-9, "{height}");
        }
    }

    #[test]
    fn saddle_is_connected_by_the_value_in_its_middle() {
        let through = |corners| in_square(corners, 0.5).collect::<Vec<_>>();
        // High corners upper left and lower right: a high middle cuts the low corners off, a low one the high corners.
        let first = |corners| through(corners)[0].map(|end| (format!("{:.3}", end.0), format!("{:.3}", end.1)));
        let ends = |ends: [(&str, &str); 2]| ends.map(|end| (end.0.to_owned(), end.1.to_owned()));
        assert_eq!(first([1.0, 0.2, 1.0, 0.2]), ends([("0.000", "0.625"), ("0.375", "1.000")]));
        assert_eq!(first([0.8, 0.0, 0.8, 0.0]), ends([("0.000", "0.375"), ("0.375", "0.000")]));
    }

    #[test]
    fn three_to_five_round_levels_fit_most_ranges() {
        assert_eq!(round_levels((0.0, 1.0)).len(), 4);
        assert_eq!(round_levels((-1.9, 1.3)), [-1.0, 0.0, 1.0]);
        assert_eq!(round_levels((0.11, 0.135)), [0.12, 0.13]);
        assert!(round_levels((0.5, 0.5)).is_empty() && round_levels((f64::INFINITY, f64::NEG_INFINITY)).is_empty());
        for i in 1..2000 {
            let range = (-0.37 * f64::from(i).sin(), f64::from(i) * 0.013);
            let levels = round_levels(range).len();
            assert!(levels <= MAX_LEVELS && (range.1 - range.0 < 0.13 || levels >= 2), "{range:?}: {levels}");
        }
    }

    #[test]
    fn contours_need_two_rows_and_known_values() {
        assert!(contours(&grid(1, 5, |_, column| column)).is_empty());
        assert!(contours(&[]).is_empty());
        let partly = vec![vec![0.0, 1.0, f64::NAN], vec![0.0, 1.0, f64::NAN]];
        assert!(contours(&partly).iter().flat_map(|contour| &contour.pieces).flatten().all(|place| place.1 <= 1.0));
    }
}
