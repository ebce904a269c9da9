use crate::chart::{Chart, Op};

/// A loop of a knitted cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnitLoop {
    /// Row in the graph: 0 is the cast-on, the chart's rows follow, the last
    /// one is the bind-off.
    pub row: u32,
    /// Place in the row, from the left.
    pub column: u32,
    /// Operation that made it. The cast-on is knit, the bind-off shows the face
    /// of the loops below it.
    pub op: Op,
    /// First loop that it is drawn through; its parents are consecutive.
    pub first_parent: u32,
    /// Number of parents; none for a yarn-over and the cast-on.
    pub parents: u8,
    /// First loop drawn through it; its children are consecutive.
    pub first_child: u32,
    /// Number of children; none for the bind-off.
    pub children: u8,
    /// Place among the children of its parent.
    pub sibling: u8,
}

impl KnitLoop {
    /// Indices of the loops it is drawn through, left to right.
    pub fn parent_range(&self) -> std::ops::Range<u32> {
        self.first_parent..self.first_parent + u32::from(self.parents)
    }

    /// Indices of the loops drawn through it, left to right.
    pub fn child_range(&self) -> std::ops::Range<u32> {
        self.first_child..self.first_child + u32::from(self.children)
    }
}

/// Loops of a chart with a cast-on below and a bind-off above, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopGraph {
    /// The loops, left to right within a row.
    pub loops: Vec<KnitLoop>,
    /// First loop of every row, and the number of loops.
    pub rows: Vec<u32>,
    /// Whether a row is worked from left to right.
    pub rightward: Vec<bool>,
}

/// A piece of yarn: loops in the order in which it passes them.
#[derive(Clone, Debug, PartialEq)]
pub struct Thread {
    /// Loop, and whether it is passed from left to right.
    pub loops: Vec<(u32, bool)>,
    /// A cast-on or bind-off.
    pub auxiliary: bool,
}

impl LoopGraph {
    /// The loops of a chart.
    pub fn new(chart: &Chart) -> Self {
        let mut graph = Self {
            loops: Vec::with_capacity(chart.loops() + 2 * chart.cast_on()),
            rows: vec![0],
            rightward: Vec::new(),
        };
        for column in 0..chart.cast_on() as u32 {
            graph.push(0, column, Op::KNIT, 0, 0);
        }
        graph.close(true);
        for row in chart.rows() {
            graph.add_row(&row.stitches);
            graph.close(row.ws);
        }
        let live = graph.row(graph.row_count() - 1);
        let bind_off: Vec<Op> = live
            .map(|l| graph.loops[l as usize].op.purl())
            .map(|purl| Op::Plain { purl })
            .collect();
        graph.add_row(&bind_off);
        graph.close(true);
        graph
    }

    /// Loops of a row.
    pub fn row(&self, row: usize) -> std::ops::Range<u32> {
        self.rows[row]..self.rows[row + 1]
    }

    /// Number of rows, cast-on and bind-off included.
    pub fn row_count(&self) -> usize {
        self.rightward.len()
    }

    /// Whether a row is the cast-on or the bind-off.
    pub fn is_auxiliary(&self, row: usize) -> bool {
        row == 0 || row + 1 == self.row_count()
    }

    /// Whether every loop has one parent and one child.
    pub fn is_regular(&self) -> bool {
        let last = self.row_count() as u32 - 1;
        let mut loops = self.loops.iter();
        loops.all(|l| (l.row == 0 || l.parents == 1) && (l.row == last || l.children == 1))
    }

    /// Runs of yarn over the loops for which `keep` holds: one through all
    /// rows of the chart, one for the cast-on and one for the bind-off. Where a
    /// loop is left out its yarn ends and the next piece begins.
    pub fn threads(&self, keep: impl Fn(u32) -> bool) -> Vec<Thread> {
        let mut threads = Vec::new();
        let mut piece = Vec::new();
        for row in 0..self.row_count() {
            let auxiliary = self.is_auxiliary(row);
            let right = self.rightward[row];
            let count = self.row(row).len() as u32;
            for k in 0..count {
                let column = if right { k } else { count - 1 - k };
                let l = self.rows[row] + column;
                if keep(l) {
                    piece.push((l, right));
                } else {
                    cut(&mut threads, &mut piece, auxiliary);
                }
            }
            // The yarn goes on into the next row of the chart.
            if auxiliary || self.is_auxiliary(row + 1) {
                cut(&mut threads, &mut piece, auxiliary);
            }
        }
        threads
    }

    fn add_row(&mut self, stitches: &[Op]) {
        let row = self.rightward.len() as u32;
        let mut parent = self.rows[self.rows.len() - 2];
        let mut column = 0;
        for op in stitches {
            let takes = op.takes() as u32;
            for p in parent..parent + takes {
                self.loops[p as usize].first_child = self.loops.len() as u32;
                self.loops[p as usize].children = op.makes() as u8;
            }
            for sibling in 0..op.makes() as u8 {
                let l = self.push(row, column, *op, parent, takes as u8);
                self.loops[l].sibling = sibling;
                column += 1;
            }
            parent += takes;
        }
    }

    fn push(&mut self, row: u32, column: u32, op: Op, first_parent: u32, parents: u8) -> usize {
        self.loops.push(KnitLoop {
            row,
            column,
            op,
            first_parent,
            parents,
            first_child: 0,
            children: 0,
            sibling: 0,
        });
        self.loops.len() - 1
    }

    fn close(&mut self, rightward: bool) {
        self.rows.push(self.loops.len() as u32);
        self.rightward.push(rightward);
    }
}

fn cut(threads: &mut Vec<Thread>, piece: &mut Vec<(u32, bool)>, auxiliary: bool) {
    if !piece.is_empty() {
        let loops = std::mem::take(piece);
        threads.push(Thread { loops, auxiliary });
    }
}
