use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, PoisonError, RwLock};

/// A number that the owner of a running simulation may change between steps;
/// terms read it when a step begins.
#[derive(Clone, Debug)]
pub struct SharedScalar(Arc<AtomicU64>);

impl SharedScalar {
    /// A shared number.
    pub fn new(value: f64) -> Self {
        Self(Arc::new(AtomicU64::new(value.to_bits())))
    }

    /// Present value.
    pub fn get(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Acquire))
    }

    /// Changes the value from the next step on.
    pub fn set(&self, value: f64) {
        self.0.store(value.to_bits(), Ordering::Release);
    }
}

/// Target positions that the owner of a running simulation may move between
/// steps; terms read them when a step begins.
#[derive(Clone, Debug)]
pub struct SharedTargets(Arc<RwLock<Vec<[f64; 3]>>>);

impl SharedTargets {
    /// Shared targets \[m\].
    pub fn new(targets: Vec<[f64; 3]>) -> Self {
        Self(Arc::new(RwLock::new(targets)))
    }

    /// Number of targets.
    pub fn len(&self) -> usize {
        self.0.read().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Moves target `i` to `position` \[m\] from the next step on: where it will
    /// be at the end of that step.
    ///
    /// # Panics
    /// When there is no target `i`.
    pub fn set(&self, i: usize, position: [f64; 3]) {
        self.0.write().unwrap_or_else(PoisonError::into_inner)[i] = position;
    }

    /// Moves every target at once.
    pub fn update(&self, mut place: impl FnMut(usize, [f64; 3]) -> [f64; 3]) {
        let mut targets = self.0.write().unwrap_or_else(PoisonError::into_inner);
        for (i, target) in targets.iter_mut().enumerate() {
            *target = place(i, *target);
        }
    }

    /// Copies the targets.
    pub fn copy_to(&self, out: &mut Vec<[f64; 3]>) {
        out.clear();
        out.extend_from_slice(&self.0.read().unwrap_or_else(PoisonError::into_inner));
    }
}
