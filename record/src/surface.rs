use crate::{RecordError, RunHeader};

/// A triangle mesh at one instant, borrowed from wherever it lives.
#[derive(Clone, Copy, Debug, Default)]
pub struct Surface<'a> {
    /// Coordinates, three a point \[m\]. Longer arrays (scalar unknowns behind
    /// the points) are fine.
    pub positions: &'a [f64],
    /// Number of points.
    pub points: usize,
    /// Triangles.
    pub triangles: &'a [[u32; 3]],
    /// (warp, weft) coordinates of the corners \[m\]; may be empty.
    pub material: &'a [[[f64; 2]; 3]],
    /// Panel of each triangle; may be empty.
    pub panels: &'a [u16],
    /// Names of the panels; may be empty.
    pub panel_names: &'a [String],
}

impl<'a> Surface<'a> {
    /// The cloth of a recording with the positions of one of its frames.
    pub fn of(header: &'a RunHeader, positions: &'a [f64]) -> Self {
        Self {
            positions,
            points: header.points,
            triangles: &header.triangles,
            material: &header.material,
            panels: &header.panels,
            panel_names: &header.panel_names,
        }
    }

    /// Checks that all parts fit together and all coordinates are finite.
    ///
    /// # Errors
    /// [`RecordError::Surface`].
    pub fn validate(&self) -> Result<(), RecordError> {
        let fail = |reason: String| Err(RecordError::Surface { reason });
        let Some(positions) = self.positions.get(..3 * self.points) else {
            return fail(format!(
                "{} coordinates for {} points",
                self.positions.len(),
                self.points
            ));
        };
        if let Some(i) = positions.iter().position(|x| !x.is_finite()) {
            return fail(format!("point {} is not finite", i / 3));
        }
        for (t, triangle) in self.triangles.iter().enumerate() {
            if triangle.iter().any(|p| *p as usize >= self.points) {
                return fail(format!(
                    "triangle {t} {triangle:?} with {} points",
                    self.points
                ));
            }
        }
        let count = self.triangles.len();
        for (what, length) in [
            ("material", self.material.len()),
            ("panels", self.panels.len()),
        ] {
            if length != 0 && length != count {
                return fail(format!("{what} has {length} entries for {count} triangles"));
            }
        }
        if self
            .material
            .iter()
            .flatten()
            .flatten()
            .any(|x| !x.is_finite())
        {
            return fail("material coordinates are not finite".into());
        }
        Ok(())
    }

    /// Coordinates of a point \[m\].
    pub(crate) fn point(&self, p: u32) -> [f64; 3] {
        let p = 3 * p as usize;
        [
            self.positions[p],
            self.positions[p + 1],
            self.positions[p + 2],
        ]
    }

    /// Name of the panel of a triangle.
    pub(crate) fn panel_name(&self, panel: u16) -> String {
        let name = self
            .panel_names
            .get(panel as usize)
            .map_or("", String::as_str);
        if name.is_empty() {
            format!("panel_{panel}")
        } else {
            name.to_owned()
        }
    }
}
