//! Robots read from MJCF.

use proptest::prelude::*;
use twinrig_description::{Imported, Language, import};
use twinrig_document::DocumentError;
use twinrig_robot::{Robot, RobotFile};

/// A quadruped with legs of two segments, whose masses are those of shapes.
const PUP: &str = include_str!("../../../../scenarios/models/pup.xml");

fn read(text: &str) -> Result<Imported, DocumentError> {
    import(Language::Mjcf, "pup.xml", text, Some("Pup"))
}

fn robot(text: &str) -> Robot {
    let made = read(text).unwrap();
    RobotFile::parse("pup.toml", &made.text)
        .unwrap()
        .robot()
        .unwrap()
}

/// Returns the model with all occurrences of `from` replaced; there must be some.
fn changed(from: &str, to: &str) -> String {
    assert!(PUP.contains(from), "{from}");
    PUP.replace(from, to)
}

#[test]
fn pup_has_the_masses_lengths_and_drives_of_its_model() {
    let pup = robot(PUP);
    let close = |found: f64, expected: f64| {
        assert!(
            (found - expected).abs() <= 1e-12,
            "{found} instead of {expected}"
        );
    };
    close(pup.trunk.mass, 2.0);
    // Half edges of 15, 5 and 3 cm.
    for (found, [a, b]) in pup
        .trunk
        .inertia
        .iter()
        .zip([[0.05, 0.03], [0.15, 0.03], [0.15, 0.05]])
    {
        close(*found, 2.0 / 3.0 * (a * a + b * b));
    }
    for mount in &pup.legs {
        let (leg, fore) = (&mount.leg, mount.name.ends_with('F'));
        close(mount.hip[0], if fore { 0.12 } else { -0.12 });
        close(
            mount.hip[1],
            if mount.name.starts_with('L') {
                0.06
            } else {
                -0.06
            },
        );
        // The first segment of 10 cm in halves.
        close(leg.l1 + leg.l3 - leg.l_delta, 0.1);
        close(leg.l2, 0.1);
        close(leg.mass.l1 + leg.mass.l3, 0.1);
        close(leg.mass.l2 + leg.mass.foot, 0.06);
        // A uniform capsule, with a ball of 10 g at its end.
        close(leg.mass.foot, 0.01);
        close(leg.joint_friction.knee, 0.05);
    }
    close(pup.actuators.knee.torque, 4.0);
    let notes = read(PUP).unwrap().notes.join("\n");
    assert!(
        notes.contains("two segments") && notes.contains("bends backward"),
        "{notes}"
    );
}

#[test]
fn spellings_of_one_model_make_one_robot() {
    // Thighs turned by 0.3 rad about y, in every spelling of an orientation.
    let turned = |how: &str| changed("_thigh\" pos=", &format!("_thigh\" {how} pos="));
    let (sine, cosine) = (libm::sin(0.3), libm::cos(0.3));
    let (half_sine, half_cosine) = (libm::sin(0.15), libm::cos(0.15));
    let expected = robot(&turned("axisangle=\"0 2 0 0.3\""));
    for how in [
        format!("quat=\"{} 0 {} 0\"", 3.0 * half_cosine, 3.0 * half_sine),
        "euler=\"0 0.3 0\"".to_owned(),
        format!("xyaxes=\"{cosine} 0 {} 0 1 0\"", -sine),
        format!("zaxis=\"{sine} 0 {cosine}\""),
    ] {
        assert_eq!(robot(&turned(&how)), expected, "{how}");
    }
    let pup = robot(PUP);
    // Degrees, the default; torques of joints; a class by inheritance; masses given.
    let degrees = format!("range=\"0 {}\"", 2.4_f64.to_degrees());
    let in_degrees = changed("range=\"0 2.4\"", &degrees).replace("angle=\"radian\" ", "");
    assert_eq!(robot(&in_degrees), pup);
    let limits = changed("forcerange=\"-4 4\"", "")
        .replace("damping=", "actuatorfrcrange=\"-4 4\" damping=");
    assert_eq!(robot(&limits), pup);
    let inherited = changed(
        "class=\"knee\">",
        "class=\"knee\"><default class=\"shin\"/>",
    );
    let inherited = inherited.replace("_knee\" class=\"knee\"", "_knee\" class=\"shin\"");
    assert_eq!(robot(&inherited), pup);
    let given = changed(
        "<geom fromto=\"0 0 0 0 0 -0.1\" mass=\"0.1\"/>",
        "<inertial pos=\"0 0 -0.05\" mass=\"0.1\"/><geom type=\"mesh\" mesh=\"thigh\"/>",
    );
    assert_eq!(robot(&given), pup);
}

#[test]
fn mistakes_are_named_at_their_place() {
    let table: &[(&str, &str, &[&str])] = &[
        (
            "<mujoco model=\"pup\">",
            "<mujoco model=\"pup\"><include file=\"legs.xml\"/>",
            &["<include> is not read", "one file", "pup.xml:3:21"],
        ),
        ("<worldbody>", "<world>", &["not XML", "pup.xml:"]),
        (
            "mass=\"2\"",
            "mass=\"two\"",
            &["`two` is not a number", "pup.xml:24:"],
        ),
        (
            "type=\"box\"",
            "type=\"mesh\" mesh=\"t\"",
            &["the mass of the mesh is not known", "pup.xml:24:"],
        ),
        (
            "<joint name=\"lf_knee\" class=\"knee\"/>",
            "<joint name=\"lf_knee\" type=\"slide\"/>",
            &["`lf_knee` is no hinge", "pup.xml:31:"],
        ),
        (
            "<joint name=\"lf_knee\" class=\"knee\"/>",
            "",
            &["hinges about y", "pup.xml:27:"],
        ),
        (
            "<joint axis=\"0 1 0\"",
            "<joint axis=\"0 0 1\"",
            &["neither along nor across", "pup.xml:28:"],
        ),
        (
            "fromto=\"0 0 0 0 0 -0.1\"",
            "fromto=\"0 0 0 0 0 0\"",
            &["no length", "pup.xml:"],
        ),
        (
            "<freejoint/>",
            "<freejoint/></body><body name=\"two\"><freejoint/>",
            &["two robots", "pup.xml:23:"],
        ),
    ];
    let mut wrong: Vec<String> = Vec::new();
    for (from, to, words) in table {
        match read(&changed(from, to)) {
            Ok(_) => wrong.push(format!("{from} → {to} is accepted")),
            Err(error) => {
                let message = error.to_string();
                let absent = words.iter().filter(|word| !message.contains(**word));
                wrong.extend(
                    absent.map(|word| format!("{from} → {to}: `{word}` is not in\n{message}")),
                );
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn depth_of_a_model_is_no_problem() {
    let body = "<body><joint axis=\"0 1 0\"/><inertial pos=\"0 0 -1\" mass=\"1\"/>";
    let text = format!(
        "<mujoco><worldbody>{}{}</worldbody></mujoco>",
        body.repeat(20_000),
        "</body>".repeat(20_000)
    );
    assert!(read(&text).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// A part of the text is lost, doubled, or replaced.
    #[test]
    fn damaged_model_is_refused_or_makes_a_valid_file(
        from in 0_usize..PUP.len(),
        length in 0_usize..60,
        insert in "[ -~]{0,8}|[0-9.e+-]{1,6}",
    ) {
        let mut text = PUP.to_owned();
        text.replace_range(from..(from + length).min(PUP.len()), &insert);
        if let Ok(made) = read(&text) {
            RobotFile::parse("pup.toml", &made.text).unwrap().robot().unwrap();
        }
    }
}
