//! The robots of this repository, and the search for robot files.

use std::fs;
use std::path::Path;

use twinrig_document::{Document, Item, print_quantity};
use twinrig_robot::{Robot, RobotError, RobotFile};

fn robot(name: &str) -> Robot {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    RobotFile::find(name, folder).unwrap().robot().unwrap()
}

#[test]
fn robots_have_the_masses_of_their_sources() {
    assert!((robot("cheetah-cub").mass() - 1.1).abs() < 1e-12);
    assert!((robot("oncilla").mass() - 5.1).abs() < 1e-3);
}

#[test]
fn extended_leg_is_148_mm_and_the_stop_is_at_130_degrees() {
    let leg = &robot("cheetah-cub").legs[0].leg;
    let side = leg.l1 + leg.l3 - leg.l_delta;
    let reach =
        |q2: f64| (leg.l2 * leg.l2 + side * side + 2.0 * leg.l2 * side * libm::cos(q2)).sqrt();
    assert!((reach(leg.q2_ref) - 0.148).abs() < 2e-4);
    let bent = 130_f64.to_radians();
    let diagonal = (leg.l2 * leg.l2
        + leg.l_delta * leg.l_delta
        + 2.0 * leg.l2 * leg.l_delta * libm::cos(bent))
    .sqrt();
    assert!((leg.diagonal_min - diagonal).abs() < 1e-5);
    assert!(reach(bent) < 0.1, "the gaits need a leg of 100 mm");
}

#[test]
fn trunk_inertias_are_those_of_uniform_boxes() {
    for name in ["cheetah-cub", "oncilla"] {
        let trunk = robot(name).trunk;
        let [l, w, h] = trunk.size;
        let box_of = |a: f64, b: f64| trunk.mass / 12.0 * (a * a + b * b);
        let expected = [box_of(w, h), box_of(l, h), box_of(l, w)];
        for (moment, expected) in trunk.inertia.iter().zip(expected) {
            assert!(
                (moment / expected - 1.0).abs() < 1e-2,
                "{name}: {moment} {expected}"
            );
        }
    }
}

#[test]
fn oncilla_is_cheetah_cub_at_the_scale_that_its_file_states() {
    let (small, large) = (robot("cheetah-cub"), robot("oncilla"));
    let r = 5.1 / 1.1;
    let s = libm::cbrt(r);
    let (a, b) = (&small.legs[0], &large.legs[0]);
    let ratios = [
        (b.leg.l1 / a.leg.l1, s),
        (b.leg.l2 / a.leg.l2, s),
        (b.leg.l3 / a.leg.l3, s),
        (b.leg.l_delta / a.leg.l_delta, s),
        (b.leg.diagonal_min / a.leg.diagonal_min, s),
        (b.leg.parallel_travel / a.leg.parallel_travel, s),
        (b.leg.pulley_radius / a.leg.pulley_radius, s),
        (b.leg.diagonal.preload / a.leg.diagonal.preload, s),
        (b.hip[0] / a.hip[0], s),
        (b.hip[1] / a.hip[1], s),
        (b.leg.diagonal.stiffness / a.leg.diagonal.stiffness, r / s),
        (b.leg.parallel.stiffness / a.leg.parallel.stiffness, r / s),
        (
            b.leg.joint_friction.hip / a.leg.joint_friction.hip,
            r * libm::pow(s, 1.5),
        ),
        (b.leg.mass.l1 / a.leg.mass.l1, r),
        (b.leg.mass.lumped_foot / a.leg.mass.lumped_foot, r),
    ];
    for (index, (actual, expected)) in ratios.iter().enumerate() {
        assert!(
            (actual / expected - 1.0).abs() < 2e-3,
            "{index}: {actual} {expected}"
        );
    }
    let toe = |robot: &Robot| robot.legs[0].leg.toe.map(|toe| toe.stiffness).unwrap();
    assert!((toe(&large) / toe(&small) / (r * s) - 1.0).abs() < 2e-3);
}

#[test]
fn motors_of_oncilla_are_consistent_with_its_servos() {
    let oncilla = robot("oncilla");
    assert!(robot("cheetah-cub").motors.is_none() && oncilla.actuators.abduction.is_some());
    let motors = oncilla.motors.unwrap();
    for (motor, servo) in [
        (motors.hip, oncilla.actuators.hip),
        (motors.knee, oncilla.actuators.knee),
    ] {
        let constant = motor.torque_constant * motor.gear;
        let ratios = [
            motor.voltage * constant / motor.resistance / servo.torque,
            motor.voltage / constant / servo.speed,
            motor.inertia * motor.gear * motor.gear / servo.inertia,
        ];
        for ratio in ratios {
            assert!((ratio - 1.0).abs() < 2e-3, "{ratio}");
        }
    }
}

#[test]
fn every_value_of_a_robot_file_states_its_source() {
    for text in [
        include_str!("../../../../robots/cheetah-cub.toml"),
        include_str!("../../../../robots/oncilla.toml"),
    ] {
        let figures = text.lines().filter(|line| {
            let opened = ["inertia = [", "size = ["].contains(line);
            let of_mount = ["name", "leg", "hip = [", "    {"];
            let of_mount = of_mount.iter().any(|key| line.starts_with(key));
            let has_value = line.contains('=') && !line.starts_with(['#', '[']);
            has_value && !opened && (!of_mount || line.contains('#'))
        });
        for line in figures {
            let comment = line.split_once('#').map_or("", |(_, comment)| comment);
            let has_source = ["T", "P", "M", "D", "SCALED", "ASSUMED"]
                .iter()
                .any(|source| {
                    comment
                        .split([' ', ',', ':', ';', '.'])
                        .any(|word| word == *source)
                });
            let has_source =
                has_source || text.contains("# D: √") && line.starts_with("diagonal_min");
            assert!(has_source, "no source: {line}");
        }
    }
}

#[test]
fn intervals_change_no_value() {
    let plain = RobotFile::parse("plain.toml", include_str!("../plain.toml")).unwrap();
    assert!(plain.assumed().is_empty());
    assert_eq!(plain.robot().unwrap(), robot("cheetah-cub"));
}

/// Every value that is marked as assumed has an interval. Those of the trunk and of the mounts are
/// marked for all of them together.
#[test]
fn assumed_values_have_intervals() {
    for (name, text) in RobotFile::embedded() {
        let marked = |line: &&str| line.contains("# ASSUMED") || line.contains("# SCALED");
        let bare = text
            .lines()
            .filter(marked)
            .find(|line| !line.contains("from =") && !line.starts_with('#'));
        assert_eq!(bare, None, "{name}");
        let file = RobotFile::find(name, Path::new("/")).unwrap();
        let hips = file.assumed().iter();
        let hips = hips.filter(|one| one.key.starts_with("mount.")).count();
        assert_eq!(hips, 12, "{name}");
    }
}

/// Each combination of the ends of the intervals of a leg can be built.
#[test]
fn ends_of_intervals_may_be_combined() {
    let keys = [
        "l1",
        "l2",
        "l3",
        "l_delta",
        "q2_ref",
        "parallel_travel",
        "diagonal_min",
        "diagonal.preload",
        "parallel.preload",
    ];
    for (name, _) in RobotFile::embedded() {
        let file = RobotFile::find(name, Path::new("/")).unwrap();
        let ends = keys.map(|key| {
            let key = format!("leg.aslp.{key}");
            let mut assumed = file.assumed().iter();
            let one = assumed.find(|one| one.key == key).unwrap();
            let end = |end| format!("{key} = '{}'\n", print_quantity(end, one.unit));
            [end(one.from), end(one.to)]
        });
        for number in 0..1_usize << keys.len() {
            let of = ends
                .iter()
                .enumerate()
                .map(|(bit, ends)| ends[number >> bit & 1].as_str());
            let text = format!("[override]\n{}", of.collect::<String>());
            let overrides = Document::parse("ends.toml", &text).unwrap();
            let overrides = overrides.check(|table| table.required("override", Item::overrides));
            let mut file = file.clone();
            file.override_with(&overrides.unwrap()).unwrap();
            assert!(file.robot().is_ok(), "{name}: {text}");
        }
    }
}

#[test]
fn nearest_folder_precedes_its_ancestors_and_the_embedded_copy() {
    let root = tempfile("nearest");
    let inner = root.join("a/b");
    fs::create_dir_all(inner.join("robots")).unwrap();
    fs::create_dir_all(root.join("robots")).unwrap();
    let text = include_str!("../../../../robots/cheetah-cub.toml");
    let named = |name: &str| text.replacen("Cheetah-cub\"", &format!("{name}\""), 1);
    fs::write(root.join("robots/cheetah-cub.toml"), named("upper")).unwrap();
    let name_from = |folder: &Path| {
        RobotFile::find("cheetah-cub", folder)
            .unwrap()
            .robot()
            .unwrap()
            .name
    };
    assert_eq!(name_from(&inner), "upper");
    fs::write(inner.join("robots/cheetah-cub.toml"), named("lower")).unwrap();
    assert_eq!(name_from(&inner), "lower");
    assert_eq!(name_from(&root), "upper");
    fs::write(inner.join("mine.toml"), named("path")).unwrap();
    let path = RobotFile::find("mine.toml", &inner)
        .unwrap()
        .robot()
        .unwrap();
    assert_eq!(path.name, "path");
    fs::write(root.join("robots/longer.toml"), named("longer")).unwrap();
    assert_eq!(
        RobotFile::names(&inner),
        [
            "cheetah-cub",
            "cheetah-cub-sts3215",
            "half-cub-xl330",
            "longer",
            "oncilla"
        ]
    );
    fs::remove_dir_all(&root).unwrap();
}

#[test]
fn unknown_robot_is_reported_with_the_nearest_name() {
    let error = RobotFile::find("chetah-cub", Path::new("/")).unwrap_err();
    let RobotError::NotFound { help, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(help, "did you mean `cheetah-cub`?");
    let error = RobotFile::find("no/such.toml", Path::new("/")).unwrap_err();
    assert!(error.to_string().contains("/no/such.toml"), "{error}");
}

#[test]
fn override_changes_one_value_and_is_validated() {
    let overridden = |text: &str| {
        let scenario = Document::parse("run.toml", text).unwrap();
        let overrides = scenario
            .check(|table| table.required("override", twinrig_document::Item::overrides))
            .unwrap();
        let mut file = RobotFile::find("cheetah-cub", Path::new("/")).unwrap();
        file.override_with(&overrides).unwrap();
        file.robot()
    };
    let robot = overridden("[override]\nleg.aslp.parallel.preload = '0 mm'").unwrap();
    assert_eq!(robot.legs[3].leg.parallel.preload, 0.0);
    assert_eq!(robot.legs[3].leg.diagonal.preload, 0.003);
    let error = overridden("[override]\n'leg.aslp.paralel.preload' = '0 mm'").unwrap_err();
    insta::assert_snapshot!(error);
}

fn tempfile(name: &str) -> std::path::PathBuf {
    let path = std::env::temp_dir().join(format!("twinrig-robot-{}-{name}", std::process::id()));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}
