//! The plant as a whole.

mod passive;
mod scene;
