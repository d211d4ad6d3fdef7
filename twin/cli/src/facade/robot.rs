//! Robots: their parameters, read from `robots/*.toml`, and the kinematics of their legs.
//!
//! ```
//! use std::path::Path;
//! use twinrig::robot::{Pantograph, Planar, RobotFile};
//!
//! let robot = RobotFile::find("cheetah-cub", Path::new("."))?.robot()?;
//! let leg = Pantograph::new(&robot.legs[0].leg)?;
//! let foot = leg.nearest_reachable(Planar::new(0.02, -0.13));
//! assert!(leg.inverse_closed(foot)?.knee > 0.0, "a bent knee winds up the cable");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[doc(inline)]
pub use twinrig_robot::leg::*;
#[doc(inline)]
pub use twinrig_robot::*;
