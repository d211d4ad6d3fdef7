//! Studies: builders of their plants and rigs, and their tables for the terminal.

pub(crate) mod builder;
pub(crate) mod coupling_builder;
pub(crate) mod coupling_table;
pub(crate) mod estimate_table;
mod lines;
pub(crate) mod load_recorder;
mod scaled;
mod selection;
pub(crate) mod table;
