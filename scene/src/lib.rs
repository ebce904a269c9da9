//! Scene files, validation, effect planning and the run driver
