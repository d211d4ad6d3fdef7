//! Where the legs are when time begins, and how high above the ground that puts the trunk.

use core::f64::consts::PI;

use nalgebra::Vector3;
use twinrig_contact::Ground;
use twinrig_leg::{Joints, LegCommand, LegError, Pantograph, Planar, Pose, Stop};
use twinrig_robot::{LegMount, Robot};

use crate::error::LeggedError;
use crate::setup::{Base, Setup};

/// A start height, as a share of the greatest leg length, where none is given.
const UPRIGHT_SHARE: f64 = 0.9;

/// What rounding may put a start beyond a stop \[m\].
const BEYOND: f64 = 1e-9;

/// How the legs start.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// At rest where these commands, by leg, take them: pantograph closed, cable just taut. A controller's first commands,
    /// say. A leg not named stands upright at 0.9 of its greatest length.
    Commands(Vec<(String, LegCommand)>),
    /// All at the same joint angles and rates; drives, where there are any, with the cables just taut and the pulleys at
    /// rest.
    Pose(StartPose),
}

/// Angles and rates of hip, knee and ankle (q1, q2, q3 of the thesis: zero in the reference pose, `q2 ≤ 0` flexes the knee,
/// `q2 + q3 ≥ 0` opens the pantograph), each against the segment before it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StartPose {
    /// Angles \[rad\].
    pub q: [f64; 3],
    /// Their rates \[rad/s\].
    pub rates: [f64; 3],
}

/// One leg at the start, between all its stops. The trunk is at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegStart {
    /// The drives: hip angle q1, and the pulley at which the cable is just taut \[rad\].
    pub command: LegCommand,
    /// Absolute angles of the three segments, zero pointing straight down \[rad\].
    pub angles: [f64; 3],
    /// Their rates \[rad/s\].
    pub rates: [f64; 3],
    /// Foot in the leg plane, seen from the hip \[m\].
    pub foot: Planar,
    /// Its velocity \[m/s\].
    pub foot_velocity: Planar,
}

impl Default for Start {
    fn default() -> Self {
        Self::Commands(Vec::new())
    }
}

impl From<Vec<(String, LegCommand)>> for Start {
    fn from(commands: Vec<(String, LegCommand)>) -> Self {
        Self::Commands(commands)
    }
}

impl FromIterator<(String, LegCommand)> for Start {
    fn from_iter<I: IntoIterator<Item = (String, LegCommand)>>(commands: I) -> Self {
        Self::Commands(commands.into_iter().collect())
    }
}

impl From<StartPose> for Start {
    fn from(pose: StartPose) -> Self {
        Self::Pose(pose)
    }
}

impl Start {
    /// The start of the leg of that name.
    ///
    /// # Errors
    /// [`LeggedError::Leg`] out of its reach, [`LeggedError::StartBeyondStop`], [`LeggedError::StartBentBack`].
    pub fn of_leg(&self, name: &str, pantograph: &Pantograph) -> Result<LegStart, LeggedError> {
        let (start, pose) = match self {
            Self::Commands(commands) => {
                let mut given = commands.iter();
                let given = given.find(|(leg, _)| leg == name);
                commanded(given.map(|(_, command)| *command), pantograph)
                    .map_err(LeggedError::of_leg(name))?
            }
            Self::Pose(start) => {
                start.check_bends(name, pantograph)?;
                start.taken(pantograph).map_err(LeggedError::of_leg(name))?
            }
        };
        let beyond = |stop: &Stop| -pantograph.gap(&pose, *stop, pose.cable);
        if let Some(stop) = Stop::ALL.into_iter().find(|stop| beyond(stop) > BEYOND) {
            let (leg, by) = (name.to_owned(), beyond(&stop));
            return Err(LeggedError::StartBeyondStop { leg, stop, by });
        }
        Ok(start)
    }
}

/// A leg at rest where its drives put it, upright if they are not told.
fn commanded(
    given: Option<LegCommand>,
    pantograph: &Pantograph,
) -> Result<(LegStart, Pose), LegError> {
    let upright = Planar::new(0.0, -UPRIGHT_SHARE * pantograph.length_max());
    let command = given.map_or_else(|| pantograph.inverse_closed(upright), Ok)?;
    let foot = pantograph.foot_of(command)?;
    let first = command.hip + pantograph.hip_reference();
    let pose = pantograph.pose(libm::sin(first), libm::cos(first), foot)?;
    let [_, second, third] = pose.angles();
    let start = LegStart {
        command,
        angles: [first, second, third],
        rates: [0.0; 3],
        foot,
        foot_velocity: Planar::zeros(),
    };
    Ok((start, pose))
}

impl StartPose {
    /// Refuses joints bent the other way: there, too, diagonal and rod have lengths between their stops. The way they bend
    /// is the one on which the diagonal grows with q2 and the rod with q3, up to where they are stretched out.
    fn check_bends(&self, leg: &str, pantograph: &Pantograph) -> Result<(), LeggedError> {
        let [_, q2, q3] = self.q;
        let joints = Joints { q2, q3 };
        let knee = q2 + pantograph.joints([0.0; 3]).q3;
        let diagonal = pantograph.diagonal_of(joints).gradient[0];
        let rod = pantograph.parallel_of(joints).gradient[1];
        let back = |joint, angle| LeggedError::StartBentBack {
            leg: leg.to_owned(),
            joint,
            angle,
        };
        // Written so that what is no number does not pass.
        if !((-PI..0.0).contains(&knee) && diagonal > 0.0) {
            return Err(back("knee", q2));
        }
        if !((-PI..PI).contains(&(q2 + q3)) && rod > 0.0) {
            return Err(back("ankle", q3));
        }
        Ok(())
    }

    fn taken(&self, pantograph: &Pantograph) -> Result<(LegStart, Pose), LegError> {
        let [q1, q2, q3] = self.q;
        if !q1.is_finite() || self.rates.iter().any(|rate| !rate.is_finite()) {
            let what = "start";
            return Err(LegError::NotFinite { what });
        }
        let angles = pantograph.angles(q1, Joints { q2, q3 });
        let pose = pantograph.pose_of_angles(angles)?;
        let [hip, knee, ankle] = self.rates;
        let rates = [hip, hip + knee, hip + knee + ankle];
        let carried = |span: Planar, rate: f64| Planar::new(-span.y, span.x) * rate;
        let start = LegStart {
            command: LegCommand {
                hip: q1,
                knee: (pantograph.cable_length(0.0) - pose.cable) / pantograph.pulley_radius(),
            },
            angles,
            rates,
            foot: pose.foot,
            foot_velocity: carried(pose.knee, rates[0])
                + carried(pose.ankle - pose.knee, rates[1])
                + carried(pose.foot - pose.ankle, rates[2]),
        };
        Ok((start, pose))
    }
}

impl Setup {
    /// How high the trunk is at the start \[m\]: so that the lowest foot is at height zero, or on the ground where that is
    /// higher; ground that is lower is fallen to. `lowest` says where a leg reaches farthest down, seen from the trunk's
    /// centre of mass in its axes.
    ///
    /// A trunk that is held is where all of the robot's legs would have it, so that none that is left out moves it.
    ///
    /// # Errors
    /// As [`Setup::chosen`] and [`Start::of_leg`].
    pub fn height(
        &self,
        robot: &Robot,
        lowest: impl Fn(&LegMount, &LegStart) -> Vector3<f64>,
    ) -> Result<f64, LeggedError> {
        let mut standing = self.chosen(robot)?;
        if self.base == Base::Fixed {
            standing = robot.legs.iter().collect();
        }
        let mut height = 0.0_f64;
        for mount in standing {
            let pantograph =
                Pantograph::new(&mount.leg).map_err(LeggedError::of_leg(&mount.name))?;
            let start = self.start.of_leg(&mount.name, &pantograph)?;
            height = height.max(clearance(self.ground.as_ref(), &lowest(mount, &start)));
        }
        Ok(height)
    }
}

/// How high the trunk has to be for a point to be at height zero, or on the ground where that is higher.
fn clearance(ground: Option<&Ground>, point: &Vector3<f64>) -> f64 {
    let ground = ground.map_or(0.0, |ground| {
        let below = ground.below(&Vector3::new(point.x, point.y, 0.0));
        -below.gap / below.normal.z
    });
    ground.max(0.0) - point.z
}
