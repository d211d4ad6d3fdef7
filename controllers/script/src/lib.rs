//! A controller that plays what is known in advance: each drive holds, ramps, swings or jumps, whatever the robot does. What
//! it writes is a pure function of the sum of the elapsed times it was told, in whole nanoseconds: executors that tell it the
//! same times, in virtual time or on a real clock, in the same pieces or others, get the same bits. It is for rigs whose
//! subject is not walking: the timing of a bus, a drive on a bench, a comparison of a twin with hardware byte by byte.
//!
//! ```
//! use twinrig_kernel::SimDuration;
//! use twinrig_runtime::Process;
//! use twinrig_script::{Plan, Script, Shape};
//!
//! # let robot = twinrig_script::example_robot();
//! let plan = Plan { hip: Shape::Sine, ..Plan::default() };
//! let mut script = Script::new(&robot, &["LF"], &plan)?;
//! let mut commands = [0.0; 2];
//! script.step(SimDuration::ZERO, &[], &mut commands);
//! assert_eq!(commands, [0.0, 0.5]); // the middle of the hip's swing; the knee holds
//! script.step(SimDuration::from_millis(250), &[], &mut commands);
//! assert_eq!(commands, [0.1, 0.5]); // a quarter of a cycle at 1 Hz
//! # Ok::<(), twinrig_script::ScriptError>(())
//! ```
//!
//! # What it does not do
//!
//! It reads no sensor, knows neither kinematics nor limits of a leg (an angle is an angle, in or out of reach), smooths
//! nothing, and draws no random numbers.

mod error;
mod plan;
mod script;
mod shape;
#[cfg(test)]
mod tests;

pub use error::ScriptError;
pub use plan::Plan;
pub use script::Script;
pub use shape::Shape;

/// The robot that examples and tests of this crate use.
#[doc(hidden)]
pub fn example_robot() -> twinrig_robot::Robot {
    use twinrig_robot::{
        Actuators, JointFriction, Leg, LegMass, LegMount, Robot, Servo, Spring, Trunk,
    };
    let servo = Servo {
        lag: 0.005,
        speed: 12.0,
        torque: 2.0,
        dead_band: 0.0,
        inertia: 1e-4,
    };
    let leg = Leg {
        l1: 0.0442,
        l2: 0.0714,
        l3: 0.0544,
        l_delta: 0.015,
        q2_ref: 0.6,
        diagonal: Spring {
            stiffness: 4400.0,
            preload: 0.003,
        },
        parallel: Spring {
            stiffness: 1800.0,
            preload: 0.003,
        },
        parallel_travel: 0.010,
        diagonal_min: 0.063,
        joint_friction: JointFriction {
            hip: 1e-3,
            knee: 1e-3,
            ankle: 1e-3,
            toe: 1e-3,
        },
        mass: LegMass {
            l1: 0.01,
            l2: 0.01,
            l3: 0.01,
            foot: 0.02,
            lumped_foot: 0.03,
        },
        pulley_radius: 0.025,
        toe: None,
    };
    let mount = |name: &str, x: f64, y: f64| LegMount {
        name: name.to_owned(),
        hip: [x, y, 0.0],
        leg: leg.clone(),
    };
    Robot {
        name: "example".to_owned(),
        trunk: Trunk {
            mass: 0.9,
            inertia: [1e-3, 3e-3, 3e-3],
            size: [0.2, 0.1, 0.05],
        },
        legs: vec![
            mount("LF", 0.1, 0.05),
            mount("RF", 0.1, -0.05),
            mount("LH", -0.1, 0.05),
            mount("RH", -0.1, -0.05),
        ],
        actuators: Actuators {
            hip: servo,
            knee: servo,
            abduction: None,
        },
        motors: None,
        friction: 0.6,
    }
}
