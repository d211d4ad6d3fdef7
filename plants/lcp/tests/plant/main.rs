//! Tests of the plant through its public interface: accuracy, invariants of any motion, and edge
//! cases, which must end in a typed error, a fault with time and cause, or the correct result;
//! never in NaN, a hang, or a plausible but wrong trajectory.

mod accuracy;
mod allocation;
mod compliant_events;
mod compliant_peer;
mod compliant_refusal;
mod fallback;
mod geometry;
mod harness;
mod landing;
mod motors;
mod properties;
mod resume_from;
mod servos;
mod springs;
mod stability;
mod stops;
mod trajectories;
mod work;
