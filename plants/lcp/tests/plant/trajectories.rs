//! Comparison with the trajectories of `tests/reference`, which uses other coordinates, other
//! derivatives, other integrators and another language. Two of its integrators agree to 1e-11 m on
//! each trajectory.

#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::needless_range_loop,
    reason = "times are small integers; rows of several tables are indexed by instant"
)]

use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_kernel::SimDuration;
use twinrig_lcp::{Lcp, Method, Options};
use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;
use twinrig_testing::plant_harness::PlantHarness;
use twinrig_testing::reference_trajectory::{ReferenceTrajectory, flatten};
use twinrig_testing::robots::robot;

/// Integration options.
#[derive(Clone, Copy)]
struct Integration {
    method: Method,
    step_us: u64,
    tolerance: f64,
}

/// Returns the default method at short steps without error control.
const fn fixed_steps(step_us: u64) -> Integration {
    Integration {
        method: Method::Rk4,
        step_us,
        tolerance: f64::INFINITY,
    }
}

/// Plant with its reference trajectory.
struct Fixture {
    reference: ReferenceTrajectory,
    harness: PlantHarness<Lcp>,
    hip: [f64; 3],
    worst: f64,
}

impl Fixture {
    fn new(
        reference: ReferenceTrajectory,
        robot: &Robot,
        setup: Setup,
        toe: bool,
        integration: Integration,
    ) -> Self {
        let options = Options {
            constraints: twinrig_lcp::Constraints::Rigid,
            setup: Setup {
                step: SimDuration::from_micros(integration.step_us),
                ..setup
            },
            method: integration.method,
            tolerance: integration.tolerance,
            toe,
            features: twinrig_lcp::Features::Detected,
        };
        Self {
            reference,
            harness: PlantHarness::new(Lcp::new(robot, &options, &|_| true).unwrap()),
            hip: robot.legs[0].hip,
            worst: 0.0,
        }
    }

    /// Advances to an instant.
    fn advance_to(&mut self, seconds: f64) {
        self.harness.advance_to_us((seconds * 1e6).round() as u64);
    }

    fn read(&mut self, signal: &str) -> Vec<f64> {
        self.harness.read(signal)
    }

    /// Returns the foot position relative to the hip in the leg plane, for a level trunk.
    fn foot_from_hip(&mut self) -> [f64; 2] {
        let (foot, trunk) = (
            self.read("leg/LF/foot/position"),
            self.read("body/position"),
        );
        [0, 2].map(|axis| foot[axis] - trunk[axis] - self.hip[axis])
    }

    fn compare(&mut self, found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert!(found.is_finite());
            self.worst = self.worst.max((found - expected).abs());
        }
    }
}

/// Returns the greatest error of foot \[m\] and angles \[rad\] of a leg on a fixed trunk, and
/// checks the impact losses.
fn passive(name: &str, integration: Integration) -> f64 {
    let reference = ReferenceTrajectory::read(name);
    let (robot, setup) = (reference.robot(), reference.setup(2000));
    let toe = reference.0["toe"].as_bool().unwrap();
    let mut fixture = Fixture::new(reference, &robot, setup, toe, integration);
    let (step, sparse) = (
        fixture.reference.number("step_s"),
        fixture.reference.number("sparse_step_s"),
    );
    let (feet, angles) = (
        fixture.reference.rows("foot"),
        fixture.reference.rows("angles"),
    );
    let every = (sparse / step).round() as usize;
    for (k, foot) in feet.iter().enumerate() {
        fixture.advance_to(k as f64 * step);
        let found = fixture.foot_from_hip();
        fixture.compare(&found, foot);
        if k % every == 0 {
            let found = fixture.read("leg/LF/angles");
            fixture.compare(&found, &angles[k / every][..3]);
        }
    }
    let losses = fixture.reference.rows("impact").concat();
    let (found, expected) = (
        fixture.harness.plant.energy().impact,
        losses[losses.len() - 1],
    );
    assert!(
        (found - expected).abs() <= 1e-6 * expected.max(1e-3),
        "{found} J lost in impacts"
    );
    fixture.worst
}

/// Returns the greatest error of positions \[m\] and attitude of a free trunk with some legs and no
/// ground.
fn tumble(name: &str, integration: Integration) -> f64 {
    let reference = ReferenceTrajectory::read(name);
    let mut robot = robot();
    let friction = flatten(&reference.0["friction"]);
    for mount in &mut robot.legs {
        let leg = &mut mount.leg;
        leg.diagonal.preload = reference.number("preload_m");
        leg.parallel.preload = reference.number("preload_m");
        leg.parallel_travel = reference.number("travel_m");
        let joints = &mut leg.joint_friction;
        (joints.hip, joints.knee) = (friction[0], friction[1]);
        (joints.ankle, joints.toe) = (friction[2], friction[3]);
    }
    let legs = reference.0["legs"].as_array().unwrap().iter();
    let legs: Vec<String> = legs.map(|leg| leg.as_str().unwrap().to_owned()).collect();
    let setup = Setup {
        base: Base::Free,
        legs: legs.clone(),
        ground: None,
        step: SimDuration::from_millis(2),
        drives: Drives::None,
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: reference.start().into(),
    };
    let toe = reference.0["toe"].as_bool().unwrap();
    let mut fixture = Fixture::new(reference, &robot, setup, toe, integration);
    let step = fixture.reference.number("step_s");
    let expected = ["position", "orientation", "feet"].map(|key| fixture.reference.rows(key));
    for k in 0..expected[0].len() {
        fixture.advance_to(k as f64 * step);
        let position = fixture.read("body/position");
        fixture.compare(&position, &expected[0][k]);
        let attitude = fixture.read("body/orientation");
        fixture.compare(&attitude, &expected[1][k]);
        let feet = legs
            .iter()
            .flat_map(|leg| fixture.read(&format!("leg/{leg}/foot/position")));
        let feet: Vec<f64> = feet.collect();
        fixture.compare(&feet, &expected[2][k]);
    }
    fixture.worst
}

#[test]
fn passive_leg_follows_reference() {
    for (name, step_us) in [
        ("passive", 50),
        ("hard-hit", 50),
        ("loose", 50),
        ("between", 40),
        ("hard-light", 25),
        ("undamped", 25),
        ("toe", 25),
    ] {
        let worst = passive(name, fixed_steps(step_us));
        assert!(worst < 1e-9, "{name}: {worst:e}");
    }
}

#[test]
fn leg_of_hundredfold_stiffness_follows_reference() {
    for name in ["stiff", "stiff-between"] {
        let worst = passive(name, fixed_steps(10));
        assert!(worst < 1e-8, "{name}: {worst:e}");
    }
}

#[test]
fn tumbling_robot_follows_reference() {
    for name in [
        "tumble",
        "tumble-undamped",
        "tumble-toe",
        "tumble-leg",
        "tumble-stops",
    ] {
        let worst = tumble(name, fixed_steps(25));
        assert!(worst < 1e-9, "{name}: {worst:e}");
    }
}

#[test]
fn errors_are_of_fourth_order_in_step_size() {
    for name in ["passive", "hard-hit", "undamped", "toe"] {
        let [coarse, fine] = [200, 100].map(|step_us| passive(name, fixed_steps(step_us)));
        assert!(coarse > 10.0 * fine, "{name}: {coarse:e}, then {fine:e}");
    }
}

/// Returns the greatest error of positions \[m\] and angles \[rad\] of a planar trunk with a leg at
/// its centre of mass, above lower ground.
fn drop(name: &str, base: Base, integration: Integration) -> f64 {
    let reference = ReferenceTrajectory::read(name);
    let mut robot = robot();
    robot.legs[0].hip = [0.0; 3];
    let lower = HeightField::new(
        [-2.0; 2],
        1.0,
        5,
        vec![-flatten(&reference.0["start"]["fall_m"])[0]; 25],
    );
    let terrain = Terrain::Heights(lower.unwrap());
    let setup = Setup {
        base,
        legs: vec!["LF".to_owned()],
        ground: Some(Ground::new(terrain, reference.number("friction"), 0.0).unwrap()),
        step: SimDuration::from_millis(2),
        drives: Drives::None,
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: reference.start().into(),
    };
    let mut fixture = Fixture::new(reference, &robot, setup, false, integration);
    fixture.harness.plant.log_events(true);
    let step = fixture.reference.number("step_s");
    let (trunk, feet) = (
        fixture.reference.rows("trunk"),
        fixture.reference.rows("foot"),
    );
    for (k, (trunk, foot)) in trunk.iter().zip(&feet).enumerate() {
        fixture.advance_to(k as f64 * step);
        let (position, attitude) = (
            fixture.read("body/position"),
            fixture.read("body/orientation"),
        );
        let pitch = 2.0 * libm::atan2(attitude[2], attitude[0]);
        fixture.compare(&[position[0], position[2], pitch], trunk);
        let found = fixture.read("leg/LF/foot/position");
        fixture.compare(&[found[0], found[2]], foot);
    }
    fixture.worst
}

/// The bounds are twice the measured errors, which fall to the accuracy of the reference.
#[test]
fn landing_leg_agrees_with_reference() {
    const BOUNDS: [(u64, f64); 4] = [(25, 1.5e-9), (100, 4e-9), (500, 5e-7), (2000, 3.2e-5)];
    for name in ["drop", "stride"] {
        for (step_us, bound) in BOUNDS {
            let planar = drop(name, Base::Planar, fixed_steps(step_us));
            assert!(planar < bound, "{name} at {step_us} µs: {planar:e}");
            // Without lateral forces, a free trunk remains in the plane.
            let free = drop(name, Base::Free, fixed_steps(step_us));
            assert!(
                (free - planar).abs() < 1e-12,
                "{name}: {free:e}, {planar:e}"
            );
        }
    }
}
