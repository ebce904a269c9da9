//! Scene plan, assembly, Newton, step control and stop rules
