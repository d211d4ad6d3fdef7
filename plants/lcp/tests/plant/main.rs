//! The plant as others see it: how exact it is, what must hold of any motion, and what it does at the edges, where it gives a
//! typed error, a fault that says when and why, or the right outcome; never a number that is none, never a hang, and never a
//! curve that only looks right.

mod accuracy;
mod allocation;
mod fallback;
mod geometry;
mod landing;
mod motors;
mod properties;
mod resume_from;
mod scene;
mod springs;
mod stability;
mod stops;
mod trot;
mod work;
