//! Energies and inertia of yarn networks.

mod charts;
mod common;
mod derivatives;
mod golden;
mod inertia;
mod limits;
mod rest;
mod wrapping;
