//! Yarn-level cloth: networks of woven and knitted yarns whose contacts persist
//! and slide, and the energies on them.
//!
//! A [`YarnNetwork`] is built from a construction (a weave draft, a stitch
//! chart), not from a mesh. Its unknowns are one point for every node and one
//! arc length for every *strand*, a yarn's passage through a node
//! [Cirio2014, Cirio2017].

pub mod chart;
mod compose;
mod contact;
mod damping;
mod error;
mod force;
pub mod knit;
mod material;
mod network;
pub mod panel;
pub mod topology;
mod tube;
mod vec3;
mod weave;

pub use contact::{
    Compression, CompressionSettings, FrictionSettings, SlidingFriction, StackRule, StickRule,
    TensionRule, plane_normal, stack_compression,
};
pub use damping::{RayleighDamping, segment_damping, stencil_damping};
pub use error::YarnError;
pub use force::{
    CROSSED, InertiaForce, JAM_ANGLE, JAM_WIDTH, JammingBending, LEAST_MATERIAL, Locked,
    LockedBending, LockedGravity, LockedInertia, LockedStretch, ParallelYarns, PlainBending,
    SegmentInertia, StitchLength, StitchWrapping, WrapElement, WrapPair, YarnBending, YarnGravity,
    YarnShear, YarnStretch, lumped_point_masses, lumped_scalar_masses,
};
pub use material::YarnMaterial;
pub use network::{
    Crossing, NONE, NetworkBuilder, NodeContact, StitchContact, Strand, Visit, Yarn, YarnNetwork,
};
pub use tube::{StrandPaths, TubeMesh, Tubes, strand_centres};
pub use weave::{Draft, Family, WeaveError, Woven};
