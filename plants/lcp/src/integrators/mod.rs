//! Methods that advance the state of a run in time, between events or across them in steps of
//! fixed length. Each method is a type that owns its workspace and takes the model and the state of
//! the run. They use `model` and `constraints`.

mod error_norm;
pub(crate) mod euler;
pub(crate) mod event_driven;
pub(crate) mod impulse_sums;
mod jacobian;
mod lanewise;
pub(crate) mod moreau;
pub(crate) mod right_hand_side;
mod rk4;
mod rodas4;
mod root;
pub(crate) mod run_state;
pub(crate) mod step_error;
mod substep;
mod thesis;
