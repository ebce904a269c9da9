use selvedge_linsolve::Real;

use crate::PlanError;
use crate::sink::Shared;

/// How threads share the arrays that they scatter into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scatter {
    /// Chunks of stencils that share a point never run together: plain writes,
    /// same bits for any number of threads.
    #[default]
    Coloured,
    /// All chunks at once with atomic additions. The order of the sums depends
    /// on the threads; kept as a baseline.
    Atomics,
}

/// Settings of the assembly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AssemblyOptions {
    /// Scatter method.
    pub scatter: Scatter,
    /// Stencils in a chunk, the unit of parallel work, at least; a term has
    /// 48 chunks at most, since longer ones find more of what they write to in
    /// the cache.
    pub chunk: usize,
}

impl Default for AssemblyOptions {
    fn default() -> Self {
        Self {
            scatter: Scatter::Coloured,
            chunk: 128,
        }
    }
}

impl AssemblyOptions {
    /// Whether nobody else writes: one thread that need not show what atomics
    /// cost.
    pub(super) fn alone(&self) -> bool {
        self.scatter == Scatter::Coloured && rayon::current_num_threads() == 1
    }

    pub(super) fn shared<'a, T: Real>(&self, values: &'a mut [T]) -> Shared<'a, T> {
        Shared::new(values, self.scatter == Scatter::Atomics)
    }

    pub(super) fn validate(&self) -> Result<(), PlanError> {
        if self.chunk == 0 {
            return Err(PlanError::Setting {
                name: "chunk",
                value: 0.0,
                allowed: "at least 1",
            });
        }
        Ok(())
    }
}
