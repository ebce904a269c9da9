//! Start positions with a little noise, to find out what a scene makes of it.

use selvedge_integrator::State;

use super::BuiltScene;
use crate::random::SplitMix;

impl BuiltScene {
    /// Moves every point of the cloth at the start by a random displacement of
    /// standard deviation `size` \[m\] along each axis. The same seed gives the
    /// same displacements, whatever the order of the points in memory. A
    /// garment is displaced when it has been wrapped around its body, which
    /// begins from its panels and not from positions.
    pub fn perturb(&mut self, size: f64, seed: u64) {
        self.perturbation = Some((size, seed));
        let displacements = self.displacements();
        for (x, d) in self.geometry.positions.iter_mut().zip(displacements) {
            for (x, d) in x.iter_mut().zip(d) {
                *x += d;
            }
        }
    }

    /// With garments displaced as those of `other`.
    pub(crate) fn displaced_like(mut self, other: &Self) -> Self {
        self.perturbation = other.perturbation;
        self
    }

    /// Displaces the points of garments, as [`Self::perturb`] was asked to.
    pub(crate) fn perturb_garments(&self, state: &mut State) {
        let displacements = self.displacements();
        if displacements.is_empty() {
            return;
        }
        let g = &self.geometry;
        let (x, _) = state.q.as_chunks_mut::<3>();
        for part in g.parts.iter().filter(|p| p.garment.is_some()) {
            for k in part.points.clone() {
                let k = g.order.new_of_old[k as usize] as usize;
                for (x, d) in x[k].iter_mut().zip(displacements[k]) {
                    *x += d;
                }
            }
        }
    }

    /// In the solver's order \[m\]; empty without a perturbation.
    fn displacements(&self) -> Vec<[f64; 3]> {
        let Some((size, seed)) = self.perturbation else {
            return Vec::new();
        };
        let mut noise = SplitMix(seed);
        let order = &self.geometry.order.new_of_old;
        let mut out = vec![[0.0; 3]; order.len()];
        for new in order {
            out[*new as usize] = [(); 3].map(|()| size * noise.normal());
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::file;

    fn start(reorder: &str, seed: u64) -> Vec<[f64; 3]> {
        let text = "[[cloth]]\nsize = [0.1, 0.1]\npoints = [5, 5]\n";
        let set = [("assembly.reorder".to_owned(), reorder.to_owned())];
        let parsed = file::parse(text, Path::new("sheet.toml"), &set).unwrap();
        let mut built = BuiltScene::new(parsed).unwrap();
        built.perturb(1e-9, seed);
        built.geometry.to_scene(&built.geometry.positions)
    }

    /// Small, seeded, and the same in every numbering.
    #[test]
    fn displacements_follow_the_seed_alone() {
        let a = start("none", 1);
        assert_eq!(a, start("rcm", 1));
        let b = start("none", 2);
        let distance = |(a, b): (&[f64; 3], &[f64; 3])| {
            (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max)
        };
        let largest = a.iter().zip(&b).map(distance).fold(0.0, f64::max);
        assert!(largest > 1e-10 && largest < 1.2e-8, "{largest}");
    }
}
