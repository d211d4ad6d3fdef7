//! Standing and sticking: ground forces and cable tensions.

use twinrig_legged::{Base, Drives, Setup};
use twinrig_robot::Robot;
use twinrig_robot::leg::{LegCommand, Pantograph, Planar, Stop};
use twinrig_runtime::Plant;
use twinrig_testing::robots::{LEGS, robot, robot_named};

use super::harness::{Harness, massless, on_slope, setup};

const G: f64 = 9.81;
/// Starts with slack cables, runs to rest, then measures for a tenth of a second.
fn settled(robot: &Robot, setup: &Setup) -> Harness {
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
    let mut harness = massless(robot, &setup);
    harness.advance_to_ms(2000);
    harness.plant.begin_window();
    harness.advance_to_ms(2100);
    harness
}

/// Cheetah-cub with its legs on their springs, not on their stops: no preload, so that any load
/// deflects them. Increased joint friction, which shortens the transient, does not affect statics.
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
fn feet_of_a_standing_robot_carry_its_weight() {
    for robot in [robot(), sprung(), robot_named("oncilla")] {
        let mut harness = settled(&robot, &setup());
        let loads = LEGS.map(|leg| harness.value(&format!("leg/{leg}/foot/load")));
        let weight = robot.mass() * G;
        let sum: f64 = loads.iter().sum();
        // Mean over a tenth of a second: the oscillation that remains after 2 s is below 1e-6 of
        // the weight.
        assert!(
            (sum - weight).abs() < 1e-6 * weight,
            "{}: {sum} of {weight}",
            robot.name
        );
        let velocity = harness.read("body/velocity");
        assert!(velocity.iter().all(|v| v.abs() < 1e-5), "{velocity:?}");
    }
}

#[test]
fn loads_of_fore_and_hind_feet_satisfy_the_balance_of_moments() {
    // Two legs in the plane are statically determinate. The hind hip is nearer to the mass centre
    // and carries more.
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
    let mut harness = settled(&robot, &two);
    // All masses with their positions: trunk, hips, and feet where they are measured.
    let (trunk, pitch) = (
        harness.read("body/position")[0],
        harness.read("body/rpy")[1],
    );
    let foot =
        |harness: &mut Harness, leg: &str| harness.read(&format!("leg/{leg}/foot/position"))[0];
    let (fore, hind) = (foot(&mut harness, "LF"), foot(&mut harness, "LH"));
    let mass = robot.trunk.mass + 2.0 * 0.02;
    let hips = 0.02 * (0.1 - 0.06) * libm::cos(pitch);
    let feet = 0.03 * G;
    let share = (trunk + hips / mass - hind) / (fore - hind);
    for (leg, expected) in [
        ("LF", mass * G * share + feet),
        ("LH", mass * G * (1.0 - share) + feet),
    ] {
        let load = harness.value(&format!("leg/{leg}/foot/load"));
        // The oscillation that remains after 2 s is 1e-5.
        assert!(
            (load - expected).abs() < 1e-5 * expected,
            "{leg}: {load}, not {expected}"
        );
    }
    let loads = ["LF", "LH"].map(|leg| harness.value(&format!("leg/{leg}/foot/load")));
    assert!(loads[1] > 1.05 * loads[0], "{loads:?}");
}

#[test]
fn standing_leg_is_at_the_minimum_of_its_energy() {
    // Four equal legs on springs: the equilibrium of a leg at its length has the load of one foot
    // (less the foot's own weight) as its axial force, and the measured torque at the hip.
    let robot = sprung();
    let mut harness = settled(&robot, &setup());
    let leg = Pantograph::new(&robot.legs[0].leg).unwrap();
    for name in LEGS {
        let load = harness.value(&format!("leg/{name}/foot/load")) - 0.03 * G;
        let angles = harness.read(&format!("leg/{name}/angles"));
        let torque = harness.value(&format!("leg/{name}/hip/torque"));
        let foot = harness.read(&format!("leg/{name}/foot/position"));
        let body = harness.read("body/position");
        let pitch = harness.read("body/rpy")[1];
        let hip = if name.ends_with('F') { 0.1 } else { -0.1 };
        let [x, z] = [
            foot[0] - body[0] - hip * libm::cos(pitch),
            foot[2] - body[2] + hip * libm::sin(pitch),
        ];
        let length = libm::hypot(x, z);
        let lean = libm::atan2(x, -z);
        // Rotate into the frame in which the leg's axis is vertical.
        let pull = harness.read(&format!("leg/{name}/foot/force"));
        let (along, across) = (
            load * libm::cos(lean) - pull[0] * libm::sin(lean),
            load * libm::sin(lean) + pull[0] * libm::cos(lean),
        );
        let cable = leg.cable_length(harness.value(&format!("leg/{name}/knee/position")));
        let measured = leg.equilibrium(length, torque, cable).unwrap();
        assert!(
            harness.value(&format!("leg/{name}/cable/tension")) == 0.0,
            "the cable is slack"
        );
        // `equilibrium` is refined to 1e-12 rad; the oscillation that remains after 2 s is larger.
        assert!(
            (measured.axial - along).abs() < 1e-5,
            "{name}: {measured:?} {along}"
        );
        assert!(
            (measured.transverse - across).abs() < 1e-5,
            "{name}: {measured:?} {across}"
        );
        let opening = angles[2] - angles[0];
        assert!(
            (measured.opening - opening).abs() < 1e-6,
            "{name}: {measured:?} {opening}"
        );
    }
}

#[test]
fn taut_cable_balances_springs_and_weight() {
    // A leg on a stand with its knee flexed: closed pantograph and cable hold it. Virtual work at
    // foot and hip: gradient of the springs − weight of the foot = tension · gradient of the cable
    // + force · gradient of the rod.
    let robot = robot();
    let leg = Pantograph::new(&robot.legs[0].leg).unwrap();
    for share in [0.7, 0.8, 0.9] {
        let start = leg
            .inverse_closed(Planar::new(0.01, -share * leg.length_max()))
            .unwrap();
        let single_leg = Setup {
            base: Base::Fixed,
            legs: vec!["LF".to_owned()],
            ground: None,
            start: vec![("LF".to_owned(), start)].into(),
            ..setup()
        };
        let mut harness = massless(&robot, &single_leg);
        harness.advance_to_ms(2000);
        let hip = start.hip + leg.hip_reference();
        let foot = leg.foot_of(start).unwrap();
        let pose = leg.pose(libm::sin(hip), libm::cos(hip), foot).unwrap();
        let spring_gradient = leg.spring_gradient(&pose);
        let weight = Planar::new(0.0, 0.03 * G);
        let row = |stop: Stop| {
            let (length, sign) = stop.limits();
            leg.length_gradient(&pose, length) * sign
        };
        let (cable, closed) = (row(Stop::Cable), row(Stop::Closed));
        // Solve the foot's 2 × 2 equilibrium for tension and force of the rod.
        let load = spring_gradient.foot + weight;
        let determinant = cable.foot.x * closed.foot.y - cable.foot.y * closed.foot.x;
        let tension = (load.x * closed.foot.y - load.y * closed.foot.x) / determinant;
        let rod = (cable.foot.x * load.y - cable.foot.y * load.x) / determinant;
        let torque = spring_gradient.hip - tension * cable.hip - rod * closed.hip;
        let measured = harness.value("leg/LF/cable/tension");
        assert!(tension > 5.0 && rod > 0.0, "{tension} {rod}");
        assert!(
            (measured - tension).abs() < 1e-6 * tension,
            "{measured} N, not {tension}"
        );
        let winding = harness.value("leg/LF/knee/torque");
        assert!((winding - 0.025 * tension).abs() < 1e-6, "{winding}");
        let held = harness.value("leg/LF/hip/torque");
        assert!((held - torque).abs() < 1e-6, "{held}, not {torque}");
    }
}

/// The robot as a rigid body: unyielding drives, springs that no load of these tests moves off
/// their stops.
fn rigid_on_slope(slope: f64, friction: f64) -> Harness {
    let mut robot = robot();
    for mount in &mut robot.legs {
        (mount.leg.diagonal.preload, mount.leg.parallel.preload) = (0.05, 0.05);
    }
    let mut setup = on_slope(&robot, slope, friction);
    setup.drives = Drives::Ideal { period: 5e-3 };
    massless(&robot, &setup)
}

#[test]
fn robot_sticks_below_the_friction_angle_and_slides_above_it() {
    for (slope, slides) in [(0.199, false), (0.201, true), (0.3, true)] {
        let friction = 0.2;
        let mut harness = rigid_on_slope(slope, friction);
        let start = harness.read("leg/LH/foot/position");
        harness.advance_to_ms(100);
        let before = harness.read("body/velocity");
        harness.advance_to_ms(500);
        let place = harness.read("leg/LH/foot/position");
        let after = harness.read("body/velocity");
        let measured = libm::hypot(after[0] - before[0], after[2] - before[2]) / 0.4;
        if slides {
            let angle = libm::atan(slope);
            let expected = G * (libm::sin(angle) - friction * libm::cos(angle));
            // The stops yield by the compliance of redundant constraints: 1e-9 of the weight and of
            // the acceleration.
            assert!(
                (measured - expected).abs() < 1e-6 * G,
                "{measured}, not {expected}"
            );
        } else {
            let crept = (place[0] - start[0]).abs();
            assert!(crept < 1e-9 && measured < 1e-9, "{crept} {measured}");
        }
    }
}
