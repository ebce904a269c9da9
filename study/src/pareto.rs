//! Which points are worth their time.

/// The Pareto front of times and errors: indices by increasing time.
///
/// Errors that differ by no more than `floor` are not told apart. The fastest
/// point is on the front, and then every next one whose error is more than the
/// floor below that of the one before it; so any two of them are told apart, and
/// whatever is left out has a point of the front that is no slower and whose
/// error is at most one floor larger. Points with an entry that is not finite
/// are left out; of equally fast ones the most accurate counts, of equal ones
/// the first. A floor of 0 gives the usual front.
pub fn front(points: &[(f64, f64)], floor: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len())
        .filter(|i| points[*i].0.is_finite() && points[*i].1.is_finite())
        .collect();
    order.sort_by(|&i, &j| {
        let (a, b) = (points[i], points[j]);
        a.0.total_cmp(&b.0)
            .then(a.1.total_cmp(&b.1))
            .then(i.cmp(&j))
    });
    let mut least = f64::INFINITY;
    order.retain(|&i| {
        let better = points[i].1 + floor < least;
        if better {
            least = points[i].1;
        }
        better
    });
    order
}

/// The knee of a front: the point farthest below the chord between its ends,
/// in double logarithmic axes; an index into the front. `None` for fewer than
/// three points, ends without a logarithm, or a front that nowhere bends
/// inwards.
pub fn knee(front: &[(f64, f64)]) -> Option<usize> {
    let log: Vec<(f64, f64)> = front.iter().map(|(t, e)| (t.ln(), e.ln())).collect();
    let (first, last) = (*log.first()?, *log.last()?);
    let (dx, dy) = (last.0 - first.0, last.1 - first.1);
    let length = dx.hypot(dy);
    if log.len() < 3 || !length.is_finite() || length == 0.0 {
        return None;
    }
    let below = |p: &(f64, f64)| (dy * (p.0 - first.0) - dx * (p.1 - first.1)) / length;
    let mut best: Option<(usize, f64)> = None;
    for (i, p) in log.iter().enumerate() {
        let distance = below(p);
        if distance > 1e-12 && best.is_none_or(|b| distance > b.1) {
            best = Some((i, distance));
        }
    }
    best.map(|b| b.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dominated, equal and infinite points are not in front.
    #[test]
    fn front_by_hand() {
        let points = [
            (4.0, 1.0),
            (1.0, 8.0),
            (2.0, 3.0),
            (3.0, 3.0),
            (2.0, 3.0),
            (0.5, f64::INFINITY),
            (f64::NAN, 0.1),
            (5.0, 2.0),
        ];
        assert_eq!(front(&points, 0.0), [1, 2, 0]);
        assert_eq!(front(&[], 0.0), [0usize; 0]);
        // Two apart is not better, and steps of less add up.
        assert_eq!(front(&points, 2.0), [1, 2]);
        let stairs = [(1.0, 4.0), (2.0, 3.5), (3.0, 2.5), (4.0, 2.0), (5.0, 1.0)];
        assert_eq!(front(&stairs, 1.0), [0, 2, 4]);
        assert_eq!(front(&stairs, 3.0), [0]);
    }

    /// The corner of an L in logarithms, whatever the units; none where there
    /// is no corner.
    #[test]
    fn knee_by_hand() {
        let l = [
            (1.0, 1.0),
            (1.5, 0.1),
            (2.0, 0.012),
            (10.0, 0.011),
            (100.0, 0.01),
        ];
        assert_eq!(knee(&l), Some(2));
        let scaled = l.map(|(t, e)| (60.0 * t, 1e3 * e));
        assert_eq!(knee(&scaled), Some(2));
        let straight = [(1.0, 1.0), (10.0, 0.1), (100.0, 0.01)];
        assert_eq!(knee(&straight), None);
        let outwards = [(1.0, 1.0), (10.0, 0.9), (11.0, 0.01)];
        assert_eq!(knee(&outwards), None);
        assert_eq!(knee(&l[..2]), None);
        assert_eq!(knee(&[(1.0, 1.0), (2.0, 0.5), (3.0, 0.0)]), None);
    }
}
