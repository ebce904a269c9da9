use selvedge_energy::DofLayout;

/// Unknowns, their rates and the time.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Shape of `q` and `v`.
    pub layout: DofLayout,
    /// Unknowns [m].
    pub q: Vec<f64>,
    /// Their rates [m/s].
    pub v: Vec<f64>,
    /// Simulated time [s].
    pub time: f64,
}

impl State {
    /// Points at rest at time zero.
    pub fn at_rest(positions: &[[f64; 3]]) -> Self {
        Self {
            layout: DofLayout::points(positions.len()),
            q: positions.as_flattened().to_vec(),
            v: vec![0.0; 3 * positions.len()],
            time: 0.0,
        }
    }

    /// Kinetic energy `½ Σ m |v|²` [J].
    pub fn kinetic_energy(&self, masses: &[f64]) -> f64 {
        let (v, _) = self.v.as_chunks::<3>();
        masses
            .iter()
            .zip(v)
            .map(|(m, v)| 0.5 * m * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))
            .sum()
    }

    /// First point with an unknown or a rate that is NaN or infinite.
    pub fn first_not_finite(&self) -> Option<(usize, &'static str)> {
        let bad = |values: &[f64]| values.iter().position(|x| !x.is_finite());
        bad(&self.q)
            .map(|i| (i / 3, "the position"))
            .or_else(|| bad(&self.v).map(|i| (i / 3, "the velocity")))
    }
}

/// Named arrays that bring a simulation back bit for bit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Name and values of each part.
    pub sections: Vec<(String, Vec<f64>)>,
}

impl Snapshot {
    /// Values of a section.
    pub fn section(&self, name: &str) -> Option<&[f64]> {
        self.sections
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, v)| v.as_slice())
    }
}
