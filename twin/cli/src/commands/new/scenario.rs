//! Text of a new scenario, with the lengths of its robot.

use twinrig_robot::RobotFile;
use twinrig_robot::leg::Pantograph;

use crate::args::NewArgs;
use crate::error::TwinError;
use twinrig_rig::error::Error;

const TEMPLATE: &str = include_str!("../../../templates/scenario/scenario.toml");
const ROBOT: &str = "cheetah-cub";

/// Heights and slip as shares of the length of the shortest leg \[%\]: stretched as Cheetah-cub
/// stands in its own scenario, bent well within the reach of a pantograph leg.
const STRETCHED_PERCENT: f64 = 93.0;
const BEND_PERCENT: f64 = 7.0;
const SLIP_PERCENT: f64 = 1.0;
/// Changes in which the legs bend.
const STEPS: f64 = 100.0;

/// Returns the scenario in which the robot stands and bends its legs.
pub fn text(args: &NewArgs) -> Result<String, TwinError> {
    let robot = args.robot.as_deref().unwrap_or(ROBOT);
    let length = leg_length(robot, args)?;
    let contacts = if has_contact(robot, args)? {
        CONTACTS
    } else {
        ""
    };
    // Rounded before they are added, so that the printed numbers agree.
    let tenths = |percent: f64| (percent * 0.01 * length * 1e4).round();
    let millimetres = |tenths: f64| format!("{:.1} mm", tenths * 0.1);
    let (stretched, bend) = (tenths(STRETCHED_PERCENT), tenths(BEND_PERCENT));
    Ok(TEMPLATE
        .replace("@NAME@", &args.name)
        .replace("@ROBOT@", robot)
        .replace("@CONTACTS@\n", contacts)
        .replace("@LENGTH@", &millimetres(tenths(100.0)))
        .replace("@SHARE_STRETCHED@", &STRETCHED_PERCENT.to_string())
        .replace("@STRETCHED@", &millimetres(stretched))
        .replace("@BENT@", &millimetres(stretched - bend))
        .replace("@STEP@", &format!("{:.3} mm", bend * 0.1 / STEPS))
        .replace("@STEPS@", &STEPS.to_string())
        .replace("@SLIP@", &millimetres(tenths(SLIP_PERCENT))))
}

/// Contact of the trunk, of a robot that has one.
const CONTACTS: &str = "contacts = \"trunk\"            # it falls onto its trunk; \"all\" with knees and ankles, on \"lcp\"\n";

/// Returns whether the file of a robot describes contacts beyond the feet.
fn has_contact(name: &str, args: &NewArgs) -> Result<bool, TwinError> {
    let robot = RobotFile::find(name, &args.folder)?.robot()?;
    Ok(robot.contact.is_some())
}

/// Returns the length of the shortest stretched leg \[m\].
fn leg_length(name: &str, args: &NewArgs) -> Result<f64, TwinError> {
    let robot = RobotFile::find(name, &args.folder)?.robot()?;
    let mut shortest = f64::INFINITY;
    for mount in &robot.legs {
        let leg = Pantograph::new(&mount.leg).map_err(|source| {
            TwinError::from(Error::Build {
                what: "robot",
                name: name.to_owned(),
                file: name.to_owned(),
                source: source.into(),
            })
        })?;
        shortest = shortest.min(leg.length_max());
    }
    if shortest.is_finite() {
        return Ok(shortest);
    }
    Err(TwinError::from(Error::InvalidOptions {
        why: format!("the robot `{name}` has no legs"),
        help: "this scenario is for legged robots".to_owned(),
    }))
}
