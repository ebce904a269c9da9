//! Persistent contacts: compression and friction.

mod chain;
mod common;
mod compression;
mod friction;
