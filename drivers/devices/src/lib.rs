//! Serial devices of a robot, each with its frames, the driver that runs on the robot's computer, and
//! an emulated board or sensor at the other end of the wire, in a module of its own.

pub mod optoforce;
pub mod phidget;
pub mod rb110;
