use crate::YarnError;

/// Shape of one loop: places of its eight nodes and arc lengths of its eight
/// segments.
///
/// Nodes in the order in which the yarn passes from left to right: base-left A,
/// B, head-left A', B', head-right B', A', base-right B, A. Segment `k` runs
/// from node `k` to the next; the last one is the sinker to the loop on the
/// right.
///
/// ```text
///       B' 3 ---------- 4 B'
///     A' 2 /            \ 5 A'
///         |              |
///      B 1 \            / 6 B
///  ... A 0 /            \ 7 A ...
/// ```
/// The default is flat, with A at ±0.32 courses and −0.10 rows of a contact,
/// B at ±0.18 and +0.10.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopTemplate {
    /// Distance p_c of loops in a row \[m\].
    pub course: f64,
    /// Distance p_r of rows \[m\].
    pub row: f64,
    /// Nodes of a knit stitch relative to the centre of its loop: along the
    /// row, upwards, towards the viewer \[m\]. A purl has the last one negated.
    /// The base places contacts; the head is where the next row's base comes
    /// to lie, a row higher.
    pub nodes: [[f64; 3]; 8],
    /// Rest arc lengths \[m\]. All yarns of a contact have that of the child's
    /// base, unless cells give each its own; other segments keep the ratio of
    /// arc length and distance.
    pub arcs: [f64; 8],
}

/// What a segment of a loop is; an index into [`LoopTemplate::arcs`].
pub(super) const LEG: usize = 1;
pub(super) const HEAD: usize = 3;
pub(super) const SINKER: usize = 7;

impl LoopTemplate {
    /// The flat default shape.
    ///
    /// Segments between contacts are as long as their ends are apart, times
    /// `slack`; those within a contact measure `contact` \[m\] or the distance
    /// of A and B if that is larger.
    pub fn flat(course: f64, row: f64, slack: f64, contact: f64) -> Self {
        let node = |x: f64, y: f64| [x * course, y * row, 0.0];
        let nodes = [
            node(-0.32, -0.10),
            node(-0.18, 0.10),
            node(-0.32, 0.90),
            node(-0.18, 1.10),
            node(0.18, 1.10),
            node(0.32, 0.90),
            node(0.18, 0.10),
            node(0.32, -0.10),
        ];
        let mut template = Self {
            course,
            row,
            nodes,
            arcs: [0.0; 8],
        };
        for k in 0..8 {
            let straight = template.straight(k);
            template.arcs[k] = match k % 2 {
                0 => straight.max(contact),
                _ => straight * slack,
            };
        }
        template
    }

    /// Rest length L of a stitch contact: mean of the two of the base \[m\].
    pub fn contact(&self) -> f64 {
        0.5 * (self.arcs[0] + self.arcs[6])
    }

    /// Distance of the ends of a segment \[m\].
    pub fn straight(&self, segment: usize) -> f64 {
        let from = self.nodes[segment];
        let mut to = self.nodes[(segment + 1) % 8];
        if segment == 7 {
            to[0] += self.course;
        }
        distance(from, to)
    }

    /// Arc length over distance of a segment.
    pub(super) fn excess(&self, segment: usize) -> f64 {
        self.arcs[segment] / self.straight(segment)
    }

    /// Checks pitches, places and lengths.
    ///
    /// # Errors
    /// [`YarnError::Parameter`] for the first value outside its range.
    pub fn validate(&self) -> Result<(), YarnError> {
        positive("course pitch", self.course)?;
        positive("row pitch", self.row)?;
        for k in 0..8 {
            positive("arc length of a loop's segment", self.arcs[k])?;
            positive("distance of a loop's nodes", self.straight(k))?;
        }
        Ok(())
    }
}

/// Shapes of the loops of one repeat of a chart, for instance averages over a
/// relaxed sample ([`KnitOptions::measured`](super::KnitOptions::measured)).
/// Arc lengths within contacts are those of the shape; the rest length of the
/// contact is that of [`KnitOptions::template`](super::KnitOptions::template).
#[derive(Clone, Debug, PartialEq)]
pub struct TemplateCells {
    columns: u32,
    templates: Vec<LoopTemplate>,
}

impl TemplateCells {
    /// Shapes row by row, left to right, `columns` to a row. Row `r`, column
    /// `j` of a chart takes the shape of row `r` modulo the rows and column `j`
    /// modulo the columns; the pitches are those of
    /// [`KnitOptions::template`](super::KnitOptions::template).
    ///
    /// # Errors
    /// [`YarnError::Parameter`] when the rows are not full or a shape is
    /// outside its range.
    pub fn new(columns: u32, templates: Vec<LoopTemplate>) -> Result<Self, YarnError> {
        if columns == 0 || templates.is_empty() || !templates.len().is_multiple_of(columns as usize)
        {
            return Err(YarnError::Parameter {
                what: "number of loop shapes",
                value: templates.len() as f64,
                allowed: "a positive multiple of the columns",
            });
        }
        for template in &templates {
            template.validate()?;
        }
        Ok(Self { columns, templates })
    }

    /// Rows of the repeat.
    pub fn rows(&self) -> u32 {
        self.templates.len() as u32 / self.columns
    }

    /// The shapes, row by row, left to right, and how many to a row.
    pub fn templates(&self) -> (u32, &[LoopTemplate]) {
        (self.columns, &self.templates)
    }

    /// Shape of a loop of the chart.
    pub fn at(&self, row: u32, column: u32) -> &LoopTemplate {
        let cell = (row % self.rows()) * self.columns + column % self.columns;
        &self.templates[cell as usize]
    }
}

pub(super) fn positive(what: &'static str, value: f64) -> Result<(), YarnError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    let allowed = "positive and finite";
    Err(YarnError::Parameter {
        what,
        value,
        allowed,
    })
}

pub(super) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}
