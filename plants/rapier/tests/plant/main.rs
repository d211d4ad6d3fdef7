//! The plant as a whole.

mod cuts;
mod drives;
mod energy;
mod errors;
mod faults;
mod ground;
mod passive;
mod restore;
mod scene;
mod starts;
