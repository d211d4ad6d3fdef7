//! Byte transports with their timing.

mod arrivals;
mod line;
mod node;

pub use arrivals::{Arrivals, Piece};
pub use line::Line;
pub use node::Node;
