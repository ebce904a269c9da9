//! Figures of a field: range of its colour scale, extremes, histogram.

use super::data::Field;

/// Bins of the histogram over the colour scale.
pub(super) const BINS: usize = 48;

/// What a map's legend says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FieldStats {
    /// Ends of the colour scale, `low < high`.
    pub scale: (f32, f32),
    pub min: f32,
    pub max: f32,
    pub mean: f64,
    pub median: f32,
    /// 99th percentile; of the magnitude when the sign matters.
    pub p99: f32,
    /// Values that are numbers.
    pub finite: usize,
    /// Values that are not.
    pub missing: usize,
    /// Values on the colour scale; those beyond count in the outermost bins.
    pub histogram: [u32; BINS],
}

impl FieldStats {
    pub fn of(field: &Field) -> Self {
        let mut v: Vec<f32> = field
            .values
            .iter()
            .copied()
            .filter(|v| v.is_finite())
            .collect();
        v.sort_by(f32::total_cmp);
        let (finite, missing) = (v.len(), field.values.len() - v.len());
        let at = |v: &[f32], q: f64| v[(q * (v.len() - 1) as f64).round() as usize];
        let (min, max, median, p99, mean) = if v.is_empty() {
            (0.0, 0.0, 0.0, 0.0, 0.0)
        } else {
            let mut size = v.clone();
            if field.diverging {
                size.iter_mut().for_each(|v| *v = v.abs());
                size.sort_by(f32::total_cmp);
            }
            let mean = v.iter().map(|&v| f64::from(v)).sum::<f64>() / finite as f64;
            (v[0], v[finite - 1], at(&v, 0.5), at(&size, 0.99), mean)
        };
        let scale = match field.range {
            Some((a, b)) if a.is_finite() && b.is_finite() && a < b => (a, b),
            _ if v.is_empty() => (0.0, 1.0),
            // A few extreme triangles must not hide the rest: ends at 0.2 % and 99.8 %.
            _ => {
                let (low, high) = (at(&v, 0.002), at(&v, 0.998));
                if field.diverging {
                    let reach = low.abs().max(high.abs());
                    (-reach, reach)
                } else if low >= 0.0 && low < 0.4 * high {
                    (0.0, high)
                } else {
                    (low, high)
                }
            }
        };
        let scale = widened(scale);
        let mut histogram = [0; BINS];
        let width = f64::from(scale.1) - f64::from(scale.0);
        for value in v {
            let t = (f64::from(value) - f64::from(scale.0)) / width;
            histogram[((t * BINS as f64).max(0.0) as usize).min(BINS - 1)] += 1;
        }
        Self {
            scale,
            min,
            max,
            mean,
            median,
            p99,
            finite,
            missing,
            histogram,
        }
    }
}

/// A range that is never empty, nor beyond what `f32` differences can hold.
fn widened((low, high): (f32, f32)) -> (f32, f32) {
    const LIMIT: f32 = 1e37;
    let (low, high) = (low.clamp(-LIMIT, LIMIT), high.clamp(-LIMIT, LIMIT));
    let size = low.abs().max(high.abs());
    if high - low > size * 1e-6 {
        (low, high)
    } else if size < 1e-30 {
        (0.0, 1.0)
    } else {
        (low - 0.5 * size, high + 0.5 * size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(values: Vec<f32>, diverging: bool) -> Field {
        Field {
            values,
            diverging,
            ..Field::default()
        }
    }

    /// Extremes stay in the figures without deciding the colour scale.
    #[test]
    fn outliers_do_not_set_the_scale() {
        let mut values: Vec<f32> = (0..10_000).map(|i| i as f32 * 1e-4).collect();
        values.extend([500.0, f32::NAN]);
        let s = FieldStats::of(&field(values, false));
        assert!(s.scale.0 == 0.0 && s.scale.1 < 1.01, "{:?}", s.scale);
        assert_eq!((s.max, s.missing, s.finite), (500.0, 1, 10_001));
        assert_eq!(s.histogram.iter().sum::<u32>(), 10_001);
    }

    /// Empty, constant, absent and extreme values give a proper scale.
    #[test]
    fn every_scale_is_a_range() {
        for values in [
            vec![],
            vec![0.0; 5],
            vec![3.0],
            vec![f32::NAN; 4],
            vec![-3e38, 3e38],
        ] {
            for diverging in [false, true] {
                let s = FieldStats::of(&field(values.clone(), diverging));
                assert!(
                    s.scale.0 < s.scale.1 && (s.scale.1 - s.scale.0).is_finite(),
                    "{s:?}"
                );
            }
        }
        let signed = FieldStats::of(&field(vec![-2.0, 1.0, 0.5], true));
        assert_eq!(signed.scale, (-2.0, 2.0));
    }
}
