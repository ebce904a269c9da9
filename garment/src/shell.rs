//! Handing a garment's mesh to the shell model.

use crate::{GarmentError, GarmentMesh};
use selvedge_shell_model::ShellMesh;

impl GarmentMesh {
    /// The mesh for the shell model, with the fabric of each panel (by its
    /// index in [`GarmentMesh::panels`]). Positions stay here:
    /// [`GarmentMesh::points_initial`], or those of [`crate::preassemble`].
    ///
    /// # Errors
    /// [`GarmentError::Shell`] when the shell model refuses the mesh.
    pub fn to_shell_mesh(
        &self,
        fabric_of_panel: impl Fn(usize) -> u16,
    ) -> Result<ShellMesh, GarmentError> {
        let fabric = self
            .panel_of_triangle
            .iter()
            .map(|&p| fabric_of_panel(p as usize))
            .collect();
        Ok(ShellMesh::new(
            self.points_initial.len(),
            self.triangles.clone(),
            self.material.clone(),
            fabric,
        )?)
    }
}
