//! One quantity on finer and finer meshes, or with smaller and smaller steps.

/// Differences below this, relative to the scale, are round-off: no order is
/// read from them.
const ROUND_OFF: f64 = 1e-9;

/// Which figure is held against the limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judged {
    /// The extrapolated value; the finest where there is no order.
    Extrapolated,
    /// The value on the finest rung.
    Finest,
    /// The worst of all rungs.
    Every,
}

/// One run of a ladder.
#[derive(Clone, Debug, PartialEq)]
pub struct Rung {
    /// What was chosen, with its unit where it has one.
    pub label: String,
    /// Size of a cell or a step, in any unit that all rungs share.
    pub size: f64,
    /// What was found.
    pub value: f64,
}

/// A quantity, what it should be, and what was found, from coarse to fine.
#[derive(Clone, Debug)]
pub struct Ladder {
    /// What is measured.
    pub quantity: String,
    /// What gets finer: "rows of cells", "step".
    pub refined: &'static str,
    /// The closed form's value.
    pub exact: f64,
    /// What errors are relative to: the size of `exact`, unless it is zero.
    pub scale: f64,
    /// The runs.
    pub rungs: Vec<Rung>,
    /// Largest order that the discretisation can have.
    pub order: f64,
    /// What the limit is held against.
    pub judged: Judged,
    /// Largest error allowed [1].
    pub limit: f64,
}

/// What a ladder says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// Order seen on the three finest rungs; `None` where their values do not
    /// approach each other steadily or differ by round-off alone.
    pub order: Option<f64>,
    /// The value for size zero, where there is an order.
    pub extrapolated: Option<f64>,
    /// Error of the finest rung [1].
    pub finest_error: f64,
    /// Error of what is judged [1].
    pub error: f64,
    /// Whether the error is within the limit.
    pub holds: bool,
}

impl Ladder {
    /// A ladder whose errors are relative to its exact value.
    pub fn new(
        quantity: impl Into<String>,
        refined: &'static str,
        exact: f64,
        rungs: Vec<Rung>,
    ) -> Self {
        Self {
            quantity: quantity.into(),
            refined,
            exact,
            scale: exact.abs(),
            rungs,
            order: 2.0,
            judged: Judged::Extrapolated,
            limit: 5e-3,
        }
    }

    /// With another scale for its errors.
    pub fn relative_to(self, scale: f64) -> Self {
        Self { scale, ..self }
    }

    /// With another limit and what is held against it.
    pub fn within(self, limit: f64, judged: Judged) -> Self {
        Self {
            limit,
            judged,
            ..self
        }
    }

    /// With another order of the discretisation.
    pub fn of_order(self, order: f64) -> Self {
        Self { order, ..self }
    }

    /// Relative error of a value.
    pub fn error(&self, value: f64) -> f64 {
        (value - self.exact) / self.scale
    }

    /// Order, extrapolated value and verdict.
    ///
    /// ```text
    /// f(h) = f(0) + c hᵖ:   (f_1 − f_2)/(f_2 − f_3) = (h_1ᵖ − h_2ᵖ)/(h_2ᵖ − h_3ᵖ)
    /// f(0) ≈ f_3 − (f_2 − f_3) h_3ᵖ/(h_2ᵖ − h_3ᵖ)
    /// ```
    /// [Richardson1911]. The extrapolation believes `p` between 1 and the
    /// order of the discretisation.
    pub fn finding(&self) -> Finding {
        let order = self.observed();
        let extrapolated = order.map(|p| self.extrapolate(p.clamp(1.0, self.order)));
        let finest = self.rungs.last().map_or(f64::NAN, |r| r.value);
        let finest_error = self.error(finest);
        let error = match self.judged {
            Judged::Extrapolated => self.error(extrapolated.unwrap_or(finest)),
            Judged::Finest => finest_error,
            Judged::Every => {
                self.rungs
                    .iter()
                    .map(|r| self.error(r.value))
                    .fold(0.0, |worst: f64, e| {
                        // NaN must not get lost.
                        if e.abs() <= worst.abs() { worst } else { e }
                    })
            }
        };
        Finding {
            order,
            extrapolated,
            finest_error,
            error,
            holds: error.abs() <= self.limit,
        }
    }

    fn last<const N: usize>(&self) -> Option<&[Rung; N]> {
        self.rungs.last_chunk::<N>()
    }

    fn observed(&self) -> Option<f64> {
        let [a, b, c] = self.last::<3>()?;
        let (far, near) = (a.value - b.value, b.value - c.value);
        if near.abs() <= ROUND_OFF * self.scale || far.abs() <= ROUND_OFF * self.scale {
            return None;
        }
        let seen = far / near;
        let ratio = |p: f64| {
            let [a, b, c] = [a, b, c].map(|r| r.size.powf(p));
            (a - b) / (b - c)
        };
        let (mut low, mut high) = (0.05, 8.0);
        if !(ratio(low) < seen && seen < ratio(high)) {
            return None;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if ratio(middle) < seen {
                low = middle
            } else {
                high = middle
            }
        }
        Some(low)
    }

    fn extrapolate(&self, p: f64) -> f64 {
        match self.last::<2>() {
            Some([b, c]) => {
                let (hb, hc) = (b.size.powf(p), c.size.powf(p));
                c.value - (b.value - c.value) * hc / (hb - hc)
            }
            None => f64::NAN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn ladder(f: impl Fn(f64) -> f64) -> Ladder {
        let rungs = [0.4, 0.21, 0.1].map(|size| Rung {
            label: size.to_string(),
            size,
            value: f(size),
        });
        Ladder::new("test", "size", 3.0, rungs.to_vec())
    }

    /// Order and limit of `3 + c hᵖ` are found from unequal refinements.
    #[test]
    fn powers() {
        for p in [1.0, 1.5, 2.0_f64] {
            let found = ladder(|h| 3.0 - 0.7 * h.powf(p)).finding();
            assert_relative_eq!(found.order.unwrap(), p, epsilon = 1e-9);
            assert_relative_eq!(found.extrapolated.unwrap(), 3.0, epsilon = 1e-9);
            assert!(found.holds);
        }
        // An order that the elements cannot have is shown but not believed.
        let cubic = ladder(|h| 3.0 + h.powi(3)).finding();
        assert_relative_eq!(cubic.order.unwrap(), 3.0, epsilon = 1e-9);
        assert!(cubic.extrapolated.unwrap() < 3.0);
    }

    /// No order where there is none; the finest value is judged then.
    #[test]
    fn without_an_order() {
        let wild = ladder(|h| if h == 0.21 { 3.5 } else { 3.0 + h }).finding();
        assert_eq!((wild.order, wild.extrapolated), (None, None));
        assert_relative_eq!(wild.error, 0.1 / 3.0, epsilon = 1e-12);
        assert!(!wild.holds);
        let same = ladder(|h| 3.0 + 1e-13 * h).finding();
        assert_eq!(same.order, None);
        assert!(same.holds);
        let every = ladder(|h| 3.0 + h).within(0.1, Judged::Every).finding();
        assert_relative_eq!(every.error, 0.4 / 3.0, epsilon = 1e-12);
        assert!(!every.holds);
        assert!(!ladder(|_| f64::NAN).finding().holds);
        let nowhere = ladder(|_| f64::NAN).within(0.1, Judged::Every).finding();
        assert!(!nowhere.holds);
    }
}
