use crate::{CollisionError, CollisionMesh};

/// Pairs of primitives that may come into contact, each once and in ascending
/// order: the list depends on positions and reach alone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Candidates {
    /// `[vertex, triangle]`
    pub vertex_triangle: Vec<[u32; 2]>,
    /// `[edge, edge]`, the lower one first.
    pub edge_edge: Vec<[u32; 2]>,
    /// At most the distance of every pair at the start \[m\], those of vertices and
    /// triangles first; empty where the back-end does not tell.
    pub least: Vec<f32>,
}

impl Candidates {
    /// Number of pairs.
    pub fn len(&self) -> usize {
        self.vertex_triangle.len() + self.edge_edge.len()
    }

    /// Whether there is no pair.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Removes all pairs and keeps the memory.
    pub fn clear(&mut self) {
        self.vertex_triangle.clear();
        self.edge_edge.clear();
        self.least.clear();
    }
}

/// Finds candidate pairs of a moving mesh, and bounds how far it may move.
pub trait CollisionBackend: Send {
    /// Name in reports.
    fn name(&self) -> &str;

    /// Replaces `out` by the pairs that may come within `reach` \[m\] of each
    /// other while every point stays in the box spanned by its positions in
    /// `q_start` and `q_end`. No such pair is missing, none is excluded by the
    /// mesh; pairs that stay farther apart may be among them.
    ///
    /// # Errors
    /// [`CollisionError::NotFinitePosition`], [`CollisionError::Length`] when
    /// a position array is too short, [`CollisionError::Parameter`] for a
    /// reach that is negative or not finite.
    fn detect(
        &mut self,
        mesh: &CollisionMesh,
        q_start: &[f64],
        q_end: &[f64],
        reach: f64,
        out: &mut Candidates,
    ) -> Result<(), CollisionError>;

    /// Largest fraction of the way from `q_start` to `q_end` that is free of
    /// crossings. Back-ends without continuous detection allow all of it.
    ///
    /// # Errors
    /// Those of the back-end; the default has none.
    fn max_step(
        &mut self,
        _mesh: &CollisionMesh,
        _q_start: &[f64],
        _q_end: &[f64],
        _candidates: &Candidates,
    ) -> Result<f64, CollisionError> {
        Ok(1.0)
    }

    /// Heap memory held \[bytes\].
    fn heap_bytes(&self) -> usize {
        0
    }
}
