//! Whole pieces of cloth in equilibrium against closed forms.

mod capstan;
mod statics;
mod weave;
