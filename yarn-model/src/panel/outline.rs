use super::PanelError;

/// Border of a panel in its plane: closed polygons, the outer one and holes in
/// any order and orientation. A place is inside if a line from it to infinity
/// crosses the border an odd number of times.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    edges: Vec<[[f64; 2]; 2]>,
}

impl Outline {
    /// The outline of a polygon \[m\].
    ///
    /// # Errors
    /// [`PanelError`] for numbers that are not finite and polygons without
    /// area.
    pub fn polygon(points: &[[f64; 2]]) -> Result<Self, PanelError> {
        Self::from_edges(
            (0..points.len())
                .map(|k| [points[k], points[(k + 1) % points.len()]])
                .collect(),
        )
    }

    /// The outline of edges \[m\] that form closed polygons. Outer polygons run
    /// counter-clockwise and holes clockwise, or all the other way round.
    ///
    /// # Errors
    /// [`PanelError`] for numbers that are not finite and outlines without
    /// area.
    pub fn from_edges(edges: Vec<[[f64; 2]; 2]>) -> Result<Self, PanelError> {
        let finite = |e: &[[f64; 2]; 2]| e.as_flattened().iter().all(|x| x.is_finite());
        if let Some(index) = edges.iter().position(|e| !finite(e)) {
            let what = "edge of the outline";
            return Err(PanelError::NotFinite { what, index });
        }
        let outline = Self { edges };
        if outline.area() > 0.0 {
            return Ok(outline);
        }
        let points = outline.edges.len();
        Err(PanelError::EmptyOutline { points })
    }

    /// Lower left and upper right corner of the bounding box \[m\].
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for [p, _] in &self.edges {
            for k in 0..2 {
                bounds[0][k] = bounds[0][k].min(p[k]);
                bounds[1][k] = bounds[1][k].max(p[k]);
            }
        }
        bounds
    }

    /// Area \[m²\].
    pub fn area(&self) -> f64 {
        let doubled = |[a, b]: &[[f64; 2]; 2]| a[0] * b[1] - a[1] * b[0];
        0.5 * self.edges.iter().map(doubled).sum::<f64>().abs()
    }

    /// Whether a place is inside.
    pub fn contains(&self, place: [f64; 2]) -> bool {
        let below = |y: &f64| *y <= place[1];
        self.crossings(0, place[0]).filter(below).count() % 2 == 1
    }

    /// Stretches inside along the line on which coordinate `axis` has the value
    /// `at`: from and to in the other coordinate, in growing order \[m\].
    pub fn spans(&self, axis: usize, at: f64) -> Vec<[f64; 2]> {
        let mut all: Vec<f64> = self.crossings(axis, at).collect();
        all.sort_by(f64::total_cmp);
        all.as_chunks::<2>().0.to_vec()
    }

    /// Where a line crosses the border. An edge has its lower end and not its
    /// upper one, so that a line through a corner crosses once or twice.
    fn crossings(&self, axis: usize, at: f64) -> impl Iterator<Item = f64> + '_ {
        let other = 1 - axis;
        let cross = move |[a, b]: &[[f64; 2]; 2]| {
            if (a[axis] <= at) == (b[axis] <= at) {
                return None;
            }
            let t = (at - a[axis]) / (b[axis] - a[axis]);
            Some(a[other] + t * (b[other] - a[other]))
        };
        self.edges.iter().filter_map(cross)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A U: 3 wide, 2 high, with a notch 1 wide and 1 deep from above.
    fn u() -> Outline {
        Outline::polygon(&[
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [0.0, 2.0],
        ])
        .expect("an outline")
    }

    #[test]
    fn a_re_entrant_outline_has_two_spans_across_its_arms() {
        let u = u();
        assert_eq!(u.area(), 5.0);
        assert_eq!(u.bounds(), [[0.0, 0.0], [3.0, 2.0]]);
        assert_eq!(u.spans(1, 1.5), [[0.0, 1.0], [2.0, 3.0]]);
        assert_eq!(u.spans(1, 0.5), [[0.0, 3.0]]);
        assert_eq!(u.spans(0, 1.5), [[0.0, 1.0]]);
        assert!(u.contains([0.5, 1.5]) && u.contains([2.5, 1.5]) && u.contains([1.5, 0.5]));
        assert!(!u.contains([1.5, 1.5]) && !u.contains([-0.1, 0.5]) && !u.contains([0.5, 2.1]));
    }

    #[test]
    fn impossible_outlines_are_refused() {
        assert!(Outline::polygon(&[[0.0, 0.0], [1.0, 0.0]]).is_err());
        assert!(Outline::polygon(&[[0.0, 0.0], [1.0, f64::NAN], [0.0, 1.0]]).is_err());
    }
}
