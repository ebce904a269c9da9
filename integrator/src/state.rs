use selvedge_energy::DofLayout;

/// Unknowns, their rates and the time.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Shape of `q` and `v`.
    pub layout: DofLayout,
    /// Unknowns: points and arc lengths [m], points that stand for a rotation
    /// [rad].
    pub q: Vec<f64>,
    /// Their rates [m/s, rad/s].
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

    /// Kinetic energy `½ Σ m |v|²` of the points with lumped `masses` [kg], in J;
    /// scalars and inertia that couples unknowns are left out.
    pub fn kinetic_energy(&self, masses: &[f64]) -> f64 {
        let (v, _) = self.v.as_chunks::<3>();
        masses
            .iter()
            .zip(v)
            .map(|(m, v)| 0.5 * m * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))
            .sum()
    }

    /// Points and scalars at rest at time zero.
    pub fn with_scalars(positions: &[[f64; 3]], scalars: &[f64]) -> Self {
        let mut state = Self::at_rest(positions);
        state.layout.scalars = scalars.len();
        state.q.extend_from_slice(scalars);
        state.v.resize(state.q.len(), 0.0);
        state
    }

    /// Place of the first unknown that is NaN or infinite or has such a rate.
    pub fn first_not_finite(&self) -> Option<(usize, &'static str)> {
        let bad = |values: &[f64]| values.iter().position(|x| !x.is_finite());
        let name = |i: usize, of_point, of_scalar| {
            let point = i < 3 * self.layout.points;
            (i, if point { of_point } else { of_scalar })
        };
        bad(&self.q)
            .map(|i| name(i, "the position", "the arc length"))
            .or_else(|| bad(&self.v).map(|i| name(i, "the velocity", "the sliding velocity")))
    }

    /// The point at which the unknown at a place of `q` lives, with the owners
    /// of the scalars.
    pub fn point_of(&self, place: usize, owners: &[u32]) -> usize {
        match place.checked_sub(3 * self.layout.points) {
            None => place / 3,
            Some(s) => owners.get(s).map_or(0, |&p| p as usize),
        }
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
