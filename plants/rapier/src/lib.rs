//! Rapier plant: the robot of `twinrig-lcp` in a rigid-body engine with an iterative constraint
//! solver (projected Gauss–Seidel).
//!
//! ```
//! use std::path::Path;
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, StartPose};
//! use twinrig_rapier::{Joints, Options, Rapier};
//! use twinrig_robot::RobotFile;
//! use twinrig_runtime::Plant;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = RobotFile::find("cheetah-cub", Path::new(""))?.robot()?;
//! // The legs hang from a fixed trunk, are released, and swing (thesis, section 2.5.1).
//! let (hip, knee) = (10_f64.to_radians(), -9.5_f64.to_radians());
//! let setup = Setup {
//!     base: Base::Fixed,
//!     legs: robot.legs.iter().map(|mount| mount.name.clone()).collect(),
//!     ground: None,
//!     step: SimDuration::from_millis(2),
//!     drives: Drives::None,
//!     abduction: Abduction::Locked,
//!     contacts: Contacts::Feet,
//!     set_point: SetPoint::Held,
//!     start: StartPose { q: [hip, knee, -knee], rates: [0.0; 3] }.into(),
//! };
//! let options = Options::new(setup, Joints::Impulse);
//! let mut plant = Rapier::new(&robot, &options, &|signal| signal == "leg/LF/foot/position")?;
//! plant.advance(SimTime::ZERO + SimDuration::from_millis(300), &[])?;
//! assert!(plant.constraint_violation().is_some_and(|open| open < 1e-4), "joints and stops hold");
//! # Ok(())
//! # }
//! ```
//!
//! # Model
//!
//! Trunk and segments are rigid bodies. Joints are impulses between bodies in maximal coordinates,
//! or a tree in joint coordinates ([`Joints`]). A segment is a thin rod, which has no axial moment
//! of inertia; here it has a twentieth of the transverse one ([`Options::AXIAL_SHARE`]), which has
//! no effect in the leg's plane.
//!
//! *Springs and joint friction* are external forces that this crate computes in each step: the
//! engine holds forces constant over its own substeps, with a hundred times the error of as many
//! steps.
//!
//! *Stops are ropes*, since ropes are the engine's only limits with look-ahead: an angle limit
//! becomes active only after it has been exceeded. The knee's stops are ropes across the knee. The
//! lower stop of the pantograph is a rope between two points that are l₂ apart where the pantograph
//! is closed and nearer where it is open; the upper one is the parallel rod itself. The cable's
//! length depends on the knee angle alone, so it is a rope across the knee, too, whose pull is
//! converted to the cable tension by virtual work. The attachment points do not affect the motion,
//! but they affect the convergence of the sweeps: with the ends of the diagonal as attachment
//! points, legs at rest on their stops had an error of 2.4 mm after a hundred. Between the links of
//! a tree the engine has no ropes; there, each is replaced by a limit along its line, set to be
//! taut exactly at the end of the step in which the rope becomes taut.
//!
//! *Drives*: the hip servo is a motor of the engine, the pulley a scalar state of this crate, and
//! rotors are dampers (`drives.rs`). All of [`Drives`](twinrig_legged::Drives) are supported. A
//! servo whose computed torque exceeds its limit saturates from the next step on.
//!
//! *Legs that abduct* have a carrier, on a hinge of the engine along the trunk; it has a hundredth
//! of the trunk's mass, which the trunk lacks. Only the inertia of abduction is greater by it, by
//! 1.5 % in Oncilla. All forces of abduction pass through this light body: feet of a hanging trot
//! leave the plane of their leg by 1.6 mm with 300 sweeps, by 0.1 mm with 3 000. The stops are
//! limits of the hinge, without look-ahead: a leg exceeds them by up to a step, and what brings it
//! back remains as a velocity (`abduction.rs`). The step in which it reaches one, and the next,
//! have as many sweeps as a landing. An ideal drive that jumps by 12° in a step moves feet off
//! their plane by centimetres, which ends the run: command servos.
//!
//! *Feet* are balls of 0.1 mm with the engine's friction and restitution. Each has its own ground
//! plane, the tangent plane of the terrain below it: terrain is smooth (`twinrig-contact`), while a
//! height field of triangles has edges and, at the required resolution, takes some 20 MB in every
//! snapshot. A step of the terrain is a lower plane, without the wall.
//!
//! # Settings
//!
//! `examples/settings.rs` measures them: root mean square errors of the foot in mm at 2 ms, against
//! a reference with an error below 1e-9 m.
//!
//! ```text
//!                                      passive  between  hard hit  undamped
//! impulse joints, 300 sweeps             0.025    0.159     0.597     1.352    the default
//!                 100 sweeps             0.028    0.159     0.583     1.333
//!                  10 sweeps             3.394    0.157     4.631     5.636
//!                 500 sweeps             0.025    0.159     0.597     1.352
//!  substeps 4 (of this crate)            0.006    0.011     0.038     0.105
//!  solver_iterations 4 (the engine's)    0.277    1.983     0.605     0.691
//!  stabilization_iterations 1            0.027    0.159     0.643     1.233
//!  joints of 300 Hz, damping ratio 1     4.853    0.870     5.230     6.607
//!  engine defaults                       7.334    2.202     6.621     fault
//! multibody joints, 20 sweeps            0.776    4.601     4.410     8.074
//!  engine defaults                       1.476  143.874     fault     fault
//! ```
//!
//! Joints and stops are as stiff as possible: softness only adds error. Position corrections keep
//! their velocity (no stabilization): the method is then the leapfrog with constraints, of second
//! order between events (`step.rs`), and a cable that is wound in moves the leg, where
//! stabilization would remove its velocity. The engine's warm start of joints (`warmstart_joints`)
//! is off: it applies the last impulse of each constraint immediately before it solves the same
//! constraint, which removes it again. Multibody joints have no gaps but lose more energy: the
//! engine's treatment of joint accelerations dissipates energy of a swing, also of second order.
//! They serve for comparison; use impulse joints.
//!
//! *Sweeps on the ground.* A hanging leg converges in 100 sweeps; a standing one closes a kinematic
//! chain, and `scenarios/walk.toml` needs 300 at 1 ms (with 200 a foot leaves the ground for a
//! moment and counts as two touch-downs). The impulse of a landing propagates through the whole leg
//! and its closed stops, so the step in which a foot lands, and the next, have 2 000
//! ([`Solver::landing_iterations`]). With 100, a leg that lands on its stops has an error of 37 mm
//! at any step; with 2 000, of 3.2 mm at 1 ms and 0.5 mm at 0.1 ms.
//!
//! *Ground.* Landings are most accurate on hard ground (1 MHz), on which the errors of landings
//! above are measured. However, earlier fast trots fell on it at 1 ms, and from a step of 20 mm,
//! and did not on ground of 400 Hz, the default, which yields by hundredths of a millimetre. The
//! cause of these falls is not known; fewer sweeps hid part of the effect. The present trots do not
//! fall on either: at 1 ms `scenarios/trot.toml` and `step-down.toml` run as in `twinrig-lcp`, and
//! `trot-fast.toml` keeps its speed but turns by 30 degrees in 15 s, on both grounds.
//!
//! *Load distribution.* Legs do not yield below their preload, nor do drives: the loads of four
//! such legs are statically indeterminate but for their sum, and the residual of the sweeps
//! decides. In `scenarios/stand.toml` a quarter of the weight is 2.7 N; on hard ground legs carry
//! 2.3 to 2.9 N, and `contact_natural_frequency = "200 Hz"` makes it a quarter each.
//!
//! # Energy balance
//!
//! Kinetic energy is that of velocities half a step old. The work of ropes and feet is their
//! impulse times the mean of the velocities before and after. The engine does not report the work
//! of its position corrections: it remains in the residual, which falls with the step.
//!
//! # Partial steps
//!
//! Boards with their own clocks interrupt the plant at any instant, also a nanosecond after the
//! last one. The engine corrects a constraint violation within the step, and the velocity of the
//! correction remains (above). Corrections therefore take the duration of the last long step,
//! however that time is divided (`drives::StepTiming`), and forces and drives act from the middle
//! of one step to that of the next. Otherwise some boards add 1e13 J to a robot within seconds.
//!
//! # Divergence
//!
//! A plant that diverges stops with a fault (`divergence.rs`): NaN, joint gaps and stop violations
//! of a quarter of a segment, a segment rotation of more than a radian in a step, and an energy
//! gain in the residual of more than half of the energy exchanged.
//!
//! # Limits
//!
//! Not modelled are toe joints (the foot is a point at the end of the third segment), contact
//! of trunk, knees and ankles with ground that is not flat, the wall of a step of the terrain, and
//! events at their exact instants. The engine promises the same bits on every machine; this is not
//! tested here.
#![doc = include_str!("../README.md")]

mod abduction;
mod assembly;
mod body;
mod body_colliders;
mod contact;
mod conversion;
mod divergence;
mod drives;
mod model;
mod options;
mod plant;
mod pushed;
mod readings;
mod robot;
mod rope;
mod step;
mod step_only;
mod world;

pub use options::{Joints, Options, RapierError, Softness, Solver};
pub use plant::Rapier;
