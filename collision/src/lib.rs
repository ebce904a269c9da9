//! Broad and narrow phase, bodies, contact and friction potentials
