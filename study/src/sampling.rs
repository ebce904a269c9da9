//! Which combinations of values a study runs.

use selvedge_scene::random::SplitMix;

use crate::StudyError;
use crate::axes::{Axis, Values};

/// Runs that one study may have.
pub const MOST_RUNS: usize = 100_000;

/// Every combination of the values; those of the last axis change first.
///
/// # Errors
/// [`StudyError::Axis`] for ranges, [`StudyError::TooMany`].
pub fn grid(axes: &[Axis]) -> Result<Vec<Vec<String>>, StudyError> {
    let mut points: Vec<Vec<String>> = vec![Vec::new()];
    for axis in axes {
        let Values::List(values) = &axis.values else {
            return Err(StudyError::Axis {
                text: axis.key.clone(),
                reason: "a range needs a sample: add --sample N, or list the values".to_owned(),
            });
        };
        let count = points.len().saturating_mul(values.len());
        if count > MOST_RUNS {
            let most = MOST_RUNS;
            return Err(StudyError::TooMany { count, most });
        }
        points = points
            .iter()
            .flat_map(|p| {
                values.iter().map(move |v| {
                    let mut next = p.clone();
                    next.push(v.clone());
                    next
                })
            })
            .collect();
    }
    Ok(points)
}

/// A Latin hypercube: along every axis each of `count` strata holds one point.
/// Lists are divided evenly among the strata.
///
/// # Errors
/// [`StudyError::TooMany`].
pub fn latin_hypercube(
    axes: &[Axis],
    count: usize,
    seed: u64,
) -> Result<Vec<Vec<String>>, StudyError> {
    if count > MOST_RUNS {
        let most = MOST_RUNS;
        return Err(StudyError::TooMany { count, most });
    }
    let mut points = vec![Vec::with_capacity(axes.len()); count];
    for (a, axis) in axes.iter().enumerate() {
        // A generator an axis: a further axis leaves the others as they are.
        let mut random = SplitMix(seed ^ (a as u64 + 1).wrapping_mul(0xd1b5_4a32_d192_ed03));
        let strata = permutation(&mut random, count);
        for (point, stratum) in points.iter_mut().zip(strata) {
            // Off the borders, so that six digits keep it in its stratum.
            let inside = 0.02 + 0.96 * random.uniform();
            let place = (stratum as f64 + inside) / count as f64;
            point.push(match &axis.values {
                Values::Range(range) => range.at(place),
                Values::List(values) => {
                    let index = (place * values.len() as f64) as usize;
                    values[index.min(values.len() - 1)].clone()
                }
            });
        }
    }
    Ok(points)
}

/// Fisher and Yates.
fn permutation(random: &mut SplitMix, count: usize) -> Vec<usize> {
    let mut all: Vec<usize> = (0..count).collect();
    for i in (1..count).rev() {
        all.swap(i, (random.bits() % (i as u64 + 1)) as usize);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(texts: &[&str]) -> Vec<Axis> {
        texts.iter().map(|t| Axis::parse(t).unwrap()).collect()
    }

    /// The last axis changes first.
    #[test]
    fn grid_order() {
        let points = grid(&axes(&["a=1,2", "b=x,y,z"])).unwrap();
        let joined: Vec<String> = points.iter().map(|p| p.join("")).collect();
        assert_eq!(joined, ["1x", "1y", "1z", "2x", "2y", "2z"]);
        assert!(grid(&axes(&["a=1..2"])).is_err());
        let many = "a=".to_owned() + &(0..400).map(|i| format!("{i},")).collect::<String>() + "x";
        let b = many.replacen('a', "b", 1);
        assert!(matches!(
            grid(&axes(&[&many, &b])),
            Err(StudyError::TooMany { .. })
        ));
    }

    /// Every stratum of every axis holds one point; seeds differ.
    #[test]
    fn hypercube_covers_every_stratum() {
        let n = 40;
        let axes = axes(&["a=1e-6..1e-2", "b=0.5..1.5", "c=p,q,r,s"]);
        let points = latin_hypercube(&axes, n, 7).unwrap();
        assert_eq!(points.len(), n);
        let strata = |axis: usize, place: &dyn Fn(f64) -> f64| {
            let mut s: Vec<usize> = points
                .iter()
                .map(|p| (place(p[axis].parse().unwrap()) * n as f64) as usize)
                .collect();
            s.sort_unstable();
            s
        };
        let all: Vec<usize> = (0..n).collect();
        assert_eq!(strata(0, &|v| (v / 1e-6).log10() / 4.0), all);
        assert_eq!(strata(1, &|v| v - 0.5), all);
        for v in ["p", "q", "r", "s"] {
            assert_eq!(points.iter().filter(|p| p[2] == v).count(), n / 4);
        }
        assert_eq!(points, latin_hypercube(&axes, n, 7).unwrap());
        assert_ne!(points, latin_hypercube(&axes, n, 8).unwrap());
    }
}
