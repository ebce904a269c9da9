use crate::{Frame, RecordError, Recording, RunHeader};

/// Triangles around what was recorded, for cloth that has none of its own.
pub trait Skin {
    /// Number of vertices.
    fn points(&self) -> usize;
    /// Triangles, the same in every frame.
    fn triangles(&self) -> &[[u32; 3]];
    /// Panel of each triangle; may be empty.
    fn panels(&self) -> &[u16];
    /// Coordinates of the vertices, three a vertex \[m\], for the recorded
    /// points.
    fn positions(&self, recorded: &[f64]) -> Vec<f64>;
}

/// A recording as it is exported: with its own triangles or in a skin.
pub(super) struct Shown<'a> {
    recording: &'a Recording,
    skin: Option<(&'a dyn Skin, RunHeader)>,
}

impl<'a> Shown<'a> {
    pub fn new(recording: &'a Recording, skin: Option<&'a dyn Skin>) -> Self {
        let header = recording.header();
        let dressed = |skin: &'a dyn Skin| {
            let header = RunHeader {
                scene_name: header.scene_name.clone(),
                version: header.version.clone(),
                points: skin.points(),
                triangles: skin.triangles().to_vec(),
                panels: skin.panels().to_vec(),
                panel_names: header.panel_names.clone(),
                bodies: header.bodies.clone(),
                ..RunHeader::default()
            };
            (skin, header)
        };
        Self {
            recording,
            skin: skin.map(dressed),
        }
    }

    pub fn header(&self) -> &RunHeader {
        self.skin
            .as_ref()
            .map_or_else(|| self.recording.header(), |(_, header)| header)
    }

    pub fn time(&self, index: usize) -> f64 {
        self.recording.frames()[index].time
    }

    pub fn frame(&self, index: usize) -> Result<Frame, RecordError> {
        let mut frame = self.recording.frame(index)?;
        if let Some((skin, _)) = &self.skin {
            frame.positions =
                skin.positions(&frame.positions[..3 * self.recording.header().points]);
        }
        Ok(frame)
    }
}
