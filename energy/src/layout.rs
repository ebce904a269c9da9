/// Number of points (three unknowns each) and scalars (one each).
///
/// The flat order is `x_0 y_0 z_0 x_1 … z_{points-1} s_0 … s_{scalars-1}`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DofLayout {
    /// Number of points.
    pub points: usize,
    /// Number of scalar unknowns.
    pub scalars: usize,
}

impl DofLayout {
    /// A layout of points alone.
    pub const fn points(points: usize) -> Self {
        Self { points, scalars: 0 }
    }

    /// Number of unknowns, `3 points + scalars`.
    pub const fn dim(&self) -> usize {
        3 * self.points + self.scalars
    }

    /// First flat index of a node: a point if `node_dim` is 3, else a scalar.
    #[inline]
    pub const fn offset(&self, node: u32, node_dim: usize) -> usize {
        if node_dim == 3 {
            3 * node as usize
        } else {
            3 * self.points + node as usize
        }
    }
}

/// Where an energy is evaluated: the unknowns at the end of a step, those at
/// its start, and its length. Rates are `(q - q_start) / dt`, which makes
/// backward Euler's velocity exact.
#[derive(Clone, Copy, Debug)]
pub struct EvalPoint<'a> {
    /// Shape of `q` and `q_start`.
    pub layout: DofLayout,
    /// Unknowns at the end of the step [m].
    pub q: &'a [f64],
    /// Unknowns at the start of the step [m].
    pub q_start: &'a [f64],
    /// Length of the step [s], positive.
    pub dt: f64,
}

impl<'a> EvalPoint<'a> {
    /// Position of point `i` at the end of the step [m].
    #[inline]
    pub fn point(&self, i: u32) -> [f64; 3] {
        let o = 3 * i as usize;
        [self.q[o], self.q[o + 1], self.q[o + 2]]
    }

    /// Position of point `i` at the start of the step [m].
    #[inline]
    pub fn point_start(&self, i: u32) -> [f64; 3] {
        let o = 3 * i as usize;
        [self.q_start[o], self.q_start[o + 1], self.q_start[o + 2]]
    }

    /// Unknowns of one stencil, gathered from `q`.
    #[inline]
    pub fn gather<const N: usize, const M: usize>(
        &self,
        dims: &[usize; N],
        nodes: &[u32; N],
    ) -> [f64; M] {
        gather(self.layout, self.q, dims, nodes)
    }

    /// Unknowns of one stencil, gathered from `q_start`.
    #[inline]
    pub fn gather_start<const N: usize, const M: usize>(
        &self,
        dims: &[usize; N],
        nodes: &[u32; N],
    ) -> [f64; M] {
        gather(self.layout, self.q_start, dims, nodes)
    }
}

#[inline]
fn gather<const N: usize, const M: usize>(
    layout: DofLayout,
    q: &[f64],
    dims: &[usize; N],
    nodes: &[u32; N],
) -> [f64; M] {
    let mut local = [0.0; M];
    let mut at = 0;
    for n in 0..N {
        let from = layout.offset(nodes[n], dims[n]);
        if dims[n] == 3 {
            local[at..at + 3].copy_from_slice(&q[from..from + 3]);
        } else {
            local[at] = q[from];
        }
        at += dims[n];
    }
    local
}
