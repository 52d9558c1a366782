//! Lines with fewer points that look the same.

/// Largest distance of a dropped point from the line, in units of a drawing.
const TOLERANCE: f64 = 0.2;

/// The points that a line needs (Douglas and Peucker).
pub(super) fn simplified(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let Some(last) = points.len().checked_sub(1) else { return Vec::new() };
    let mut kept = vec![false; points.len()];
    kept[0] = true;
    kept[last] = true;
    // A stack instead of recursion: a line can have any number of points.
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let away = |place: &usize| distance(points[*place], points[from], points[to]);
        let farthest = (from + 1..to).max_by(|a, b| away(a).total_cmp(&away(b)));
        if let Some(farthest) = farthest.filter(|place| away(place) > TOLERANCE) {
            kept[farthest] = true;
            open.extend([(from, farthest), (farthest, to)]);
        }
    }
    points.iter().zip(kept).filter_map(|(point, kept)| kept.then_some(*point)).collect()
}

/// Distance of a point from the line between two points.
fn distance(point: (f64, f64), from: (f64, f64), to: (f64, f64)) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = dx.hypot(dy);
    let (x, y) = (point.0 - from.0, point.1 - from.1);
    if length < 1e-9 {
        return x.hypot(y);
    }
    // The ends count where the point lies beyond them, as in a loop.
    let along = ((x * dx + y * dy) / (length * length)).clamp(0.0, 1.0);
    (x - along * dx).hypot(y - along * dy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn straight_line_needs_its_ends_only() {
        let line: Vec<(f64, f64)> = (0..50).map(|i| (f64::from(i), 2.0 * f64::from(i))).collect();
        assert_eq!(simplified(&line), [line[0], line[49]]);
        assert_eq!(simplified(&[]), []);
        assert_eq!(simplified(&[(1.0, 2.0)]), [(1.0, 2.0)]);
    }

    proptest! {
        #[test]
        fn no_point_is_farther_from_the_simplified_line_than_the_tolerance(
            points in proptest::collection::vec((-50.0_f64..50.0, -50.0_f64..50.0), 2..60)
        ) {
            let kept = simplified(&points);
            for point in &points {
                let nearest = kept.windows(2).map(|ends| distance(*point, ends[0], ends[1])).fold(f64::INFINITY, f64::min);
                prop_assert!(nearest <= TOLERANCE + 1e-9);
            }
        }
    }
}
