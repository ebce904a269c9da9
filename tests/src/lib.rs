//! Cross-crate truth: analytic cases, determinism, effects-off-cost-nothing
