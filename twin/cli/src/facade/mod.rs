//! Modules for crates with parts of their own, by the kind of part. Each names every type of the
//! signatures that such a part meets, so that `twinrig` is the only dependency of such a crate.

pub mod bus;
pub mod controller;
pub mod plant;
pub mod prelude;
pub mod robot;
#[cfg(feature = "testing")]
pub mod testing;
