//! Values of a robot file that contradict each other, as a slip of a unit or of an exponent does:
//! each lies within its own range, and no robot has all of them.

use twinrig_document::{Problem, Warning, print_quantity};
use twinrig_kernel::Unit;
use twinrig_robot::leg::{LegError, Pantograph};
use twinrig_robot::{LegMount, Robot, RobotFile};

/// Least compression of a spring by the share of the weight, as a share of the length of the leg:
/// one that gives by less is a rod, and no spring.
const GIVE_LEAST: f64 = 1e-4;
/// Stall torque over weight times leg length: 1 holds the robot on one horizontal leg.
const TORQUE: [f64; 2] = [0.02, 100.0];
/// Least mass of the trunk, as a share of that of the legs.
const TRUNK_LEAST: f64 = 0.1;
/// Least knee angle of the extended leg \[rad\]: a leg nearer to the straight one than 2° is
/// straight for every purpose, and 2° is more than 1 rad written as degrees.
const KNEE_LEAST: f64 = 0.035;
/// Greatest distance of a payload from the middle of the trunk, in lengths of the trunk.
const PAYLOAD_MOST: f64 = 2.0;
/// Names of the legs of a quadruped.
const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

mod code {
    pub(super) const SPRINGS: &str = "springs-and-weight";
    pub(super) const TORQUE: &str = "torque-and-weight";
    pub(super) const MASS: &str = "trunk-and-legs";
    pub(super) const STRAIGHT: &str = "straight-leg";
    pub(super) const LEGS: &str = "missing-leg";
    pub(super) const PAYLOAD: &str = "payload-beyond-trunk";
}

/// Returns a warning for each contradiction, and those of the file. Every run asks, so that it
/// takes some equilibria of a leg and no more. A leg that forms no pantograph has no warning: it is
/// an error elsewhere.
pub(crate) fn warnings(file: &RobotFile, robot: &Robot) -> Vec<Warning> {
    let warning = |code, key: &str, message: String, help: &str| Warning {
        code,
        problem: match file.place(key) {
            Some(place) => Problem::at(&place, message, help),
            None => Problem::of_file(file.file(), message, help),
        },
    };
    let mut warnings = file.warnings();
    let (mut longest, mut last) = (0.0_f64, None);
    for mount in &robot.legs {
        // Legs of one kind stand together in files, and mostly bear the same.
        let same = (&mount.leg, robot.standing_load(mount).to_bits());
        if last.replace(same) == Some(same) {
            continue;
        }
        let key = |key: &str| format!("leg.{}.{key}", mount.kind);
        if let Ok((length, message)) = springs(robot, mount) {
            longest = longest.max(length);
            let help = "check the units of `stiffness` and of the masses";
            let of = |message| warning(code::SPRINGS, &key("diagonal"), message, help);
            warnings.extend(message.map(of));
        }
        if mount.leg.q2_ref < KNEE_LEAST {
            let angle = mount.leg.q2_ref.to_degrees();
            let message = format!("the extended leg is straight: its knee is at {angle:.2}°");
            let help = "check the unit: `deg` or `rad`";
            warnings.push(warning(code::STRAIGHT, &key("q2_ref"), message, help));
        }
    }
    let moment = robot.weight() * longest;
    let servos = [("hip", robot.actuators.hip), ("knee", robot.actuators.knee)];
    for (name, servo) in servos {
        let share = servo.torque / moment;
        if !(TORQUE[0]..=TORQUE[1]).contains(&share) {
            let message = format!(
                "the torque of the servo is {share:.2e} times weight × leg length ({})",
                print_quantity(moment, Unit::NewtonMeter)
            );
            let help = "check the units of `torque` and of the masses";
            let key = format!("actuator.{name}.torque");
            warnings.push(warning(code::TORQUE, &key, message, help));
        }
    }
    let of_legs: f64 = robot.legs.iter().map(|mount| mount.leg.mass.total()).sum();
    if robot.trunk.mass < TRUNK_LEAST * of_legs {
        let message = format!(
            "the trunk weighs less than a tenth of the legs ({})",
            print_quantity(of_legs, Unit::Kilogram)
        );
        let help = "check the units of the masses";
        warnings.push(warning(code::MASS, "trunk.mass", message, help));
    }
    let [length, width, height] = robot.trunk.size;
    let most = PAYLOAD_MOST * length.max(width).max(height);
    let distance = |at: [f64; 3]| at.iter().map(|x| x * x).sum::<f64>().sqrt();
    let distances = robot.trunk.payloads.iter().map(|load| distance(load.at));
    let farthest = distances.fold(0.0, f64::max);
    if farthest > most {
        let message = format!(
            "a payload is {} from the middle of a trunk that is {} long",
            print_quantity(farthest, Unit::Meter),
            print_quantity(length, Unit::Meter)
        );
        let help = "check the unit of `at` in [[payload]]";
        warnings.push(warning(code::PAYLOAD, "trunk.size", message, help));
    }
    if let Some(leg) = missing_leg(robot) {
        let message = format!("three legs of a quadruped: there is no {leg}");
        let help = format!("add a [[mount]] name = \"{leg}\", or name the legs otherwise");
        warnings.push(warning(code::LEGS, "mount", message, &help));
    }
    warnings
}

/// Returns the greatest length of a leg \[m\], and a message where its springs do not fit to the
/// weight.
fn springs(robot: &Robot, mount: &LegMount) -> Result<(f64, Option<String>), LegError> {
    let leg = Pantograph::new(&mount.leg)?;
    let (load, length) = (robot.standing_load(mount), leg.length_max());
    let shown = print_quantity(load, Unit::Newton);
    let bottomed = leg.length_min() * (1.0 + 1e-6);
    if leg.equilibrium(bottomed, 0.0, f64::INFINITY)?.axial < load {
        let message = format!(
            "the springs do not bear the weight: under its share of {shown} the leg bottoms out"
        );
        return Ok((length, Some(message)));
    }
    let stiffest = mount
        .leg
        .diagonal
        .stiffness
        .max(mount.leg.parallel.stiffness);
    let give = load / (stiffest * length);
    let message = (give < GIVE_LEAST).then(|| {
        format!("a spring that gives by {give:.1e} of the leg's length under {shown} is a rod")
    });
    Ok((length, message))
}

/// Returns the only leg of [`LEGS`] that a robot with three of them does not have.
fn missing_leg(robot: &Robot) -> Option<&'static str> {
    let has = |leg: &&str| robot.legs.iter().any(|mount| mount.name == **leg);
    let mut missing = LEGS.into_iter().filter(|leg| !has(leg));
    let leg = missing.next()?;
    (missing.next().is_none() && robot.legs.len() == 3).then_some(leg)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the codes of the warnings of Cheetah-cub with a line of its file replaced.
    fn codes(from: &str, to: &str) -> Vec<&'static str> {
        let (_, text) = RobotFile::embedded()[0];
        assert!(text.contains(from), "{from}");
        let file = RobotFile::parse("robot.toml", &text.replacen(from, to, 1)).unwrap();
        let robot = file.robot().unwrap();
        let warnings = warnings(&file, &robot);
        assert!(
            warnings
                .iter()
                .all(|warning| warning.problem.place.is_some())
        );
        warnings.iter().map(|warning| warning.code).collect()
    }

    #[test]
    fn slips_of_units_are_warned_about() {
        for (from, to, code) in [
            (r#"mass = "900 g""#, r#"mass = "2.02 g""#, code::MASS),
            (r#"mass = "900 g""#, r#"mass = "900 kg""#, code::SPRINGS),
            ("4400 N/m", "4400 N/mm", code::SPRINGS),
            ("4400 N/m", "4.5 N/m", code::SPRINGS),
            (
                r#"q2_ref = { value = "35 deg", from = "30 deg""#,
                r#"q2_ref = { value = "0.61 deg", from = "0.6 deg""#,
                code::STRAIGHT,
            ),
            (
                r#"torque = { value = "2 N·m", from = "1.5 N·m", to = "2.5 N·m" }"#,
                r#"torque = "5000 N·m""#,
                code::TORQUE,
            ),
            (
                "[[mount]]\nname = \"RH\"",
                "[[mount]]\nname = \"XX\"",
                "none",
            ),
        ] {
            let found = codes(from, to);
            assert_eq!(
                found.contains(&code),
                code != "none",
                "{from} → {to}: {found:?}"
            );
        }
        let (_, text) = RobotFile::embedded()[0];
        let (three, _) = text.split_once("[[mount]]\nname = \"RH\"").unwrap();
        let (_, drives) = text.split_once("# Kondo").unwrap();
        let file = RobotFile::parse("robot.toml", &format!("{three}#{drives}")).unwrap();
        let robot = file.robot().unwrap();
        assert_eq!(warnings(&file, &robot)[0].code, code::LEGS);
    }

    #[test]
    fn robots_of_this_repository_are_plausible() {
        for (name, text) in RobotFile::embedded() {
            let file = RobotFile::parse(name, text).unwrap();
            let found = warnings(&file, &file.robot().unwrap());
            assert!(found.is_empty(), "{name}: {found:?}");
        }
    }
}
