//! Start positions with a little noise, to find out what a scene makes of it.

use super::BuiltScene;
use super::geometry::Noise;

impl BuiltScene {
    /// Moves every point of the cloth at the start by a random displacement of
    /// standard deviation `size` \[m\] along each axis. The same seed gives the
    /// same displacements, whatever the order of the points in memory.
    pub fn perturb(&mut self, size: f64, seed: u64) {
        let mut noise = Noise(seed);
        let g = &mut self.geometry;
        for new in &g.order.new_of_old {
            for x in &mut g.positions[*new as usize] {
                *x += size * noise.normal();
            }
        }
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
