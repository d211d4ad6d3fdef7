//! Facts of the robots of this repository against closed forms, values of the thesis, and the
//! comments of their files.

use std::path::Path;

use super::*;

fn facts_of(name: &str) -> (Robot, RobotFacts) {
    let file = RobotFile::find(name, Path::new("")).unwrap();
    let robot = file.robot().unwrap();
    let facts = robot_facts(&file, &robot).unwrap();
    (robot, facts)
}

fn fact<'a>(facts: &'a RobotFacts, key: &str) -> &'a Fact {
    let mut all = facts.sections.iter().flat_map(|section| &section.facts);
    all.find(|fact| fact.key == key).unwrap()
}

fn near(facts: &RobotFacts, key: &str, expected: f64, tolerance: f64) {
    let found = fact(facts, key).value[0];
    let error = (found / expected - 1.0).abs();
    assert!(error < tolerance, "{key}: {found}, expected {expected}");
}

#[test]
fn cheetah_cub_has_the_values_of_the_thesis_and_of_its_file() {
    let (robot, facts) = facts_of("cheetah-cub");
    near(&facts, "mass", 1.1, 1e-12);
    near(&facts, "weight", 1.1 * 9.81, 1e-12);
    // Comments of the file: 148 mm extended, 66 mm with the knee at 130°.
    near(&facts, "length_max", 0.148, 1e-3);
    near(&facts, "length_min", 0.066, 1e-2);
    near(&facts, "knee_range", (35.0_f64 - 130.0).to_radians(), 1e-3);
    // Thesis, section 2.7.1: 253.27 N/m; the file's first comment: 252 N/m.
    near(&facts, "stiffness_max", 253.27, 1e-2);
    near(&facts, "stiffness_max", 252.0, 3e-3);
    near(&facts, "cable_tension", 2.0 / 0.025, 1e-12);
    near(&facts, "hip_length", 0.2, 1e-12);
    near(&facts, "hip_width", 0.1, 1e-12);
    near(&facts, "leg_mass", 0.05, 1e-12);
    let standing = fact(&facts, "length_standing").value[0];
    near(&facts, "foot_force_hip", 2.0 / standing, 1e-12);
    // √(k/m)/2π with four legs, and with two at the length under twice the load.
    let bounce = |legs: f64, key: &str| {
        let stiffness = fact(&facts, key).value[0];
        (legs * stiffness / robot.mass()).sqrt() / core::f64::consts::TAU
    };
    near(&facts, "bounce_max", bounce(4.0, "stiffness_max"), 1e-12);
    near(&facts, "bounce_half", bounce(2.0, "stiffness_half"), 1e-12);
    // The preload carries the weight on four legs.
    assert!(fact(&facts, "load_give").value[0] > robot.weight() / 4.0);
    assert!(fact(&facts, "stiffness_all").value.is_empty());
    assert_eq!(fact(&facts, "travel_weight").value, [0.0]);
}

#[test]
fn oncilla_is_cheetah_cub_at_another_scale() {
    let (small, large) = (facts_of("cheetah-cub").1, facts_of("oncilla").1);
    // Its file: lengths × s, masses × r, moments of inertia × r s², stiffness × s², s = ∛r; with
    // the digits that the file has. The relative travel under the weight is the same.
    let r: f64 = 5.1 / 1.1;
    let s = libm::cbrt(r);
    for (key, scale, tolerance) in [
        ("mass", r, 1e-3),
        ("length_max", s, 2e-3),
        ("length_min", s, 2e-3),
        ("length_standing", s, 2e-3),
        ("stiffness_max", s * s, 1e-2),
        ("stiffness_half", s * s, 2e-2),
        ("load_give", r, 3e-2),
        ("bounce_half", 1.0 / s.sqrt(), 2e-2),
        ("bounce_max", 1.0 / s.sqrt(), 1e-2),
        ("inertia", r * s * s, 1e-2),
        ("segment_inertia", r * s * s, 1e-2),
        ("pulley_range", 1.0, 1e-2),
    ] {
        for (n, value) in fact(&small, key).value.iter().enumerate() {
            let found = fact(&large, key).value[n];
            let is_near = (found - value * scale).abs() <= tolerance * (value * scale).abs();
            assert!(is_near, "{key}: {found}, expected {}", value * scale);
        }
    }
    let range = &fact(&large, "abduction_range").value;
    assert_eq!(range[..], [-15.0_f64, 25.0].map(f64::to_radians));
    let locked = small.sections.iter().flat_map(|section| &section.facts);
    assert!(locked.into_iter().all(|fact| fact.key != "abduction_range"));
    // 50.03 N on four springs of 27.8 kN/m, and half of 0.33 mm.
    near(
        &large,
        "trunk_depth",
        50.03 / (4.0 * 27.8e3) + 0.165e-3,
        1e-3,
    );
    // Comments of the file: 569 mN·m × 14, and 1166 rpm.
    near(&large, "hip_motor_stall", 0.569 * 14.0, 2e-3);
    near(
        &large,
        "hip_motor_speed",
        1166.0 * core::f64::consts::TAU / 60.0,
        2e-3,
    );
}

#[test]
fn every_fact_names_keys_of_the_file_and_those_that_are_assumed() {
    for name in ["cheetah-cub", "oncilla"] {
        let file = RobotFile::find(name, Path::new("")).unwrap();
        let facts = facts_of(name).1;
        let document: toml_edit::DocumentMut = file.text().parse().unwrap();
        for fact in facts.sections.iter().flat_map(|section| &section.facts) {
            for key in &fact.from {
                let mut item = document.as_item();
                for part in key.split('.') {
                    item = item
                        .get(part)
                        .unwrap_or_else(|| panic!("{}: {key}", fact.key));
                }
            }
        }
        let assumed = |key| &fact(&facts, key).assumed;
        assert!(
            assumed("hip_length").iter().any(|key| key == "mount"),
            "{name}"
        );
        assert!(
            assumed("length_max").iter().any(|key| key == "leg.aslp.l1"),
            "{name}"
        );
        // Mass of the trunk and torque: derived from published values, or a choice.
        assert_eq!(assumed("trunk_mass").len(), 0, "{name}");
    }
    let (_, facts) = facts_of("cheetah-cub");
    let servo = ["actuator.hip.torque"];
    assert_eq!(fact(&facts, "hip_torque").assumed, servo);
    let published: [&str; 0] = [];
    assert_eq!(fact(&facts, "leg_mass").assumed, published);
}

#[test]
fn legs_of_several_kinds_and_a_load_beyond_the_springs_are_reported() {
    let text = RobotFile::find("cheetah-cub", Path::new("")).unwrap();
    let heavy = text.text().replace("\"900 g\"", "\"90 kg\"");
    // The hips of the hind legs half as far behind: they carry two thirds.
    let hip = r#"{ value = "-100 mm", from = "-100.5 mm", to = "-85 mm" }"#;
    let heavy = heavy.replace(hip, "\"-50 mm\"");
    let file = RobotFile::parse("heavy.toml", &heavy).unwrap();
    let robot = file.robot().unwrap();
    let facts = robot_facts(&file, &robot).unwrap();
    let legs: Vec<_> = facts
        .sections
        .iter()
        .map(|section| section.legs.join(" "))
        .collect();
    assert_eq!(legs, ["", "LF RF", "LH RH", ""]);
    let kinds = leg_kinds(&robot).unwrap();
    let loads: f64 = kinds.iter().map(|kind| 2.0 * kind.load).sum();
    assert!((loads - robot.weight()).abs() < 1e-9);
    assert!((kinds[1].load / kinds[0].load - 2.0).abs() < 1e-12);
    let bottomed = fact(&facts, "length_standing");
    assert_eq!(bottomed.value, fact(&facts, "length_min").value);
    assert!(bottomed.note.contains("bottoms out"), "{}", bottomed.note);
    assert!(fact(&facts, "bounce_all").value.is_empty());
}

#[test]
fn comments_are_read_in_every_form_of_a_table() {
    let text = "\
        # ASSUMED: far above.\n\
        \n\
        x = 1 # published\n\
        # SCALED\n\
        y = 1\n\
        z = { w = 1 } # ASSUMED\n\
        [t]\n\
        u.v = 1 # ASSUMED\n";
    let assumed = Assumed::of_text(text);
    for (key, expected) in [
        ("x", ""),
        ("y", "y"),
        ("z.w", "z"),
        ("t", "t.u.v"),
        ("t.u.v", "t.u.v"),
        ("t.u.vw", ""),
    ] {
        let found: Vec<_> = assumed.about(key).collect();
        assert_eq!(found.concat(), expected, "{key}");
    }
}
