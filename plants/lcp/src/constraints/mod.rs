//! Which constraints are active: the mode, the motion in it, the guards that end it, and impacts
//! and the choice of the next mode as complementarity problems. When these are computed is decided
//! by a method of integration. It uses `model`.

pub(crate) mod contact_forces;
pub(crate) mod contacts;
pub(crate) mod events;
pub(crate) mod guards;
pub(crate) mod log;
pub(crate) mod mode;
pub(crate) mod motion;
pub(crate) mod saturation;
pub(crate) mod workspace;
