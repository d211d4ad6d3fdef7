//! MuJoCo plants. [`Mujoco`] simulates the robots with the ports, initial states and refusals of
//! the other plants and with the model of the full plant (`twinrig-lcp`), solved by a third-party
//! engine. [`Engine`] runs any MuJoCo model.
//!
//! ```no_run
//! # // Not run: doctests do not find MuJoCo's library; `src/tests/plant` does the same and more.
//! use std::path::Path;
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, StartPose};
//! use twinrig_mujoco::{Coordinates, Mujoco, Options};
//! use twinrig_robot::RobotFile;
//! use twinrig_runtime::Plant;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = RobotFile::find("cheetah-cub", Path::new(""))?.robot()?;
//! let setup = Setup {
//!     base: Base::Fixed,
//!     legs: vec!["LF".to_owned()],
//!     ground: None,
//!     step: SimDuration::from_millis(1),
//!     drives: Drives::None,
//!     abduction: Abduction::Locked,
//!     contacts: Contacts::Feet,
//!     set_point: SetPoint::Held,
//!     start: StartPose { q: [0.2, -0.2, 0.25], rates: [0.0; 3] }.into(),
//! };
//! let mut plant = Mujoco::new(&robot, &Options::new(setup, Coordinates::Maximal), &|_| true)?;
//! plant.advance(SimTime::ZERO + SimDuration::from_millis(100), &[])?;
//! assert!(plant.constraint_violation().unwrap() < 1e-3); // pins and stops
//! # Ok(())
//! # }
//! ```
//!
//! # The model
//!
//! [`mjcf()`] writes the model as text, which can be read, changed and run elsewhere. In *maximal*
//! coordinates every segment is a free body in the plane of its leg, with two slides and a hinge
//! from the trunk (a thin rod has no axial inertia, so that six degrees of freedom would be
//! singular): 36 degrees of freedom for four legs, and pins that connect them. In *minimal*
//! coordinates legs are chains of hinges. In both, the rods of the pantograph are massless springs,
//! and stops are limits of joints or of lengths. A cable has two branches, from hip to ankle and
//! from a pulley in the world to its anchor, whose sum is limited from above: it pulls and does not
//! push. Legs that abduct are carried by a body without mass, on a hinge along the trunk whose
//! range are the stops. A servo is a clutch between its joint and a heavy flywheel that turns at
//! the requested rate; the clutch slips at the torque that the servo has at its rate (thesis, eq.
//! 2.20). A motor is its torque, with its damping c as an inertia of h c/2, which makes it
//! implicit for constraints, too.
//!
//! # Settings
//!
//! `cargo run --release -p twinrig-mujoco --example constraints` measures error (root mean square
//! of the foot, against trajectories of `SciPy`) and cost (four legs, one core of a busy machine).
//! The light leg hits hard with light friction; `pins 1` is a damping ratio of the pins. Excerpts:
//!
//! | settings and step | between stops | rests on stops | hard hit | light leg | per step |
//! |---|---|---|---|---|---|
//! | minimal, rk4, 2 ms | 9.0e-6 m | 2.4e-4 m | 6.6e-4 m | 1.8e-3 m | 44 µs |
//! | minimal, rk4, 0.5 ms | 3.4e-8 | 4.1e-5 | 1.3e-4 | 3.0e-4 | 50 µs |
//! | minimal, euler, 2 ms | 2.9e-4 | 2.2e-4 | 1.8e-3 | 1.3e-2 | 12 µs |
//! | maximal, euler, 2 ms | 1.9e-4 | 3.4e-4 | 1.6e-3 | 6.3e-2 | 27 µs |
//! | maximal, euler, 1 ms | 6.5e-5 | 1.0e-4 | 8.7e-4 | 3.7e-3 | 30 µs |
//! | maximal, implicitfast, 2 ms | 1.8e-4 | 6.6e-4 | 1.6e-2 | 6.0e-2 | 31 µs |
//! | maximal, rk4, 2 ms | 3.3e-5 | 3.2e-4 | 6.1e-4 | 1.1e-3 | 103 µs |
//! | maximal, discrete, 2 ms | 8.3e-4 | 3.0e-4 | 1.4e-2 | 1.1e-2 | 40 µs |
//! | maximal, euler, 2 ms, solimp 0.9999, pins 1 | 2.1e-4 | 2.6e-4 | 2.0e-3 | diverges | 29 µs |
//! | maximal, euler, 2 ms, solimp 0.99, pins 1 | 2.5e-4 | 1.6e-3 | 2.0e-3 | 1.1e-2 | 30 µs |
//! | maximal, euler, 2 ms, MuJoCo's defaults | 5.1e-3 | 5.5e-3 | 7.8e-3 | 6.6e-3 | 30 µs |
//! | maximal, euler, 0.1 ms, MuJoCo's defaults | 5.1e-3 | 5.5e-3 | 6.2e-3 | 6.3e-3 | 30 µs |
//!
//! - Constraints of MuJoCo's default softness (`solref`, `solimp`) leave an error of 5 mm at any
//!   step. A time constant of two steps and an impedance of 0.999, the defaults here, converge with
//!   the step.
//! - Pins with a damping ratio of 0.7, the default, instead of 1 correct their errors sooner:
//!   without stops 3.5e-4 m remain at 2 ms instead of 6.1e-4. With 0.5 they diverge where light
//!   legs hit hard.
//! - `implicitfast` makes joint friction implicit without its effect on the constraints; in maximal
//!   coordinates its pins are then less accurate than those of `euler`, which is the default there.
//!   `rk4` is the default in minimal coordinates.
//! - At 2 ms, light legs that hit hard have an error of 6 cm in maximal coordinates, and diverge
//!   with an impedance of 0.9999 or 0.998. With 0.99 they do not, but rest less accurately on their
//!   stops. The default step of the plant in scenarios is therefore 1 ms.
//! - Impacts take a step or two, in which a stop is exceeded by the motion of that time: errors
//!   there are of first order.
//!
//! # Feet
//!
//! MuJoCo's friction is the solution of a convex problem, in which a sliding foot is also lifted,
//! at µ times its sliding velocity at any step: it leaves the ground, falls back, and repeats this.
//! In gaits with sliding feet this counts footsteps twice. Forces on sliding feet are therefore
//! computed again, with the normal reference reduced by as much, until they obey Coulomb's law
//! ([`Numerics::sliding_rounds`]; with none, forces are MuJoCo's). Under a robot that slides at 0.5
//! m/s on µ = 0.2, feet then stay within 10 µm of the ground at steps of 2 ms; without, they leave
//! it by 0.6 mm. With pyramidal cones friction is MuJoCo's own.
//!
//! A foot that lands penetrates the ground by its motion in a step, and is pushed out at up to a
//! quarter of its velocity ([`Numerics::contact_damping`] reduces that velocity and prolongs the
//! penetration).
//!
//! # Limits
//!
//! Not modelled: the toe joint; restitution, which MuJoCo's contacts do not have (refused);
//! instants of events, which MuJoCo does not locate. Ground heights are flat in triangles between
//! samples and end with the field; a foot beyond it is a fault. Warnings of MuJoCo are an
//! [`EngineFault`]; those of singular inertia and of lack of memory MuJoCo also writes to standard
//! error and to `MUJOCO_LOG.TXT`.
#![doc = include_str!("../README.md")]

// Tests name the library as its users do.
#[cfg(test)]
extern crate self as twinrig_mujoco;

mod addresses;
mod body_points;
mod drives;
mod engine;
mod flow;
mod frame;
#[cfg(test)]
mod free_tests;
mod inputs;
mod leg_forces;
mod mjcf;
mod model;
pub mod model_file;
mod options;
mod plant;
mod powers;
mod push_load;
mod pushed;
mod rates;
mod readings;
mod sliding;
mod stages;
mod step_only;
#[cfg(test)]
mod tests;

pub use engine::{Engine, EngineError, EngineFault, EngineWarning};
pub use mjcf::mjcf;
/// The wrapper crate of the engine.
pub use mujoco_rs;
pub use options::{
    Cone, Coordinates, Integrator, MujocoError, Numerics, Options, Solver, TimeConstant,
};
pub use plant::Mujoco;
