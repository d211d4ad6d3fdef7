//! Start of the legs that a scenario gives, and why a leg does not have it.

use twinrig_document::Problem;
use twinrig_legged::{LeggedError, Start, StartPose};
use twinrig_robot::LegMount;
use twinrig_robot::leg::{Pantograph, Stop};
use twinrig_scenario::{Base, StartPose as SceneStart};

use crate::parts::context::PlantContext;

/// Names of the angles in a scenario.
const ANGLES: [&str; 3] = ["q1", "q2", "q3"];
/// Indices of the angles of knee and ankle.
const KNEE: usize = 1;
const ANKLE: usize = 2;

/// Returns the start of all legs without its places.
pub(crate) fn pose(start: &SceneStart) -> StartPose {
    StartPose {
        q: start.q,
        rates: start.rates,
    }
}

/// Returns the problem of a start that a leg of the scene cannot have, at the angle that is wrong.
pub(crate) fn mistake(context: &PlantContext<'_>) -> Option<Problem> {
    let start = context.plant.start.as_ref()?;
    let is_placed = |mount: &&LegMount| {
        context.plant.base == Base::Fixed || context.legs.contains(&mount.name.as_str())
    };
    let mut mounts = context.robot.legs.iter().filter(is_placed);
    mounts.find_map(|mount| {
        let pantograph = Pantograph::new(&mount.leg).ok()?;
        let of_leg = |start: StartPose| Start::Pose(start).of_leg(&mount.name, &pantograph);
        let error = of_leg(pose(start)).err()?;
        let (joint, message) = described(&error)?;
        let range = range(joint, start, |start| of_leg(start).is_ok());
        Some(Problem::at(
            &start.places[joint],
            format!("`{}` {message} (leg {})", ANGLES[joint], mount.name),
            help(joint, start, range),
        ))
    })
}

/// Returns the index of the angle that is wrong, and what is wrong with it.
fn described(error: &LeggedError) -> Option<(usize, String)> {
    match error {
        LeggedError::StartBentWrongSide { joint, .. } => Some((
            if *joint == "knee" { KNEE } else { ANKLE },
            format!("bends the {joint} to where the leg cannot be"),
        )),
        LeggedError::StartBeyondStop { stop, by, .. } => {
            let (joint, what, length) = match stop {
                Stop::Extended => (KNEE, "extends the knee", "diagonal"),
                Stop::Bottomed => (KNEE, "folds the knee", "diagonal"),
                Stop::Closed => (ANKLE, "closes the pantograph", "parallel rod"),
                Stop::Open => (ANKLE, "opens the pantograph", "parallel rod"),
                Stop::Cable => (KNEE, "stretches the cable", "cable"),
            };
            let by = 1e3 * by;
            Some((
                joint,
                format!("{what} beyond its stop, by {by:.2} mm of the {length}"),
            ))
        }
        _ => None,
    }
}

/// Returns the least and the greatest value of an angle with which a leg has the start, in tenths
/// of a degree.
fn range(joint: usize, start: &SceneStart, has: impl Fn(StartPose) -> bool) -> Option<(i32, i32)> {
    let mut sound = (-1800..=1800).filter(|tenths| {
        let mut pose = pose(start);
        pose.q[joint] = (f64::from(*tenths) / 10.0).to_radians();
        has(pose)
    });
    let least = sound.next()?;
    Some((least, sound.last().unwrap_or(least)))
}

/// Returns the remedy, where the range of the angle is in tenths of a degree.
fn help(joint: usize, start: &SceneStart, range: Option<(i32, i32)>) -> String {
    let other = if joint == KNEE { ANKLE } else { KNEE };
    let (angle, fixed) = (ANGLES[joint], ANGLES[other]);
    let beside = start.q[other].to_degrees();
    match range {
        Some((least, greatest)) => format!(
            "with {fixed} = {beside:.1} deg, {angle} is from {:.1} deg to {:.1} deg",
            f64::from(least) / 10.0,
            f64::from(greatest) / 10.0
        ),
        None => format!(
            "no {angle} is possible with {fixed} = {beside:.1} deg; \
             q2 = -10 deg with q3 = 10 deg closes the pantograph"
        ),
    }
}
