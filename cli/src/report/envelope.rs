//! Long series in few points: what a plot of limited width can show is kept.

/// Runs of drawable points, split at gaps (values without a place).
pub(super) type Runs = Vec<Vec<(f64, f64)>>;

/// Keeps first, smallest, largest and last value of each of `columns` columns.
///
/// `points` are positions in 0..=1 in both directions, `None` marks a gap. A
/// column's extremes survive, so no peak is lost; a gap survives when it is wider
/// than a column.
pub(super) fn envelope(points: &[(f64, Option<f64>)], columns: usize) -> Runs {
    let mut runs = vec![Vec::new()];
    if points.len() <= 4 * columns {
        for &(x, y) in points {
            push(&mut runs, x, y);
        }
    } else {
        let column = |x: f64| (x * columns as f64) as i64;
        let mut start = 0;
        while start < points.len() {
            let here = column(points[start].0);
            let len = points[start..]
                .iter()
                .take_while(|p| column(p.0) == here)
                .count();
            push_column(&mut runs, &points[start..start + len]);
            start += len;
        }
    }
    runs.retain(|r| !r.is_empty());
    runs
}

fn push(runs: &mut Runs, x: f64, y: Option<f64>) {
    match (y, runs.last_mut()) {
        (Some(y), Some(run)) => run.push((x, y)),
        (None, Some(run)) if !run.is_empty() => runs.push(Vec::new()),
        _ => {}
    }
}

fn push_column(runs: &mut Runs, points: &[(f64, Option<f64>)]) {
    let known: Vec<(f64, f64)> = points
        .iter()
        .filter_map(|p| p.1.map(|y| (p.0, y)))
        .collect();
    if known.is_empty() {
        push(runs, 0.0, None);
        return;
    }
    let by = |less: fn(f64, f64) -> bool| {
        (1..known.len()).fold(0, |best, i| {
            if less(known[i].1, known[best].1) {
                i
            } else {
                best
            }
        })
    };
    let mut keep = [0, by(|a, b| a < b), by(|a, b| a > b), known.len() - 1];
    keep.sort_unstable();
    for (k, &i) in keep.iter().enumerate() {
        if k == 0 || keep[k - 1] != i {
            push(runs, known[i].0, Some(known[i].1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A single spike among a million values is still there afterwards.
    #[test]
    fn peaks_survive() {
        let n = 1_000_000;
        let mut points: Vec<(f64, Option<f64>)> = (0..n)
            .map(|i| (f64::from(i) / f64::from(n), Some(0.5)))
            .collect();
        points[314_159].1 = Some(0.99);
        let runs = envelope(&points, 600);
        assert_eq!(runs.len(), 1);
        assert!(runs[0].len() <= 4 * 601, "{}", runs[0].len());
        assert!(runs[0].iter().any(|p| p.1 == 0.99));
        assert_eq!(runs[0].first().map(|p| p.0), Some(0.0));
    }

    /// Gaps split the curve and nothing is invented inside them.
    #[test]
    fn gaps_split() {
        let points = [
            (0.0, Some(1.0)),
            (0.1, None),
            (0.2, None),
            (0.3, Some(0.0)),
            (0.4, Some(0.1)),
        ];
        assert_eq!(
            envelope(&points, 100),
            vec![vec![(0.0, 1.0)], vec![(0.3, 0.0), (0.4, 0.1)]]
        );
        assert!(envelope(&[(0.0, None)], 100).is_empty());
        assert!(envelope(&[], 100).is_empty());
    }
}
