//! The robot in Rapier, an engine for rigid bodies: the same robot as `twinrig-lcp`'s, solved as an engine solves it.
//!
//! ```
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_legged::{Base, Drives, Setup, StartPose};
//! use twinrig_rapier::{Joints, Options, Rapier};
//! use twinrig_robot::RobotFile;
//! use twinrig_runtime::Plant;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = include_str!("../../../robots/cheetah-cub.toml");
//! let robot = RobotFile::parse("cheetah-cub.toml", text)?.robot()?;
//! // The legs hang from a trunk that is held, are let go, and swing (thesis, section 2.5.1).
//! let (hip, knee) = (10_f64.to_radians(), -9.5_f64.to_radians());
//! let setup = Setup {
//!     base: Base::Fixed,
//!     legs: robot.legs.iter().map(|mount| mount.name.clone()).collect(),
//!     ground: None,
//!     step: SimDuration::from_millis(2),
//!     drives: Drives::None,
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
//! # What is what in the engine
//!
//! Trunk and segments are bodies; joints are impulses between bodies that know nothing of each other, or a tree in the
//! coordinates of its joints ([`Joints`]). A segment is a thin rod, which has no inertia about itself; here it has a
//! twentieth of that across ([`Options::AXIAL_SHARE`]), which nothing feels in the leg's plane.
//!
//! *Springs and friction in the joints* are forces that we give, anew in each step: the engine holds forces over substeps of
//! its own, which costs a hundred times the accuracy of as many steps.
//!
//! *Stops are ropes*, every one, since ropes are the engine's only stop that looks ahead: a limit of an angle counts once it
//! has been passed. The knee's stops are ropes across the knee, the lower stop of the pantograph one between two points that
//! are l₂ apart where it is closed and nearer where it is open, the upper one the parallel rod itself. The cable's length is a
//! matter of the knee's angle alone, so it is a rope across the knee, too, whose pull is converted to the cable's tension by
//! virtual work. Where a rope is tied does not matter to the motion and does to the sweeps: with the diagonal's own ends as
//! ends of the rope, legs at rest on their stops were wrong by 2.4 mm after a hundred. Between the links of a tree
//! the engine has no ropes; there, a limit along the line stands for each, tied to be taut just at the end of the step in
//! which it will be.
//!
//! *Drives*: the hip's servo is a motor of the engine, the pulley a number of ours, and rotors are dampers (`drives.rs`). All
//! of [`Drives`](twinrig_legged::Drives) are there. A servo that turns out to have given more torque than it has is used up
//! from the next step on.
//!
//! *Feet* are balls of 0.1 mm, friction and restitution the engine's. Each stands on a plane of its own, which is the ground's
//! tangent plane below it: terrain is smooth (`twinrig-contact`), while a height field of triangles has edges and, as fine as
//! it would have to be, some 20 MB that every snapshot would carry. A step is a plane that is lower, without the wall.
//!
//! # Settings
//!
//! `examples/settings.rs` measures them: root mean square errors of the foot in mm at 2 ms, against a reference that is right
//! to 1e-9 m.
//!
//! ```text
//!                                      passive  between  hard hit  undamped
//! impulse joints, 300 sweeps             0.025    0.159     0.597     1.352    the default
//!                 100 sweeps             0.028    0.159     0.583     1.333
//!                  10 sweeps             3.394    0.157     4.631     5.636
//!                 500 sweeps             0.025    0.159     0.597     1.352
//!  substeps 4 (ours)                     0.006    0.011     0.038     0.105
//!  solver_iterations 4 (the engine's)    0.277    1.983     0.605     0.691
//!  stabilization_iterations 1            0.027    0.159     0.643     1.233
//!  joints of 300 Hz, damping ratio 1     4.853    0.870     5.230     6.607
//!  all as the engine has it              7.334    2.202     6.621     fault
//! multibody joints, 20 sweeps            0.776    4.601     4.410     8.074
//!  all as the engine has it              1.476  143.874     fault     fault
//! ```
//!
//! Joints and stops are as stiff as can be: softness only adds error. Corrections of positions keep their speed
//! (no stabilization): it is then the leapfrog with constraints, of second order between events (`step.rs`), and a cable that
//! is wound in moves the leg, where stabilization would take its speed away. The engine's warm start of joints
//! (`warmstart_joints`) is off: it gives each constraint its last impulse just before it solves that same constraint, which
//! takes it away again. Multibody joints have no gaps, and lose more: how the engine treats the joints' own accelerations
//! takes energy out of a swing, of second order, too: they are here to compare, and impulse joints to work with.
//!
//! *Sweeps on the ground.* A leg that hangs is solved by 100 sweeps; one that stands closes a chain, and `scenarios/walk.toml`
//! needs 300 at 1 ms (with 200 a foot leaves the ground for a moment and counts as two touch-downs). A landing goes through
//! the whole leg and its closed stops at once, so steps in which a foot lands, and the next, have 2 000
//! ([`Solver::landing_iterations`]): with 100 a leg that lands on its stops is wrong by 37 mm, whatever the step; so it is
//! by 3.2 mm at 1 ms and by 0.5 mm at 0.1 ms.
//!
//! *Ground.* Feet on hard ground (1 MHz) land best: what is said of a landing above is measured on it. But on it fast trots
//! fall at 1 ms and a step of 20 mm is not survived (`scenarios/trot-fast.toml`, `step-down.toml`), where they run as in
//! `twinrig-lcp` on one of 400 Hz, which yields by hundredths of a millimetre: the default. Why hard ground does that is
//! not known; fewer sweeps hide some of it.
//!
//! *Which leg carries how much.* Legs do not yield below their preload, nor do drives: the loads of four such legs are not
//! determined by forces, but for their sum, and what the sweeps leave over decides. On hard ground legs carry 2.3 to 2.9 N
//! of 2.7 in `scenarios/stand.toml`; `contact_natural_frequency = "200 Hz"` makes it a quarter each.
//!
//! # What the books hold
//!
//! Kinetic energy is that of velocities half a step old. Ropes and feet are booked by their impulses and the mean of the
//! speeds before and after; what the engine does to correct positions it does not tell, and stays in the residual, which
//! falls with the step.
//!
//! # Steps that are cut
//!
//! Boards with clocks of their own have the plant stop anywhere, also a nanosecond after it did. The engine takes back what
//! a constraint is off by within the step, and the speed of that stays (above); so here it is told to take as long as the
//! last long step was, whatever became of that time (`drives::Pace`), and forces and drives act from the middle of one step
//! to that of the next. Otherwise some boards put 1e13 J into a robot within seconds.
//!
//! # What is refused
//!
//! A plant that diverges stops with a fault (`divergence.rs`): what is no number, joints apart and stops passed by a quarter of a
//! segment, a segment that turns by more than a radian in a step, and more energy from nowhere than half of all that was
//! exchanged.
//!
//! # What is not here
//!
//! Toe joints (the foot is a point at the end of the third segment), collisions of anything but feet, the wall of a step,
//! events at the instant at which they happen, and bits that are the same on every machine: the engine promises those, and
//! nothing here has tried.

mod assembly;
mod border;
mod contact;
mod divergence;
mod drives;
mod model;
mod options;
mod plant;
mod readings;
mod robot;
mod rope;
mod step;
mod world;

pub use options::{Joints, Options, RapierError, Softness, Solver};
pub use plant::Rapier;
