//! Numbering of points.

use crate::Pattern;
use sprs::CsMatViewI;

/// A renumbering and its inverse.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Permutation {
    /// New number of each old point.
    pub new_of_old: Vec<u32>,
    /// Old number of each new point.
    pub old_of_new: Vec<u32>,
}

impl Permutation {
    /// Every point keeps its number.
    pub fn identity(points: usize) -> Self {
        let all: Vec<u32> = (0..points as u32).collect();
        Self {
            new_of_old: all.clone(),
            old_of_new: all,
        }
    }

    /// From the old number of each new point; `None` unless each occurs once.
    pub fn from_old_of_new(old_of_new: Vec<u32>) -> Option<Self> {
        let mut new_of_old = vec![u32::MAX; old_of_new.len()];
        for (new, &old) in old_of_new.iter().enumerate() {
            let slot = new_of_old.get_mut(old as usize)?;
            if *slot != u32::MAX {
                return None;
            }
            *slot = new as u32;
        }
        Some(Self {
            new_of_old,
            old_of_new,
        })
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.new_of_old.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.new_of_old.is_empty()
    }

    /// Reorders per-point data from the old to the new numbering.
    ///
    /// # Panics
    /// If the length differs from the number of points.
    pub fn to_new<V: Copy>(&self, old: &[V]) -> Vec<V> {
        assert_eq!(old.len(), self.len(), "one value for each point");
        self.old_of_new.iter().map(|&i| old[i as usize]).collect()
    }

    /// Reorders per-point data from the new to the old numbering.
    ///
    /// # Panics
    /// If the length differs from the number of points.
    pub fn to_old<V: Copy>(&self, new: &[V]) -> Vec<V> {
        assert_eq!(new.len(), self.len(), "one value for each point");
        self.new_of_old.iter().map(|&i| new[i as usize]).collect()
    }

    /// Renumbers the points named in a stencil.
    pub fn relabel(&self, nodes: &mut [u32]) {
        for n in nodes {
            *n = self.new_of_old[*n as usize];
        }
    }

    /// [`Pattern::bandwidth`] that a pattern would have after renumbering.
    pub fn bandwidth(&self, pattern: &Pattern) -> usize {
        (0..pattern.points())
            .flat_map(|i| pattern.columns(i).iter().map(move |&j| (i, j)))
            .map(|(i, j)| self.new_of_old[i].abs_diff(self.new_of_old[j as usize]) as usize)
            .max()
            .unwrap_or(0)
    }
}

/// Reverse Cuthill–McKee numbering: neighbours get close numbers, so the
/// product reads its vector from cache \[CuthillMcKee1969\].
pub fn reverse_cuthill_mckee(pattern: &Pattern) -> Permutation {
    let n = pattern.points();
    if n == 0 {
        return Permutation::identity(0);
    }
    let values = vec![0u8; pattern.block_count()];
    let view =
        CsMatViewI::<u8, u32, u32>::new((n, n), pattern.offsets(), pattern.all_columns(), &values);
    let ordering = sprs::linalg::reverse_cuthill_mckee(view);
    // `vec()[new] = old`
    let old_of_new = ordering.perm.vec();
    Permutation::from_old_of_new(old_of_new).unwrap_or_else(|| Permutation::identity(n))
}
