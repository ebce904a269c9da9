use super::template::positive;
use super::{KnitOptions, LoopTemplate, StitchMap, TemplateCells};
use crate::vec3::V;
use crate::{NONE, YarnError};

/// Nodes at the base of a loop; their middle is its centre.
const BASE: [usize; 4] = [0, 1, 6, 7];
/// Least share of the sample on each side that is no interior.
const BORDER: f64 = 0.25;

/// Loops of a sample by row and column.
struct Grid<'a> {
    map: &'a StitchMap,
    points: &'a [[f64; 3]],
    columns: usize,
    rows: usize,
}

/// One repeat of a sample and its place in the fabric.
struct Block {
    /// Mean of the centres.
    centre: V,
    /// Unit vectors along courses, wales and to the viewer.
    axes: [V; 3],
    /// Distances between loops in a row and between rows \[m\].
    pitch: [f64; 2],
}

impl KnitOptions {
    /// Loops as they are in the interior of a relaxed sample: the mean of each
    /// cell of the repeat, in the frame of its repeat.
    ///
    /// `map` is that of the sample, knitted with `self` from a chart of one
    /// loop to each parent; `repeat` counts its columns and rows; `points` \[m\]
    /// are the nodes of the strands and `arcs` \[m\] their arc lengths, relaxed.
    /// The outermost two repeats and a quarter of the sample on each side are
    /// left out [Cirio2017]. Rest lengths of contacts stay those of `self`.
    ///
    /// # Errors
    /// [`YarnError::Parameter`] when the sample has no interior.
    pub fn measured(
        &self,
        map: &StitchMap,
        repeat: [usize; 2],
        node_of: impl Fn(u32) -> u32,
        points: &[[f64; 3]],
        arcs: &[f64],
    ) -> Result<Self, YarnError> {
        let columns = map.loops.iter().map(|l| l.column as usize + 1).max();
        let rows = map.loops.iter().map(|l| l.row as usize + 1).max();
        let at_nodes: Vec<[f64; 3]> = (0..arcs.len() as u32)
            .map(|s| points[node_of(s) as usize])
            .collect();
        let grid = Grid {
            map,
            points: &at_nodes,
            columns: columns.unwrap_or(0),
            rows: rows.unwrap_or(0),
        };
        let [across, up] = repeat;
        let blocks = [grid.columns / across.max(1), grid.rows / up.max(1)];
        let margin = blocks.map(|n| 2.max((BORDER * n as f64).ceil() as usize));
        let full = grid.columns * grid.rows == map.loops.len();
        if !full || (0..2).any(|k| blocks[k] <= 2 * margin[k]) {
            return Err(YarnError::Parameter {
                what: "repeats in the sample of a knit",
                value: blocks[0].min(blocks[1]) as f64,
                allowed: "at least 5 across and upwards, one loop to each parent",
            });
        }
        let cells = across * up;
        let mut nodes = vec![[V::zeros(); 8]; cells];
        let mut lengths = vec![[0.0; 8]; cells];
        let mut pitch = [0.0; 2];
        let mut count = 0.0;
        for bj in margin[1]..blocks[1] - margin[1] {
            for bi in margin[0]..blocks[0] - margin[0] {
                let block = grid.block([bi, bj], repeat);
                count += 1.0;
                (0..2).for_each(|k| pitch[k] += block.pitch[k]);
                for b in 0..up {
                    for a in 0..across {
                        let (row, column) = (bj * up + b, bi * across + a);
                        let ideal = [(a, across, 0), (b, up, 1)]
                            .map(|(k, n, axis)| {
                                let off = k as f64 - 0.5 * (n as f64 - 1.0);
                                off * block.pitch[axis] * block.axes[axis]
                            })
                            .iter()
                            .fold(block.centre, |c, d| c + d);
                        let cell = b * across + a;
                        grid.add_nodes(row, column, ideal, &block, &mut nodes[cell]);
                        grid.add_lengths(row, column, arcs, &mut lengths[cell]);
                    }
                }
            }
        }
        let [course, row] = pitch.map(|p| p / count);
        positive("course pitch", course)?;
        let templates = (0..cells).map(|cell| LoopTemplate {
            course,
            row,
            nodes: nodes[cell].map(|p| (p / count).into()),
            arcs: lengths[cell].map(|l| l / count),
        });
        let templates = TemplateCells::new(across as u32, templates.collect())?;
        let contact = self.template.contact();
        Ok(Self {
            material: self.material.clone(),
            template: LoopTemplate::flat(course, row, 1.0, contact),
            cells: Some(templates),
        })
    }
}

impl Grid<'_> {
    fn strands(&self, row: usize, column: usize) -> &[u32; 8] {
        &self.map.loops[row * self.columns + column].strands
    }

    fn point(&self, strand: u32) -> V {
        V::from(self.points[strand as usize])
    }

    fn centre(&self, row: usize, column: usize) -> V {
        let strands = self.strands(row, column);
        let sum: V = BASE.iter().map(|k| self.point(strands[*k])).sum();
        sum / BASE.len() as f64
    }

    fn mean(&self, [i, j]: [usize; 2], [across, up]: [usize; 2]) -> V {
        let rows = j * up..(j + 1) * up;
        let all = rows.flat_map(|r| (i * across..(i + 1) * across).map(move |c| (r, c)));
        let sum: V = all.map(|(r, c)| self.centre(r, c)).sum();
        sum / (across * up) as f64
    }

    fn block(&self, [i, j]: [usize; 2], repeat: [usize; 2]) -> Block {
        let mean = |i: usize, j: usize| self.mean([i, j], repeat);
        let along = mean(i + 1, j) - mean(i - 1, j);
        let upwards = mean(i, j + 1) - mean(i, j - 1);
        let front = along.cross(&upwards).normalize();
        let (u, w) = (along.normalize(), upwards.normalize());
        // As near to both directions as a right angle lets them be.
        let (sum, difference) = ((u + w).normalize(), (u - w).normalize());
        let half = std::f64::consts::FRAC_1_SQRT_2;
        Block {
            centre: mean(i, j),
            axes: [half * (sum + difference), half * (sum - difference), front],
            pitch: [
                along.norm() / (2 * repeat[0]) as f64,
                upwards.norm() / (2 * repeat[1]) as f64,
            ],
        }
    }

    fn add_nodes(&self, row: usize, column: usize, at: V, block: &Block, to: &mut [V; 8]) {
        let this = &self.map.loops[row * self.columns + column];
        let sign = if this.op.purl() { -1.0 } else { 1.0 };
        for (to, strand) in to.iter_mut().zip(this.strands) {
            let d = self.point(strand) - at;
            let [x, y, z] = block.axes.map(|axis| axis.dot(&d));
            *to += V::new(x, y, sign * z);
        }
    }

    fn add_lengths(&self, row: usize, column: usize, arcs: &[f64], to: &mut [f64; 8]) {
        let own = self.strands(row, column);
        let beside = self.strands(row, column + 1)[0];
        for (k, to) in to.iter_mut().enumerate() {
            let next = if k == 7 { beside } else { own[k + 1] };
            debug_assert!(own[k] != NONE && next != NONE);
            *to += (arcs[next as usize] - arcs[own[k] as usize]).abs();
        }
    }
}
