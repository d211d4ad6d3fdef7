//! Feet on the ground.

use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_rapier::{Joints, Options, Solver};
use twinrig_runtime::Plant;

use crate::scene::{Golden, Scene, flat, hanging, robot, standing};

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

#[test]
fn the_ground_bears_a_robot_that_stands() {
    let robot = robot();
    for joints in Joints::ALL {
        let mut scene = Scene::of(&robot, standing(2000), joints);
        scene.run_to_us(1_500_000);
        scene.plant.begin_window();
        scene.run_to_us(2_000_000);
        let loads: f64 = LEGS
            .iter()
            .map(|leg| scene.read(&format!("leg/{leg}/foot/load"))[0])
            .sum();
        // At rest, the mean of the loads is the weight; what is left of the swing after 1.5 s is less.
        assert!(
            (loads - robot.weight()).abs() < 2e-3 * robot.weight(),
            "{joints:?}: {loads} N"
        );
        for leg in LEGS {
            let clearance = scene.read(&format!("leg/{leg}/foot/clearance"))[0];
            assert!(clearance.abs() < 1e-4, "{joints:?}, {leg}: {clearance} m");
        }
    }
}

#[test]
fn a_slope_is_held_below_the_angle_of_friction_and_not_above() {
    let robot = robot();
    let slid = |friction: f64| {
        // A plane that falls by 0.3 in 1 along x, as wide as a robot ever goes.
        let heights = (0..25).map(|k| -0.3 * f64::from(k % 5 - 2)).collect();
        let field = HeightField::new([-2.0; 2], 1.0, 5, heights).unwrap();
        let ground = Ground::new(Terrain::Heights(field), friction, 0.0).unwrap();
        let setup = Setup {
            ground: Some(ground),
            ..standing(2000)
        };
        let mut scene = Scene::of(&robot, setup, Joints::Impulse);
        scene.run_to_us(400_000);
        let before = scene.read("leg/LF/foot/position")[0];
        scene.run_to_us(600_000);
        scene.read("leg/LF/foot/position")[0] - before
    };
    // tan of the angle is 0.3. Holding, it may still rock on its springs.
    let held = slid(0.8);
    assert!(held.abs() < 5e-3, "{held} m");
    let slid = slid(0.1);
    assert!(slid > 0.05, "{slid} m");
}

/// A trunk in the plane with a leg at its centre of mass, above lower ground: the greatest error of the foot \[m\].
fn drop(name: &str, step_us: u64) -> f64 {
    let golden = Golden::read(name);
    let mut robot = robot();
    robot.legs[0].hip = [0.0; 3];
    let fall = flat(&golden.0["start"]["fall_m"])[0];
    let lower = HeightField::new([-2.0; 2], 1.0, 5, vec![-fall; 25]).unwrap();
    let friction = golden.number("friction");
    let setup = Setup {
        base: Base::Planar,
        ground: Some(Ground::new(Terrain::Heights(lower), friction, 0.0).unwrap()),
        ..hanging(&["LF"], golden.start(), step_us)
    };
    let mut options = Options::new(setup, Joints::Impulse);
    // As hard as the reference's.
    options.solver.contact_softness.natural_frequency = 1e6;
    let mut scene = Scene::new(&robot, &options);
    let step_s = golden.number("step_s");
    let mut worst = 0.0_f64;
    for (k, foot) in (0_u64..).zip(golden.rows("foot")) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "small and whole"
        )]
        scene.run_to_us((k as f64 * step_s * 1e6).round() as u64);
        let found = scene.read("leg/LF/foot/position");
        worst = worst
            .max((found[0] - foot[0]).abs())
            .max((found[2] - foot[1]).abs());
    }
    worst
}

#[test]
fn a_leg_lands_as_the_reference_does() {
    let errors = [1000, 100].map(|step| drop("drop", step));
    // Measured: 0.49 mm, then 0.12 mm: twelve impacts in 0.3 s, each anywhere in its step.
    assert!(
        errors[0] < 1e-3 && errors[1] < 0.5 * errors[0],
        "{errors:?}"
    );
    // The second landing of this one goes through a leg whose stops are closed. Measured: 3.2 and 0.5 mm; with the sweeps of
    // every other step it is 39 and 37 mm, whatever the step.
    let errors = [1000, 100].map(|step| drop("stride", step));
    assert!(
        errors[0] < 5e-3 && errors[1] < 0.3 * errors[0],
        "{errors:?}"
    );
}

/// Farthest that the load of a leg is from a quarter of the weight, in windows of 20 ms, as a share of the weight.
fn unequal(natural_frequency: f64) -> f64 {
    let robot = robot();
    let mut options = Options::new(standing(1000), Joints::Impulse);
    options.solver.contact_softness.natural_frequency = natural_frequency;
    let mut scene = Scene::new(&robot, &options);
    scene.run_to_us(500_000);
    let mut worst = 0.0_f64;
    for window in 0..50 {
        scene.plant.begin_window();
        scene.run_to_us(500_000 + 20_000 * (window + 1));
        for leg in LEGS {
            let load = scene.read(&format!("leg/{leg}/foot/load"))[0];
            worst = worst.max((load / robot.weight() - 0.25).abs());
        }
    }
    worst
}

#[test]
fn feet_that_yield_share_the_weight_more_evenly_than_hard_ones() {
    let ours = Solver::best(Joints::Impulse).contact_softness;
    let [soft, hard] = [0.5 * ours.natural_frequency, 1e6].map(unequal);
    // Four feet that do not yield, under legs that do not either, leave it open how much which diagonal carries, and what
    // the sweeps leave over decides. Measured: 0.15 and 0.98 % of the weight.
    assert!(soft < 2.5e-3 && hard > 2.0 * soft, "{soft} {hard}");
}

#[test]
fn a_foot_rebounds_by_the_grounds_restitution() {
    // The robot falls 5 cm onto its feet, whose legs give way at once: so only that they rebound at all is looked at.
    let robot = robot();
    let height = |restitution: f64| {
        let lower = HeightField::new([-2.0; 2], 1.0, 5, vec![-0.05; 25]).unwrap();
        let ground = Ground::new(Terrain::Heights(lower), 0.6, restitution).unwrap();
        let setup = Setup {
            ground: Some(ground),
            drives: Drives::Ideal { period: 2e-3 },
            ..standing(1000)
        };
        let mut scene = Scene::of(&robot, setup, Joints::Impulse);
        let mut best = 0.0_f64;
        for k in 101..=140 {
            scene.run_to_us(1000 * k);
            best = best.max(scene.read("leg/LF/foot/clearance")[0]);
        }
        best
    };
    let [dead, lively] = [0.0, 0.8].map(height);
    assert!(lively > dead + 1e-4, "{dead} {lively}");
}
