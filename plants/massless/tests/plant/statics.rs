//! Standing and sticking: what the ground carries, and what the cables do.

use twinrig_leg::{LegCommand, Pantograph, Planar, Stop};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;

use crate::scene::{Scene, named_robot, on_slope, robot, setup};

const G: f64 = 9.81;
const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

/// Starts with slack cables, runs to rest, then measures a tenth of a second.
fn settled(robot: &Robot, setup: &Setup) -> Scene {
    let extended = LegCommand {
        hip: 0.0,
        knee: 0.0,
    };
    let mut setup = setup.clone();
    setup.start = setup
        .legs
        .iter()
        .map(|leg| (leg.clone(), extended))
        .collect();
    let mut scene = Scene::new(robot, &setup);
    scene.to(2000);
    scene.plant.begin_window();
    scene.to(2100);
    scene
}

/// The robot with its legs on their springs, not on their stops: no preload, so that every newton bends them. Friction that
/// brings it to rest soon is nothing to statics.
fn sprung() -> Robot {
    let mut robot = robot();
    for mount in &mut robot.legs {
        (mount.leg.diagonal.preload, mount.leg.parallel.preload) = (0.0, 0.0);
        let friction = &mut mount.leg.joint_friction;
        (friction.knee, friction.ankle) = (0.02, 0.02);
    }
    robot
}

#[test]
fn the_feet_of_a_robot_that_stands_carry_its_weight() {
    for robot in [robot(), sprung(), named_robot("oncilla")] {
        let mut scene = settled(&robot, &setup());
        let loads = LEGS.map(|leg| scene.value(&format!("leg/{leg}/foot/load")));
        let weight = robot.mass() * G;
        let sum: f64 = loads.iter().sum();
        // A tenth of a second of mean: what is left of the bouncing after 2 s is below 1e-6 of the weight.
        assert!(
            (sum - weight).abs() < 1e-6 * weight,
            "{}: {sum} of {weight}",
            robot.name
        );
        let velocity = scene.read("body/velocity").to_vec();
        assert!(velocity.iter().all(|v| v.abs() < 1e-5), "{velocity:?}");
    }
}

#[test]
fn each_pair_of_feet_carries_what_the_balance_of_moments_leaves_it() {
    // Two legs in the plane: statically determinate. The hind hip nearer to the mass centre carries more.
    let mut robot = sprung();
    for mount in &mut robot.legs {
        if mount.name.ends_with('H') {
            mount.hip[0] = -0.06;
        }
    }
    let two = Setup {
        base: Base::Planar,
        legs: vec!["LF".to_owned(), "LH".to_owned()],
        ..setup()
    };
    let mut scene = settled(&robot, &two);
    // All masses with their places: trunk and hips as one, feet where they are seen to be.
    let body = scene.read("body/position").to_vec();
    let foot = |scene: &mut Scene, leg: &str| scene.read(&format!("leg/{leg}/foot/position"))[0];
    let (fore, hind) = (foot(&mut scene, "LF"), foot(&mut scene, "LH"));
    let mass = robot.trunk.mass + 2.0 * 0.02;
    let feet = 0.03 * G;
    let share = (body[0] - hind) / (fore - hind);
    for (leg, expected) in [
        ("LF", mass * G * share + feet),
        ("LH", mass * G * (1.0 - share) + feet),
    ] {
        let load = scene.value(&format!("leg/{leg}/foot/load"));
        // Two seconds leave 1e-5 of the bouncing.
        assert!(
            (load - expected).abs() < 1e-5 * expected,
            "{leg}: {load}, not {expected}"
        );
    }
    let loads = ["LF", "LH"].map(|leg| scene.value(&format!("leg/{leg}/foot/load")));
    assert!(loads[1] > 1.05 * loads[0], "{loads:?}");
}

#[test]
fn a_leg_that_stands_is_where_the_minimum_of_its_energy_is() {
    // Four equal legs on springs, hips free of torque but for what holds them: the leg's equilibrium at the length it has
    // pushes with the load of one foot (less the foot's own weight) and asks the hip for the torque it is measured to give.
    let robot = sprung();
    let mut scene = settled(&robot, &setup());
    let leg = Pantograph::new(&robot.legs[0].leg).unwrap();
    for name in LEGS {
        let load = scene.value(&format!("leg/{name}/foot/load")) - 0.03 * G;
        let angles = scene.read(&format!("leg/{name}/angles")).to_vec();
        let torque = scene.value(&format!("leg/{name}/hip/torque"));
        let foot = scene.read(&format!("leg/{name}/foot/position")).to_vec();
        let body = scene.read("body/position").to_vec();
        let pitch = scene.read("body/rpy")[1];
        let hip = if name.ends_with('F') { 0.1 } else { -0.1 };
        let [x, z] = [
            foot[0] - body[0] - hip * libm::cos(pitch),
            foot[2] - body[2] + hip * libm::sin(pitch),
        ];
        let length = libm::hypot(x, z);
        let lean = libm::atan2(x, -z);
        // Turn the world so that the leg's axis is vertical.
        let pull = scene.read(&format!("leg/{name}/foot/force")).to_vec();
        let (along, beside) = (
            load * libm::cos(lean) - pull[0] * libm::sin(lean),
            load * libm::sin(lean) + pull[0] * libm::cos(lean),
        );
        let cable = leg.cable_length(scene.value(&format!("leg/{name}/knee/position")));
        let found = leg.equilibrium(length, torque, cable).unwrap();
        assert!(
            scene.value(&format!("leg/{name}/cable/tension")) == 0.0,
            "the cable is slack"
        );
        // The scan of `equilibrium` is refined to 1e-12 rad; the bouncing after 2 s is the larger rest.
        assert!(
            (found.axial - along).abs() < 1e-5,
            "{name}: {found:?} {along}"
        );
        assert!(
            (found.transverse - beside).abs() < 1e-5,
            "{name}: {found:?} {beside}"
        );
        let opening = angles[2] - angles[0];
        assert!(
            (found.opening - opening).abs() < 1e-6,
            "{name}: {found:?} {opening}"
        );
    }
}

#[test]
fn a_taut_cable_carries_what_the_springs_and_the_foot_leave_it() {
    // A leg on a stand, its knee pulled in: closed pantograph and cable hold it. Virtual work on foot and hip: gradient of
    // the springs − weight of the foot = tension · gradient of the cable + force · gradient of the rod.
    let robot = robot();
    let leg = Pantograph::new(&robot.legs[0].leg).unwrap();
    for share in [0.7, 0.8, 0.9] {
        let start = leg
            .inverse_closed(Planar::new(0.01, -share * leg.length_max()))
            .unwrap();
        let alone = Setup {
            base: Base::Fixed,
            legs: vec!["LF".to_owned()],
            ground: None,
            start: vec![("LF".to_owned(), start)].into(),
            ..setup()
        };
        let mut scene = Scene::new(&robot, &alone);
        scene.to(2000);
        let hip = start.hip + leg.hip_reference();
        let foot = leg.foot_of(start).unwrap();
        let pose = leg.pose(libm::sin(hip), libm::cos(hip), foot).unwrap();
        let push = leg.spring_gradient(&pose);
        let weight = Planar::new(0.0, 0.03 * G);
        let row = |stop: Stop| {
            let (length, sign) = stop.limits();
            leg.length_gradient(&pose, length) * sign
        };
        let (cable, closed) = (row(Stop::Cable), row(Stop::Closed));
        // What pushes the foot apart from the stops: 2 × 2.
        let need = push.foot + weight;
        let determinant = cable.foot.x * closed.foot.y - cable.foot.y * closed.foot.x;
        let tension = (need.x * closed.foot.y - need.y * closed.foot.x) / determinant;
        let rod = (cable.foot.x * need.y - cable.foot.y * need.x) / determinant;
        let torque = push.hip - tension * cable.hip - rod * closed.hip;
        let found = scene.value("leg/LF/cable/tension");
        assert!(tension > 5.0 && rod > 0.0, "{tension} {rod}");
        assert!(
            (found - tension).abs() < 1e-6 * tension,
            "{found} N, not {tension}"
        );
        let winding = scene.value("leg/LF/knee/torque");
        assert!((winding - 0.025 * tension).abs() < 1e-6, "{winding}");
        let held = scene.value("leg/LF/hip/torque");
        assert!((held - torque).abs() < 1e-6, "{held}, not {torque}");
    }
}

/// The robot as a rigid body: drives that yield to nothing, springs that nothing here moves off their stops.
fn rigid_on_slope(slope: f64, friction: f64) -> Scene {
    let mut robot = robot();
    for mount in &mut robot.legs {
        (mount.leg.diagonal.preload, mount.leg.parallel.preload) = (0.05, 0.05);
    }
    let mut setup = on_slope(&robot, slope, friction);
    setup.drives = Drives::Ideal { period: 5e-3 };
    Scene::new(&robot, &setup)
}

#[test]
fn a_robot_sticks_below_the_friction_angle_and_slides_above_it() {
    for (slope, slides) in [(0.199, false), (0.201, true), (0.3, true)] {
        let friction = 0.2;
        let mut scene = rigid_on_slope(slope, friction);
        let start = scene.read("leg/LH/foot/position").to_vec();
        scene.to(100);
        let before = scene.read("body/velocity").to_vec();
        scene.to(500);
        let place = scene.read("leg/LH/foot/position").to_vec();
        let after = scene.read("body/velocity").to_vec();
        let found = libm::hypot(after[0] - before[0], after[2] - before[2]) / 0.4;
        if slides {
            let angle = libm::atan(slope);
            let expected = G * (libm::sin(angle) - friction * libm::cos(angle));
            // The stops give by the compliance of redundant constraints: 1e-9 of the weight and of the acceleration.
            assert!(
                (found - expected).abs() < 1e-6 * G,
                "{found}, not {expected}"
            );
        } else {
            let crept = (place[0] - start[0]).abs();
            assert!(crept < 1e-9 && found < 1e-9, "{crept} {found}");
        }
    }
}
