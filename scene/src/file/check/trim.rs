//! Buttons and buttonholes.

use super::super::model::ClothShape;
use super::Check;

impl Check<'_> {
    pub(super) fn trims(&mut self) {
        let scene = self.scene;
        let buttons: Vec<&str> = scene.button.iter().map(|b| b.name.as_str()).collect();
        for (i, b) in scene.button.iter().enumerate() {
            self.place(&format!("button.{i}"), &b.cloth, b.panel.as_deref());
        }
        for (i, hole) in scene.buttonhole.iter().enumerate() {
            let path = format!("buttonhole.{i}");
            self.reference(&format!("{path}.button"), "button", &hole.button, &buttons);
            self.place(&path, &hole.cloth, hole.panel.as_deref());
        }
        self.distinct("button", buttons);
    }

    /// A cloth that has coordinates of its own, and a panel where it has any.
    fn place(&mut self, path: &str, cloth: &str, panel: Option<&str>) {
        let scene = self.scene;
        let cloths: Vec<&str> = scene.cloth.iter().map(|c| c.name.as_str()).collect();
        let at = |key: &str| format!("{path}.{key}");
        self.reference(&at("cloth"), "cloth", cloth, &cloths);
        let Some(shape) = scene.cloth.iter().find(|c| c.name == cloth) else {
            return;
        };
        match (&shape.shape, panel) {
            (ClothShape::Mesh { .. }, _) => self.error(
                "scene::trim",
                &at("cloth"),
                format!("`{path}`: cloth {cloth:?} is a mesh, which has no coordinates of its own"),
                "put it on a sheet or on a panel of a pattern",
            ),
            (ClothShape::Sheet { .. }, Some(_)) => self.error(
                "scene::trim",
                &at("panel"),
                format!("`{}`: a sheet has no panels", at("panel")),
                "leave it out",
            ),
            _ => {}
        }
    }
}
