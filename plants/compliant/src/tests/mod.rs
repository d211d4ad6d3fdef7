//! Laws of elements and soles.

mod laws;
mod passivity;
