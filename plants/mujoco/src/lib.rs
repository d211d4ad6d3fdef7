//! The robot in MuJoCo, as other plants have it: the same ports, starts and refusals, and the same model as the full plant's
//! (`twinrig-lcp`), solved by an engine that is not ours. And an [`Engine`] for whatever else is to run in MuJoCo.
//!
//! ```no_run
//! # // Programs of the documentation lie where they do not find MuJoCo's library; `tests/plant` does the same and more.
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_legged::{Base, Drives, Setup, StartPose};
//! use twinrig_mujoco::{Coordinates, Mujoco, Options};
//! use twinrig_robot::RobotFile;
//! use twinrig_runtime::Plant;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = include_str!("../../../robots/cheetah-cub.toml");
//! let robot = RobotFile::parse("cheetah-cub.toml", text)?.robot()?;
//! let setup = Setup {
//!     base: Base::Fixed,
//!     legs: vec!["LF".to_owned()],
//!     ground: None,
//!     step: SimDuration::from_millis(1),
//!     drives: Drives::None,
//!     start: StartPose { q: [0.2, -0.2, 0.25], rates: [0.0; 3] }.into(),
//! };
//! let mut plant = Mujoco::new(&robot, &Options::new(setup, Coordinates::Maximal), &|_| true)?;
//! plant.advance(SimTime::ZERO + SimDuration::from_millis(100), &[])?;
//! assert!(plant.constraint_violation().unwrap() < 1e-3); // its pins and stops are closed
//! # Ok(())
//! # }
//! ```
//!
//! # The model
//!
//! [`mjcf`] writes it, so that it can be read, changed and run elsewhere. In *maximal* coordinates every segment is a body that
//! moves freely in the plane of its leg, by two slides and a hinge from the trunk (a thin rod has no inertia about itself, so
//! one with six degrees of freedom would be singular): 36 for four legs, and pins that hold them together. In *minimal*
//! coordinates legs are chains of hinges. The rods of the pantograph are springs without mass either way; stops are limits of
//! joints or of lengths. A cable has two branches, from hip to ankle and from a pulley in the world to its anchor, whose sum is
//! limited from above: it pulls and does not push. A servo is a clutch between its joint and a heavy wheel that turns as the servo
//! wants; the clutch gives way at the torque that the servo has at its rate (thesis, eq. 2.20). A motor is its torque, with
//! what damps it as an inertia of h c/2, which makes it implicit for constraints, too.
//!
//! # Settings
//!
//! `cargo run --release -p twinrig-mujoco --example constraints` measures error (root of the mean square of the foot, against
//! trajectories of `SciPy`) and cost (four legs, one core of a busy machine). Excerpts:
//!
//! | coordinates, integrator, step | between stops | rests on stops | hits hard | hits hard, light friction | a step |
//! |---|---|---|---|---|---|
//! | minimal, rk4, 2 ms | 9.0e-6 m | 2.4e-4 m | 6.6e-4 m | 1.8e-3 m | 44 µs |
//! | minimal, rk4, 0.5 ms | 3.4e-8 | 4.1e-5 | 1.3e-4 | 3.0e-4 | 50 µs |
//! | minimal, euler, 2 ms | 2.9e-4 | 2.2e-4 | 1.8e-3 | 1.3e-2 | 12 µs |
//! | maximal, euler, 2 ms | 1.9e-4 | 3.4e-4 | 1.6e-3 | 6.3e-2 | 27 µs |
//! | maximal, euler, 1 ms | 6.5e-5 | 1.0e-4 | 8.7e-4 | 3.7e-3 | 30 µs |
//! | maximal, implicitfast, 2 ms | 1.8e-4 | 6.6e-4 | 1.6e-2 | 6.0e-2 | 31 µs |
//! | maximal, rk4, 2 ms | 3.3e-5 | 3.2e-4 | 6.1e-4 | 1.1e-3 | 103 µs |
//! | maximal, discrete, 2 ms | 8.3e-4 | 3.0e-4 | 1.4e-2 | 1.1e-2 | 40 µs |
//! | maximal, euler, 2 ms, solimp 0.9999, pins damped by 1 | 2.1e-4 | 2.6e-4 | 2.0e-3 | runs away | 29 µs |
//! | maximal, euler, 2 ms, solimp 0.99, pins damped by 1 | 2.5e-4 | 1.6e-3 | 2.0e-3 | 1.1e-2 | 30 µs |
//! | maximal, euler, 2 ms, MuJoCo's solref and solimp | 5.1e-3 | 5.5e-3 | 7.8e-3 | 6.6e-3 | 30 µs |
//! | maximal, euler, 0.1 ms, MuJoCo's solref and solimp | 5.1e-3 | 5.5e-3 | 6.2e-3 | 6.3e-3 | 30 µs |
//!
//! - Constraints as soft as MuJoCo has them leave 5 mm whatever the step. A time constant of two steps and an impedance of
//!   0.999, the defaults here, converge with the step.
//! - Pins that are damped by 0.7 instead of 1 take their errors back sooner: without stops 3.5e-4 m are left at 2 ms instead of
//!   6.1e-4. Damped by 0.5, they run away where light legs hit hard.
//! - `implicitfast` makes friction of the joints implicit without telling the constraints; in maximal coordinates it then holds
//!   the pins worse than `euler`, which is the default there. `rk4` is the default in minimal coordinates.
//! - At 2 ms, light legs that hit hard are 6 cm off in maximal coordinates, and run away with an impedance of 0.9999 or 0.998. An
//!   impedance of 0.99 does not, and rests less well on its stops. The plant's own step in scenarios is therefore 1 ms.
//! - Impacts take a step or two, in which a stop is passed by what moves in that time: errors there are of first order.
//!
//! # Feet
//!
//! MuJoCo's friction is the solution of a convex problem, by which a foot that slides is also lifted, at µ times the velocity
//! that it slides at, whatever the step: it leaves the ground, falls back, and does so again. In gaits whose feet slide that is a
//! footstep counted twice. So forces are found again for feet that slide, with as much less asked for along the normal, until they
//! are those of Coulomb's law ([`Numerics::sliding_rounds`]; none leaves them as MuJoCo has them). Of a robot that slides at
//! 0.5 m/s on µ = 0.2, feet then stay within 10 µm of the ground at steps of 2 ms, and without it leave it by 0.6 mm. With
//! pyramidal cones friction is MuJoCo's own.
//!
//! A foot that lands sinks in by what it moves in a step, and is pushed out at up to a quarter of its velocity
//! ([`Numerics::contact_damping`] makes that less, at the price of feet that stay sunk in for longer).
//!
//! # What is not here
//!
//! The toe joint. Restitution, which MuJoCo's contacts do not have: refused. Instants of events, which MuJoCo does not find.
//! Ground heights are flat in triangles between samples and end where the field does, which is a fault. What MuJoCo warns of
//! is an [`EngineFault`]; of singular inertia and of lack of memory it also tells standard error and `MUJOCO_LOG.TXT` itself.

mod addresses;
mod drives;
mod engine;
mod flow;
mod frame;
#[cfg(test)]
mod free_tests;
mod leg_forces;
mod mjcf;
mod model;
pub mod model_file;
mod options;
mod plant;
mod rates;
mod readings;
mod sliding;
mod stages;

pub use engine::{Engine, EngineError, EngineFault, EngineWarning};
pub use mjcf::mjcf;
/// The crate that the engine is reached through.
pub use mujoco_rs;
pub use options::{Closing, Cone, Coordinates, Integrator, MujocoError, Numerics, Options, Solver};
pub use plant::Mujoco;
