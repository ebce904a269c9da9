//! Triangle shells: meshes, fabrics, membrane, bending, damping, seams and trims

pub mod fabric;
