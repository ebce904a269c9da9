mod lanes;
mod rows;
mod search;
mod swept;

use rayon::prelude::*;

use crate::vec3::point;
use crate::{Aabb, BroadPhase, Candidates, CollisionBackend, CollisionError, CollisionMesh};
use rows::RowSorter;
use search::{Found, Search, Task};

/// Patches searched by one task for pairs within them.
const PATCHES: usize = 512;
/// Patch pairs searched by one task.
const PAIRS: usize = 2048;
/// Tasks whose results are held at a time, which bounds their memory.
const WAVE: usize = 16;

/// Discrete detection: the broad phase pairs small patches of triangles, and
/// each pair of patches is searched for primitives.
///
/// A candidate passes three tests: its swept boxes, grown by the reach, meet;
/// the mesh does not exclude it; its distance at `q_start` is at most the reach
/// plus the way that both primitives may go. Bounds in single precision, eight
/// pairs at a time, decide nearly all of them; those within their rounding are
/// decided in double precision. Candidates are sorted, so they do not depend on
/// the broad phase, on earlier calls or on the number of threads.
#[derive(Clone, Debug, Default)]
pub struct ProximityBackend<B> {
    broad_phase: B,
    boxes: Vec<Aabb>,
    pairs: Vec<[u32; 2]>,
    pair_sorter: RowSorter<[u32; 2]>,
    tasks: Vec<Task>,
    found: Vec<Found>,
    found_too: Vec<Found>,
    sorter: RowSorter<Found>,
}

impl<B: BroadPhase> ProximityBackend<B> {
    /// Detection on top of a broad phase.
    pub fn new(broad_phase: B) -> Self {
        Self {
            broad_phase,
            boxes: Vec::new(),
            pairs: Vec::new(),
            pair_sorter: RowSorter::default(),
            tasks: Vec::new(),
            found: Vec::new(),
            found_too: Vec::new(),
            sorter: RowSorter::default(),
        }
    }

    /// The broad phase.
    pub fn broad_phase(&self) -> &B {
        &self.broad_phase
    }

    /// Pairs of patches that the last broad phase gave.
    pub fn patch_pair_count(&self) -> usize {
        self.pairs.len()
    }
}

impl<B: BroadPhase> CollisionBackend for ProximityBackend<B> {
    fn name(&self) -> &str {
        self.broad_phase.name()
    }

    fn detect(
        &mut self,
        mesh: &CollisionMesh,
        q_start: &[f64],
        q_end: &[f64],
        reach: f64,
        out: &mut Candidates,
    ) -> Result<(), CollisionError> {
        out.clear();
        check_positions(mesh.points(), q_start)?;
        check_positions(mesh.points(), q_end)?;
        if !(reach >= 0.0 && reach.is_finite()) {
            return Err(CollisionError::Parameter {
                name: "reach",
                value: reach,
                requirement: "finite and not negative",
            });
        }
        let patches = mesh.patches();
        let inflate = 0.5 * reach;
        (0..patches.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                let mut b = Aabb::EMPTY;
                for p in patches.get(i).points {
                    b.include(point(q_start, *p));
                    b.include(point(q_end, *p));
                }
                b.inflate(inflate)
            })
            .collect_into_vec(&mut self.boxes);
        self.broad_phase.overlaps(&self.boxes, &mut self.pairs);
        self.pair_sorter
            .sort(&mut self.pairs, patches.len(), |p| *p);

        let domain = self.boxes.iter().fold(Aabb::EMPTY, |d, b| d.merge(b));
        let search = Search::new(mesh, (q_start, q_end), reach, [domain.min, domain.max]);
        // Patches against themselves first, then the pairs of patches.
        let selves = patches.len().div_ceil(PATCHES);
        let tasks = selves + self.pairs.len().div_ceil(PAIRS);
        if self.tasks.len() < WAVE.min(tasks) {
            self.tasks.resize_with(WAVE.min(tasks), Task::default);
        }
        self.found.clear();
        self.found_too.clear();
        for wave in (0..tasks).step_by(WAVE) {
            let count = WAVE.min(tasks - wave);
            let pairs = &self.pairs;
            self.tasks[..count]
                .par_iter_mut()
                .enumerate()
                .for_each(|(k, task)| {
                    task.clear();
                    let number = wave + k;
                    if number < selves {
                        let from = number * PATCHES;
                        for p in from..(from + PATCHES).min(patches.len()) {
                            search.within(p as u32, task);
                        }
                    } else {
                        let from = (number - selves) * PAIRS;
                        search.between(&pairs[from..(from + PAIRS).min(pairs.len())], task);
                    }
                });
            for task in &self.tasks[..count] {
                self.found.extend_from_slice(&task.vertex_triangle);
                self.found_too.extend_from_slice(&task.edge_edge);
            }
        }
        let Candidates {
            vertex_triangle,
            edge_edge,
            least,
        } = out;
        for (found, rows, pairs) in [
            (&mut self.found, mesh.points(), vertex_triangle),
            (&mut self.found_too, mesh.edges().len(), edge_edge),
        ] {
            self.sorter.sort(found, rows, |f| f.pair);
            pairs.extend(found.iter().map(|f| f.pair));
            least.extend(found.iter().map(|f| f.least));
        }
        Ok(())
    }

    fn heap_bytes(&self) -> usize {
        let found = self.found.capacity() + self.found_too.capacity();
        self.broad_phase.heap_bytes()
            + self.boxes.capacity() * size_of::<Aabb>()
            + self.pairs.capacity() * 8
            + self.pair_sorter.heap_bytes()
            + self.tasks.iter().map(Task::heap_bytes).sum::<usize>()
            + size_of::<Task>() * self.tasks.capacity()
            + size_of::<Found>() * found
            + self.sorter.heap_bytes()
    }
}

/// Checks length and finiteness of the positions of `points` points.
pub(crate) fn check_positions(points: usize, q: &[f64]) -> Result<(), CollisionError> {
    if q.len() < 3 * points {
        let (found, expected) = (q.len(), 3 * points);
        return Err(CollisionError::Length {
            what: "positions",
            found,
            expected,
        });
    }
    match q[..3 * points].iter().position(|c| !c.is_finite()) {
        Some(i) => Err(CollisionError::NotFinitePosition { point: i / 3 }),
        None => Ok(()),
    }
}
