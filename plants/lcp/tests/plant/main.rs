//! The plant as others see it: how exact it is, what must hold of any motion, and what it does at the edges.

mod accuracy;
mod allocation;
mod scene;
mod scratch;
mod trot;
mod work;
