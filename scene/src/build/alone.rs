//! A piece of cloth taken out of its scene, to be simulated on its own.

use std::fs;
use std::io;
use std::path::Path;

use crate::diagnostic::Diagnostics;
use crate::file::model::Cloth;
use crate::file::{Parsed, SceneFile};

/// The scene with one piece of cloth and nothing that holds it, after changes.
pub(super) fn alone(parsed: &Parsed, cloth: Cloth, change: impl FnOnce(&mut SceneFile)) -> Parsed {
    let mut alone = parsed.clone();
    alone.warnings = Diagnostics::new();
    let scene = &mut alone.scene;
    scene.cloth = vec![cloth];
    scene.pin.clear();
    scene.attachment.clear();
    scene.button.clear();
    scene.buttonhole.clear();
    scene.stop.early = false;
    scene.output.recording = false;
    change(scene);
    alone
}

/// Puts numbers under a key of the cache; what cannot be stored is computed
/// again the next time.
pub(super) fn store(path: &Path, numbers: &[f64]) -> io::Result<()> {
    let mut bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend(blake3::hash(&bytes).as_bytes());
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    let temporary = path.with_extension(format!("{}.tmp", std::process::id()));
    fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path))
}

/// Numbers under a key of the cache, if they are there and whole.
pub(super) fn load(path: &Path) -> Option<Vec<f64>> {
    let bytes = fs::read(path).ok()?;
    let (content, sum) = bytes.split_last_chunk::<32>()?;
    if blake3::hash(content) != blake3::Hash::from_bytes(*sum) {
        return None;
    }
    let (numbers, rest) = content.as_chunks::<8>();
    let numbers = numbers.iter().map(|b| f64::from_le_bytes(*b));
    rest.is_empty().then(|| numbers.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers come back to the bit; a damaged entry does not come back.
    #[test]
    fn numbers_are_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("cache").join("key.loops");
        assert!(load(&path).is_none());
        let numbers = [1.0 / 3.0, -0.0, 1e-300, 4.0];
        store(&path, &numbers).expect("stored");
        let back = load(&path).expect("loaded");
        assert!(
            back.iter()
                .zip(&numbers)
                .all(|(a, b)| a.to_bits() == b.to_bits())
        );
        let mut bytes = fs::read(&path).expect("read");
        bytes[3] ^= 1;
        fs::write(&path, bytes).expect("written");
        assert!(load(&path).is_none());
    }
}
