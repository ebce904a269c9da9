use super::{KnitOptions, LoopGraph, LoopTemplate, relaxed_centres};

/// Width of a parent's head over which several children are spread, in courses.
const HEAD_WIDTH: f64 = 0.64;

/// Where loops and their contacts lie.
pub(super) struct Layout<'a> {
    graph: &'a LoopGraph,
    pub options: &'a KnitOptions,
    /// Centre of every loop \[m\].
    pub centres: Vec<[f64; 2]>,
}

impl<'a> Layout<'a> {
    pub fn new(graph: &'a LoopGraph, options: &'a KnitOptions) -> Self {
        let LoopTemplate { course, row, .. } = options.template;
        Self {
            centres: relaxed_centres(graph, course, row),
            graph,
            options,
        }
    }

    /// Shape of a loop.
    pub fn template(&self, l: u32) -> &'a LoopTemplate {
        let this = self.graph.loops[l as usize];
        match &self.options.cells {
            // The cast-on continues the repeat downwards.
            Some(cells) => cells.at((this.row + cells.rows()).saturating_sub(1), this.column),
            None => &self.options.template,
        }
    }

    /// A place of the template about a centre \[m\].
    pub fn point(&self, l: u32, place: usize, centre: [f64; 2], narrow: f64) -> [f64; 3] {
        let [x, y, z] = self.template(l).nodes[place];
        let [c, s] = self.along_row(l);
        let x = narrow * x;
        let purl = self.graph.loops[l as usize].op.purl();
        let z = if purl { -z } else { z };
        [centre[0] + x * c - y * s, centre[1] + x * s + y * c, z]
    }

    /// Centre of a stitch and the width of its contacts: the child's centre,
    /// which lies amid its parents, or its share of a parent's head.
    pub fn contact_centre(&self, l: u32) -> ([f64; 2], f64) {
        let this = self.graph.loops[l as usize];
        let parent = self.graph.loops[this.first_parent as usize];
        if parent.children < 2 {
            return (self.centres[l as usize], self.room(l));
        }
        let count = f64::from(parent.children);
        let mut centre = [0.0; 2];
        for c in parent.child_range() {
            for k in 0..2 {
                centre[k] += self.centres[c as usize][k] / count;
            }
        }
        let along = self.along_row(l);
        let aside = (f64::from(this.sibling) - 0.5 * (count - 1.0)) * HEAD_WIDTH / count;
        for k in 0..2 {
            centre[k] += aside * self.options.template.course * along[k];
        }
        (centre, 1.0 / count)
    }

    /// Distance to the nearer neighbour in the row, in courses, if less than
    /// one: contacts of squeezed loops must not overlap.
    fn room(&self, l: u32) -> f64 {
        let row = self.graph.row(self.graph.loops[l as usize].row as usize);
        let here = self.centres[l as usize];
        let beside = [l.wrapping_sub(1), l + 1].into_iter();
        let apart = beside.filter(|k| row.contains(k)).map(|k| {
            let there = self.centres[k as usize];
            (there[0] - here[0]).hypot(there[1] - here[1])
        });
        let room = apart.fold(f64::INFINITY, f64::min) / self.options.template.course;
        // Round-off must not make the loops of a grid differ.
        if room > 1.0 - 1e-9 {
            1.0
        } else {
            room.max(0.3)
        }
    }

    /// Unit vector along the row at a loop.
    fn along_row(&self, l: u32) -> [f64; 2] {
        let row = self.graph.row(self.graph.loops[l as usize].row as usize);
        let before = self.centres[l.saturating_sub(1).max(row.start) as usize];
        let after = self.centres[(l + 1).min(row.end - 1) as usize];
        let d = [after[0] - before[0], after[1] - before[1]];
        let length = d[0].hypot(d[1]);
        // A row of one loop.
        if length < 1e-3 * self.options.template.course {
            return [1.0, 0.0];
        }
        d.map(|d| d / length)
    }
}
