//! Axes: ranges that are never empty, round ticks, short labels.

use super::text::{minus, superscript, trim_zeros};

/// A plot axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    /// Ends, in the data's unit (positive when `log`).
    pub low: f64,
    pub high: f64,
    pub log: bool,
    /// Position and label of each tick.
    pub ticks: Vec<(f64, String)>,
    /// Power of ten taken out of the labels (linear axes), a multiple of 3.
    pub exponent: i32,
}

/// Values beyond this are treated as infinite: differences must not overflow.
pub(super) const HUGE: f64 = 1e200;

impl Axis {
    /// Covers the finite values; about `wanted` ticks.
    pub fn new(values: impl Iterator<Item = f64>, log: bool, wanted: usize) -> Self {
        let mut range: Option<(f64, f64)> = None;
        for v in values.filter(|v| v.abs() < HUGE && (!log || *v > 1e-200)) {
            range = Some(range.map_or((v, v), |(a, b)| (a.min(v), b.max(v))));
        }
        if log {
            Self::logarithmic(range, wanted)
        } else {
            Self::linear(range, wanted)
        }
    }

    /// Like [`Self::new`] for a linear axis with these ends exactly.
    pub fn exact(low: f64, high: f64, wanted: usize) -> Self {
        let mut axis = Self {
            low,
            high,
            log: false,
            ticks: Vec::new(),
            exponent: 0,
        };
        axis.place_ticks(wanted);
        axis
    }

    fn linear(range: Option<(f64, f64)>, wanted: usize) -> Self {
        let (mut low, mut high) = range.unwrap_or((0.0, 1.0));
        if low >= 0.0 && low < 0.6 * high {
            low = 0.0;
        } else if high <= 0.0 && high > 0.6 * low {
            high = 0.0;
        }
        let size = low.abs().max(high.abs());
        if size < 1e-200 {
            (low, high) = (0.0, 1.0);
        } else if high - low < 1e-9 * size {
            (low, high) = (low - 0.1 * size, high + 0.1 * size);
        }
        // Round the ends outwards, so that the curve does not touch the border.
        let step = round_step((high - low) / wanted as f64);
        Self::exact(
            (low / step).floor() * step,
            (high / step).ceil() * step,
            wanted,
        )
    }

    fn place_ticks(&mut self, wanted: usize) {
        let step = round_step((self.high - self.low) / wanted as f64);
        let size = self.low.abs().max(self.high.abs());
        let magnitude = if size > 0.0 {
            size.log10().floor() as i32
        } else {
            0
        };
        self.exponent = if (-2..4).contains(&magnitude) {
            0
        } else {
            magnitude.div_euclid(3) * 3
        };
        let unit = 10f64.powi(self.exponent);
        let digits = (-(step / unit).log10().floor()).clamp(0.0, 9.0) as usize;
        let first = (self.low / step - 1e-6).ceil();
        let mut k = 0.0;
        while k < 40.0 && (first + k) * step <= self.high + 1e-6 * step {
            let v = (first + k) * step;
            let text = format!("{:.digits$}", v / unit + 0.0);
            self.ticks
                .push((v, minus(if digits > 0 { trim_zeros(&text) } else { &text })));
            k += 1.0;
        }
    }

    fn logarithmic(range: Option<(f64, f64)>, wanted: usize) -> Self {
        let (low, high) = range.unwrap_or((0.1, 10.0));
        let first = (low.log10() + 1e-9).floor() as i32;
        let last = ((high.log10() - 1e-9).ceil() as i32).max(first + 1);
        let stride = ((last - first) as usize).div_ceil(wanted.max(1)).max(1);
        let ticks = (first..=last)
            .step_by(stride)
            .map(|e| {
                let label = match e {
                    0 => "1".into(),
                    1 => "10".into(),
                    e => format!("10{}", superscript(e)),
                };
                (10f64.powi(e), label)
            })
            .collect();
        Self {
            low: 10f64.powi(first),
            high: 10f64.powi(last),
            log: true,
            ticks,
            exponent: 0,
        }
    }

    /// Position of a value on the axis, 0 at `low` and 1 at `high`; `None` when it has none.
    pub fn place(&self, v: f64) -> Option<f64> {
        if v.is_nan() || v.abs() >= HUGE || (self.log && v <= 1e-200) {
            return None;
        }
        let t = if self.log {
            (v / self.low).log10() / (self.high / self.low).log10()
        } else {
            (v - self.low) / (self.high - self.low)
        };
        Some(t.clamp(-0.01, 1.01))
    }

    /// The unit's label, with the exponent taken out of the tick labels.
    pub fn unit(&self, unit: &str) -> String {
        let unit = if unit == "1" { "" } else { unit };
        let prefix = match self.exponent {
            -9 => "n",
            -6 => "µ",
            -3 => "m",
            3 => "k",
            6 => "M",
            9 => "G",
            _ => "",
        };
        let prefixed = ["J", "N", "s", "m", "W", "Pa", "N/m", "m/s", "N·m"].contains(&unit);
        match (self.exponent, prefixed && !prefix.is_empty()) {
            (0, _) => unit.to_owned(),
            (_, true) => format!("{prefix}{unit}"),
            (e, false) => format!("×10{} {unit}", superscript(e))
                .trim_end()
                .to_owned(),
        }
    }
}

/// The nearest of 1, 2, 5 × 10ⁿ at or above `raw`.
pub(super) fn round_step(raw: f64) -> f64 {
    if !(raw > 0.0 && raw.is_finite()) {
        return 1.0;
    }
    let power = 10f64.powi(raw.log10().floor() as i32);
    let step = [1.0, 2.0, 5.0]
        .map(|m| m * power)
        .into_iter()
        .find(|s| *s >= raw * 0.999_999);
    step.unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(a: &Axis) -> Vec<&str> {
        a.ticks.iter().map(|t| t.1.as_str()).collect()
    }

    /// Ticks are round numbers in readable units.
    #[test]
    fn ticks_are_round() {
        let a = Axis::new([0.0, 0.93].into_iter(), false, 5);
        assert_eq!(labels(&a), ["0", "0.2", "0.4", "0.6", "0.8", "1"]);
        let a = Axis::new([1e-6, 4.2e-3].into_iter(), false, 5);
        assert_eq!(
            (labels(&a), a.unit("J").as_str()),
            (vec!["0", "1", "2", "3", "4", "5"], "mJ")
        );
        let a = Axis::new([12_345.0, 0.0].into_iter(), false, 4);
        assert_eq!(a.unit("pairs"), "×10³ pairs");
        let a = Axis::new([3e-7, 2.0].into_iter(), true, 10);
        assert_eq!((a.low, a.high), (1e-7, 10.0));
        assert_eq!(labels(&a)[0], "10⁻⁷");
    }

    /// No data, one value, zeros, NaN and infinities still give an axis.
    #[test]
    fn every_axis_has_a_length() {
        let cases: [&[f64]; 8] = [
            &[],
            &[0.0],
            &[5.0, 5.0],
            &[-3.0],
            &[f64::NAN, f64::INFINITY],
            &[1e308, -1e308],
            &[1e-300],
            &[1.0, 1.0 + 1e-15],
        ];
        for values in cases {
            for log in [false, true] {
                let a = Axis::new(values.iter().copied(), log, 5);
                assert!(a.low < a.high && (a.high - a.low).is_finite(), "{a:?}");
                assert!((2..=41).contains(&a.ticks.len()), "{a:?}");
                assert!(
                    values
                        .iter()
                        .all(|&v| a.place(v).is_none_or(f64::is_finite))
                );
            }
        }
    }
}
