//! Robots that are written and read back.

use std::path::Path;

use proptest::prelude::*;
use twinrig_description::{Imported, Language, import, urdf};
use twinrig_robot::{Abduction, Actuators, Leg, LegMass, LegMount, Robot, RobotFile, Servo};

/// Greatest relative deviation: files have 13 digits.
const TOLERANCE: f64 = 1e-12;

prop_compose! {
    /// Legs of which a pantograph can be made.
    fn legs()(
        l1 in 0.02_f64..0.4,
        l2 in 0.02_f64..0.4,
        b in 0.02_f64..0.4,
        offset in 0.1_f64..0.9,
        q2_ref in 0.05_f64..1.2,
        bend in 0.1_f64..0.95,
        masses in prop::array::uniform4(1e-3_f64..1.0),
        friction in prop::array::uniform3(1e-4_f64..0.1),
    ) -> Leg {
        let mut leg = Leg::example();
        (leg.l1, leg.l2, leg.q2_ref) = (l1, l2, q2_ref);
        leg.l_delta = offset * l1.min(l2);
        leg.l3 = leg.l_delta + b;
        let diagonal = |angle: f64| {
            (l2 * l2 + leg.l_delta * leg.l_delta + 2.0 * l2 * leg.l_delta * libm::cos(angle)).sqrt()
        };
        leg.diagonal_min = diagonal(q2_ref + bend * (2.9 - q2_ref));
        leg.parallel_travel = 0.4 * (diagonal(q2_ref) + leg.l_delta - l2);
        let [l1, l2, l3, foot] = masses;
        leg.mass = LegMass { l1, l2, l3, foot, lumped_foot: foot };
        [leg.joint_friction.hip, leg.joint_friction.knee, leg.joint_friction.ankle] = friction;
        leg
    }
}

prop_compose! {
    fn abductions()(
        places in prop::array::uniform2(-0.05_f64..0.05),
        angles in prop::array::uniform2(0.01_f64..1.5),
        friction in 1e-4_f64..0.1,
    ) -> Abduction {
        let ([offset, height], [abduction_max, adduction_max]) = (places, angles);
        Abduction { offset, height, abduction_max, adduction_max, friction }
    }
}

prop_compose! {
    fn robots()(
        equal in any::<bool>(),
        legs in prop::array::uniform4(legs()),
        abduction in prop::option::of(abductions()),
        at in prop::array::uniform3(0.01_f64..0.5),
        mass in 0.1_f64..50.0,
        inertia in prop::array::uniform3(1e-3_f64..1.1e-3),
        drives in prop::array::uniform6(0.1_f64..30.0),
    ) -> Robot {
        let mut robot = Robot::example();
        robot.trunk.mass = mass;
        robot.trunk.inertia = inertia;
        let [x, y, z] = at;
        let corners = [("LF", x, y), ("RF", x, -y), ("LH", -x, y), ("RH", -x, -y)];
        let mounts = corners.into_iter().zip(&legs).map(|((name, x, y), own)| LegMount {
            name: name.to_owned(),
            hip: [x, y, z],
            kind: if equal { "aslp" } else { name }.to_owned(),
            leg: if equal { legs[0].clone() } else { own.clone() },
        });
        robot.legs = mounts.collect();
        for mount in &mut robot.legs {
            mount.leg.abduction = abduction;
        }
        let actuators = &mut robot.actuators;
        let [hip, hip_speed, knee, knee_speed, torque, speed] = drives;
        (actuators.hip.torque, actuators.hip.speed) = (hip, hip_speed);
        (actuators.knee.torque, actuators.knee.speed) = (knee, knee_speed);
        actuators.abduction = abduction.map(|_| Servo { torque, speed, ..actuators.hip });
        robot
    }
}

/// Returns what a description has of a robot.
fn described(robot: &Robot) -> Vec<(String, f64)> {
    let mut values = vec![("trunk".to_owned(), robot.trunk.mass)];
    let mut add = |name: &str, numbers: &[f64]| {
        values.extend(numbers.iter().map(|number| (name.to_owned(), *number)));
    };
    add("inertia", &robot.trunk.inertia);
    add("size", &robot.trunk.size);
    for LegMount { name, hip, leg, .. } in &robot.legs {
        let (mass, joints) = (leg.mass, leg.joint_friction);
        add(&format!("{name} hip"), hip);
        if let Some(joint) = leg.abduction {
            let angles = [joint.abduction_max, joint.adduction_max];
            add(&format!("{name} abduction"), &angles);
            add(&format!("{name} abduction"), &[joint.friction]);
            // Differences of places, which are of decimetres.
            let axis = [1.0 + joint.offset, 1.0 + joint.height];
            add(&format!("{name} axis"), &axis);
        }
        let lengths = [
            leg.l1,
            leg.l2,
            leg.l3,
            leg.l_delta,
            leg.q2_ref,
            leg.diagonal_min,
        ];
        add(&format!("{name} lengths"), &lengths);
        add(
            &format!("{name} masses"),
            &[mass.l1, mass.l2, mass.l3 + mass.foot],
        );
        // A difference of masses: as precise as their sum.
        add(&format!("{name} foot"), &[mass.l3 + mass.foot + mass.foot]);
        add(
            &format!("{name} friction"),
            &[joints.hip, joints.knee, joints.ankle],
        );
    }
    let Actuators {
        hip,
        knee,
        abduction,
    } = &robot.actuators;
    for servo in [Some(hip), Some(knee), abduction.as_ref()]
        .into_iter()
        .flatten()
    {
        add("drive", &[servo.torque, servo.speed]);
    }
    values
}

fn read(imported: &Imported) -> Robot {
    RobotFile::parse("again.toml", &imported.text)
        .unwrap()
        .robot()
        .unwrap()
}

fn check(robot: &Robot) -> Imported {
    let text = urdf(robot).unwrap();
    let imported = import(Language::Urdf, "robot.urdf", &text, None).unwrap();
    let again = read(&imported);
    assert_eq!(again.name, robot.name);
    let (ours, found) = (described(robot), described(&again));
    assert_eq!(found.len(), ours.len());
    for ((name, ours), (of, found)) in ours.into_iter().zip(found) {
        assert_eq!(name, of);
        let deviation = (found - ours).abs();
        assert!(
            deviation <= TOLERANCE * ours.abs(),
            "{name}: {found} instead of {ours}"
        );
    }
    imported
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn exported_robot_is_read_back_with_its_geometry_and_masses(robot in robots()) {
        check(&robot);
    }
}

/// Oncilla's description, in which axes and limits of the left legs are mirrored.
#[test]
fn joints_of_abduction_are_read_with_either_sense_of_their_axis() {
    let robot = RobotFile::find("oncilla", Path::new("")).unwrap();
    let robot = robot.robot().unwrap();
    let text = urdf(&robot).unwrap();
    let axis = robot.legs[0].abduction_axis().unwrap();
    let [least, greatest] = axis.range;
    let limits = |least: f64, greatest: f64| format!("lower=\"{least}\" upper=\"{greatest}\"");
    let left = limits(least, greatest);
    assert_eq!(text.matches(&left).count(), 2);
    let read = |text: &str| import(Language::Urdf, "robot.urdf", text, None).unwrap();
    let mut mirrored = String::new();
    for joint in text.split_inclusive("</joint>") {
        let is_left = ["LF_abduction", "LH_abduction"]
            .iter()
            .any(|name| joint.contains(&format!("<joint name=\"{name}\"")));
        if is_left {
            let turned = joint.replace("<axis xyz=\"1 0 0\"/>", "<axis xyz=\"-1 0 0\"/>");
            mirrored += &turned.replace(&left, &limits(-greatest, -least));
        } else {
            mirrored += joint;
        }
    }
    assert_ne!(mirrored, text);
    assert_eq!(read(&mirrored).text, read(&text).text);
    // Beyond a right angle.
    let wide = read(&text.replace(&left, &limits(least, 3.0)));
    let joint = self::read(&wide).legs[0].leg.abduction.unwrap();
    assert!((joint.abduction_max - core::f64::consts::FRAC_PI_2).abs() < 1e-9);
    // On one side of zero, without travel, or of three legs.
    for (from, to) in [
        (left.clone(), limits(0.1, greatest)),
        (left.clone(), limits(0.0, 0.0)),
        (
            "name=\"RH_abduction\" type=\"revolute\"".to_owned(),
            "name=\"RH_abduction\" type=\"fixed\"".to_owned(),
        ),
    ] {
        assert!(text.contains(&from));
        let locked = read(&text.replace(&from, &to));
        assert!(
            locked
                .notes
                .iter()
                .any(|note| note.contains("are locked at zero"))
        );
        assert!(
            self::read(&locked)
                .legs
                .iter()
                .all(|mount| mount.leg.abduction.is_none())
        );
    }
}

#[test]
fn robots_of_every_build_are_read_back_with_one_kind_of_leg() {
    for (name, _) in RobotFile::embedded() {
        let robot = RobotFile::find(name, Path::new(""))
            .unwrap()
            .robot()
            .unwrap();
        let imported = check(&robot);
        assert_eq!(
            imported.text.matches("[leg.aslp]\n").count(),
            1,
            "{}",
            imported.text
        );
        let marks = imported.text.matches("# ASSUMED").count();
        // Once in the explanation of the marks.
        assert_eq!(marks, imported.assumed, "{}", imported.text);
        assert!(imported.notes.is_empty());
    }
}

#[test]
fn what_the_description_lacks_is_cheetah_cubs_scaled() {
    // Read back, it has Cheetah-cub's own springs.
    let robot = RobotFile::find("cheetah-cub", Path::new(""))
        .unwrap()
        .robot()
        .unwrap();
    let imported = import(Language::Urdf, "robot.urdf", &urdf(&robot).unwrap(), None).unwrap();
    let again = read(&imported);
    let (ours, found) = (&robot.legs[0].leg, &again.legs[0].leg);
    for (ours, found) in [
        (ours.diagonal.stiffness, found.diagonal.stiffness),
        (ours.parallel.preload, found.parallel.preload),
        (ours.pulley_radius, found.pulley_radius),
        (ours.mass.lumped_foot, found.mass.lumped_foot),
        (
            ours.compliance.unwrap().sole.damping,
            found.compliance.unwrap().sole.damping,
        ),
        (robot.actuators.knee.lag, again.actuators.knee.lag),
    ] {
        assert!(
            (found - ours).abs() <= TOLERANCE * ours,
            "{found} instead of {ours}"
        );
    }
}
