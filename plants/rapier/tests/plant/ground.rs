//! Feet on the ground.

use twinrig_contact::{Ground, HeightField, Patch, Terrain};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_rapier::{Joints, Options, Solver};
use twinrig_runtime::Plant;
use twinrig_testing::reference_trajectory::{ReferenceTrajectory, flatten};
use twinrig_testing::robots::{LEGS, flat_ground, robot};

use crate::fixture::{standing, with_joints, with_options};

#[test]
fn ground_carries_the_weight_of_a_standing_robot() {
    let robot = robot();
    for joints in Joints::ALL {
        let mut fixture = with_joints(&robot, standing(2000), joints);
        fixture.advance_to_us(1_500_000);
        fixture.plant.begin_window();
        fixture.advance_to_us(2_000_000);
        let loads: f64 = LEGS
            .iter()
            .map(|leg| fixture.read(&format!("leg/{leg}/foot/load"))[0])
            .sum();
        // At rest the mean of the loads is the weight; the oscillation left after 1.5 s is smaller.
        assert!(
            (loads - robot.weight()).abs() < 2e-3 * robot.weight(),
            "{joints:?}: {loads} N"
        );
        for leg in LEGS {
            let clearance = fixture.read(&format!("leg/{leg}/foot/clearance"))[0];
            assert!(clearance.abs() < 1e-4, "{joints:?}, {leg}: {clearance} m");
        }
    }
}

#[test]
fn robot_slides_only_above_the_friction_angle() {
    let robot = robot();
    let slip = |friction: f64| {
        // A plane that falls by 0.3 per unit of x, wider than the robot's range.
        let heights = (0..25).map(|k| -0.3 * f64::from(k % 5 - 2)).collect();
        let field = HeightField::new([-2.0; 2], 1.0, 5, heights).unwrap();
        let ground = Ground::new(Terrain::Heights(field), friction, 0.0).unwrap();
        let setup = Setup {
            ground: Some(ground),
            ..standing(2000)
        };
        let mut fixture = with_joints(&robot, setup, Joints::Impulse);
        fixture.advance_to_us(400_000);
        let before = fixture.read("leg/LF/foot/position")[0];
        fixture.advance_to_us(600_000);
        fixture.read("leg/LF/foot/position")[0] - before
    };
    // The tangent of the slope is 0.3. Without sliding, the robot may still oscillate on its
    // springs.
    let held = slip(0.8);
    assert!(held.abs() < 5e-3, "{held} m");
    let slip = slip(0.1);
    assert!(slip > 0.05, "{slip} m");
}

/// Returns the largest error of the foot \[m\] for a planar trunk with a leg at its centre of mass,
/// above lower ground.
fn drop(name: &str, step_us: u64) -> f64 {
    let reference = ReferenceTrajectory::read(name);
    let mut robot = robot();
    robot.legs[0].hip = [0.0; 3];
    let fall = flatten(&reference.0["start"]["fall_m"])[0];
    let lower = HeightField::new([-2.0; 2], 1.0, 5, vec![-fall; 25]).unwrap();
    let friction = reference.number("friction");
    let setup = Setup {
        base: Base::Planar,
        ground: Some(Ground::new(Terrain::Heights(lower), friction, 0.0).unwrap()),
        ..reference.setup(step_us)
    };
    let mut options = Options::new(setup, Joints::Impulse);
    // As stiff as the reference's ground.
    options.solver.contact_softness.natural_frequency = 1e6;
    let mut fixture = with_options(&robot, &options);
    let step_s = reference.number("step_s");
    let mut worst = 0.0_f64;
    for (k, foot) in (0_u64..).zip(reference.rows("foot")) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "small integers"
        )]
        fixture.advance_to_us((k as f64 * step_s * 1e6).round() as u64);
        let found = fixture.read("leg/LF/foot/position");
        worst = worst
            .max((found[0] - foot[0]).abs())
            .max((found[2] - foot[1]).abs());
    }
    worst
}

#[test]
fn landing_agrees_with_the_reference() {
    let errors = [1000, 100].map(|step| drop("drop", step));
    // Measured: 0.49 mm, then 0.12 mm: twelve impacts in 0.3 s, at arbitrary times within a step.
    assert!(
        errors[0] < 1e-3 && errors[1] < 0.5 * errors[0],
        "{errors:?}"
    );
    // The second landing of this one acts on a leg whose stops are closed. Measured: 3.2 and 0.5
    // mm; with the sweeps of all other steps 39 and 37 mm, at either step.
    let errors = [1000, 100].map(|step| drop("stride", step));
    assert!(
        errors[0] < 5e-3 && errors[1] < 0.3 * errors[0],
        "{errors:?}"
    );
}

/// Returns the largest deviation of a leg's load from a quarter of the weight, over windows of 20
/// ms, as a share of the weight.
fn load_deviation(natural_frequency: f64) -> f64 {
    let robot = robot();
    let mut options = Options::new(standing(1000), Joints::Impulse);
    options.solver.contact_softness.natural_frequency = natural_frequency;
    let mut fixture = with_options(&robot, &options);
    fixture.advance_to_us(500_000);
    let mut worst = 0.0_f64;
    for window in 0..50 {
        fixture.plant.begin_window();
        fixture.advance_to_us(500_000 + 20_000 * (window + 1));
        for leg in LEGS {
            let load = fixture.read(&format!("leg/{leg}/foot/load"))[0];
            worst = worst.max((load / robot.weight() - 0.25).abs());
        }
    }
    worst
}

#[test]
fn compliant_feet_share_the_weight_more_evenly() {
    let default = Solver::best(Joints::Impulse).contact_softness;
    let [soft, hard] = [0.5 * default.natural_frequency, 1e6].map(load_deviation);
    // With rigid feet and legs the distribution between the diagonals is indeterminate, and the
    // residual of the sweeps decides. Measured: 0.15 and 0.98 % of the weight.
    assert!(soft < 2.5e-3 && hard > 2.0 * soft, "{soft} {hard}");
}

#[test]
fn foot_rebounds_by_the_restitution() {
    // The robot falls 5 cm onto its feet, and its legs yield at once: the test checks for a rebound
    // only, not for its height.
    let robot = robot();
    let height = |restitution: f64| {
        let lower = HeightField::new([-2.0; 2], 1.0, 5, vec![-0.05; 25]).unwrap();
        let ground = Ground::new(Terrain::Heights(lower), 0.6, restitution).unwrap();
        let setup = Setup {
            ground: Some(ground),
            drives: Drives::Ideal { period: 2e-3 },
            ..standing(1000)
        };
        let mut fixture = with_joints(&robot, setup, Joints::Impulse);
        let mut best = 0.0_f64;
        for k in 101..=140 {
            fixture.advance_to_us(1000 * k);
            best = best.max(fixture.read("leg/LF/foot/clearance")[0]);
        }
        best
    };
    let [inelastic, elastic] = [0.0, 0.8].map(height);
    assert!(elastic > inelastic + 1e-4, "{inelastic} {elastic}");
}

#[test]
fn sliding_feet_have_the_friction_of_the_present_patch() {
    let patch = Patch {
        friction: 0.05,
        extent: f64::NEG_INFINITY..f64::INFINITY,
        begin: SimTime::ZERO + SimDuration::from_micros(50_300),
        end: None,
    };
    let ground = flat_ground(0.3).with_patches(vec![patch]).unwrap();
    let setup = Setup {
        ground: Some(ground),
        ..standing(2000)
    };
    for joints in Joints::ALL {
        let mut fixture = with_joints(&robot(), setup.clone(), joints);
        let state = fixture.plant.state().unwrap();
        let state = state.with("body/velocity", &[1.5, 0.0, 0.0]);
        fixture.plant.resume_from(&state).unwrap();
        fixture.advance_to_us(20_000);
        for (to_us, friction) in [(50_300, 0.3), (90_000, 0.05)] {
            fixture.plant.begin_window();
            fixture.advance_to_us(to_us);
            let force = LEGS.map(|leg| fixture.read(&format!("leg/{leg}/foot/force")));
            let sum = |axis: usize| force.iter().map(|force| force[axis]).sum::<f64>();
            let ratio = -sum(0) / sum(2);
            assert!(
                (ratio - friction).abs() < 0.02 * friction,
                "{joints:?}: {ratio} {friction}"
            );
        }
    }
}
