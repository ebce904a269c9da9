use std::cell::RefCell;
use std::ops::Range;

use rayon::prelude::*;
use selvedge_linsolve::{ChunkColouring, colour_chunks};

use super::bordered::Slots;
use super::{AssemblyOptions, Scatter};

/// Chunks of a term at most: enough for the threads of a workstation.
const CHUNKS: usize = 48;

thread_local! {
    static SCRATCH: RefCell<Scratch> = const { RefCell::new([Vec::new(), Vec::new()]) };
}

/// Local vectors and local matrices of a thread.
pub(super) type Scratch = [Vec<f64>; 2];

/// Order of work on one term.
pub(super) struct Schedule {
    colouring: ChunkColouring,
    /// Matrix slots of the pairs of every stencil, see [`slots`](super::points::slots).
    pub(super) slots: Vec<u32>,
    /// The same of stencils of points and scalars.
    pub(super) mixed: Slots,
    values: Vec<f64>,
}

impl Schedule {
    pub(super) fn new<'a>(
        points: usize,
        stencils: impl ExactSizeIterator<Item = &'a [u32]>,
        slots: Vec<u32>,
        options: AssemblyOptions,
    ) -> Self {
        let chunk = options.chunk.max(stencils.len() / CHUNKS);
        let mut colouring = colour_chunks(points, stencils, chunk);
        if options.scatter == Scatter::Atomics {
            let all = (0..colouring.chunks.len() as u32).collect();
            colouring.colours = vec![all];
        }
        let values = vec![0.0; colouring.chunks.len()];
        Self {
            colouring,
            slots,
            mixed: Slots::default(),
            values,
        }
    }

    /// Runs `work` on every chunk, colour by colour, and keeps what it returns.
    pub(super) fn run(&mut self, work: impl Fn(Range<usize>, &mut Scratch) -> f64 + Sync) {
        let chunks = &self.colouring.chunks;
        for colour in &self.colouring.colours {
            let one = |&c: &u32| {
                let r = &chunks[c as usize];
                let range = r.start as usize..r.end as usize;
                (c, SCRATCH.with_borrow_mut(|scratch| work(range, scratch)))
            };
            // A lone chunk is not worth a thread's wake-up.
            if colour.len() < 2 {
                for c in colour {
                    let (c, value) = one(c);
                    self.values[c as usize] = value;
                }
            } else {
                let done: Vec<(u32, f64)> = colour.par_iter().map(one).collect();
                for (c, value) in done {
                    self.values[c as usize] = value;
                }
            }
        }
    }

    /// The same chunks in the same order, for work that shares nothing.
    pub(super) fn run_alone(&mut self, mut work: impl FnMut(Range<usize>, &mut Scratch) -> f64) {
        for &c in self.colouring.colours.iter().flatten() {
            let r = &self.colouring.chunks[c as usize];
            let range = r.start as usize..r.end as usize;
            self.values[c as usize] = SCRATCH.with_borrow_mut(|scratch| work(range, scratch));
        }
    }

    pub(super) fn sum(&self) -> f64 {
        self.values.iter().sum()
    }

    pub(super) fn heap_bytes(&self) -> usize {
        size_of_val(self.slots.as_slice())
            + self.mixed.heap_bytes()
            + self.colouring.chunks.len() * (size_of::<Range<u32>>() + 4 + 8)
    }
}
