//! Build information.

/// Version and build, as `twin --version` prints them: the commit, the cargo features that select
/// parts, the target, and the profile `debug` or `release`.
pub(crate) const VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\ncommit    ",
    env!("TWINRIG_COMMIT"),
    "\nfeatures  ",
    env!("TWINRIG_FEATURES"),
    "\ntarget    ",
    env!("TWINRIG_TARGET"),
    "\nprofile   ",
    env!("TWINRIG_PROFILE"),
);

/// Profile of this build as cargo tells it: `debug`, or `release` for every other one.
pub(crate) const PROFILE: &str = env!("TWINRIG_PROFILE");
