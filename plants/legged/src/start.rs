//! Initial state of the legs, and the resulting height of the trunk above the ground.

use core::f64::consts::PI;

use twinrig_robot::leg::{Joints, LegCommand, LegError, Pantograph, Planar, Pose, Stop};

use crate::error::LeggedError;

/// Default leg length at the start, relative to the greatest leg length.
const UPRIGHT_SHARE: f64 = 0.9;

/// Tolerance for rounding errors of a start at a stop \[m\].
const STOP_TOLERANCE: f64 = 1e-9;

/// Initial state of the legs.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// At rest at the poses of these commands, by leg, with the pantograph closed and the cable
    /// taut; for example the first commands of a controller. A leg without a command stands upright
    /// at 0.9 of its greatest length.
    Commands(Vec<(String, LegCommand)>),
    /// The same joint angles and rates for all legs; drives, if any, with taut cables and pulleys
    /// at rest.
    Pose(StartPose),
}

/// Angles and rates of hip, knee and ankle, each relative to the segment above (q1, q2, q3 of the
/// thesis: zero in the reference pose, `q2 ≤ 0` flexes the knee, `q2 + q3 ≥ 0` opens the
/// pantograph).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StartPose {
    /// Angles \[rad\].
    pub q: [f64; 3],
    /// Angular velocities \[rad/s\].
    pub rates: [f64; 3],
}

/// Initial state of one leg, within all its stops. The trunk is at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegStart {
    /// Drive positions: hip angle q1, and the pulley angle at which the cable is taut \[rad\].
    pub command: LegCommand,
    /// Absolute angles of the three segments, zero pointing straight down \[rad\].
    pub angles: [f64; 3],
    /// Angular velocities \[rad/s\].
    pub rates: [f64; 3],
    /// Foot position in the leg plane, relative to the hip \[m\].
    pub foot: Planar,
    /// Foot velocity \[m/s\].
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
    /// Returns the initial state of the named leg.
    ///
    /// # Errors
    /// [`LeggedError::Leg`] if it is out of reach, [`LeggedError::StartBeyondStop`],
    /// [`LeggedError::StartBentWrongSide`].
    pub fn of_leg(&self, name: &str, pantograph: &Pantograph) -> Result<LegStart, LeggedError> {
        let (start, pose) = match self {
            Self::Commands(commands) => {
                let mut commands = commands.iter();
                let command = commands.find(|(leg, _)| leg == name);
                start_of_command(command.map(|(_, command)| *command), pantograph)
                    .map_err(LeggedError::of_leg(name))?
            }
            Self::Pose(start) => {
                start.check_bends(name, pantograph)?;
                start
                    .leg_start(pantograph)
                    .map_err(LeggedError::of_leg(name))?
            }
        };
        let beyond = |stop: &Stop| -pantograph.gap(&pose, *stop, pose.cable);
        if let Some(stop) = Stop::ALL
            .into_iter()
            .find(|stop| beyond(stop) > STOP_TOLERANCE)
        {
            let (leg, by) = (name.to_owned(), beyond(&stop));
            return Err(LeggedError::StartBeyondStop { leg, stop, by });
        }
        Ok(start)
    }
}

/// Returns the state of a leg at rest at its commanded pose, upright without a command.
fn start_of_command(
    command: Option<LegCommand>,
    pantograph: &Pantograph,
) -> Result<(LegStart, Pose), LegError> {
    let upright = Planar::new(0.0, -UPRIGHT_SHARE * pantograph.length_max());
    let command = command.map_or_else(|| pantograph.inverse_closed(upright), Ok)?;
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
    /// Rejects joints bent to the wrong side, where diagonal and rod lengths are within their
    /// stops, too. On the correct side the diagonal grows with q2 and the rod with q3, up to the
    /// stretched pose.
    fn check_bends(&self, leg: &str, pantograph: &Pantograph) -> Result<(), LeggedError> {
        let [_, q2, q3] = self.q;
        let joints = Joints { q2, q3 };
        let knee = q2 + pantograph.joints([0.0; 3]).q3;
        let diagonal = pantograph.diagonal_of(joints).gradient[0];
        let rod = pantograph.parallel_of(joints).gradient[1];
        let error = |joint, angle| LeggedError::StartBentWrongSide {
            leg: leg.to_owned(),
            joint,
            angle,
        };
        // The negated form rejects NaN.
        if !((-PI..0.0).contains(&knee) && diagonal > 0.0) {
            return Err(error("knee", q2));
        }
        if !((-PI..PI).contains(&(q2 + q3)) && rod > 0.0) {
            return Err(error("ankle", q3));
        }
        Ok(())
    }

    fn leg_start(&self, pantograph: &Pantograph) -> Result<(LegStart, Pose), LegError> {
        let [q1, q2, q3] = self.q;
        if !q1.is_finite() || self.rates.iter().any(|rate| !rate.is_finite()) {
            let what = "start";
            return Err(LegError::NotFinite { what });
        }
        let angles = pantograph.angles(q1, Joints { q2, q3 });
        let pose = pantograph.pose_of_angles(angles)?;
        let [hip, knee, ankle] = self.rates;
        let rates = [hip, hip + knee, hip + knee + ankle];
        let rotation_velocity = |span: Planar, rate: f64| Planar::new(-span.y, span.x) * rate;
        let start = LegStart {
            command: LegCommand {
                hip: q1,
                knee: (pantograph.cable_length(0.0) - pose.cable) / pantograph.pulley_radius(),
            },
            angles,
            rates,
            foot: pose.foot,
            foot_velocity: rotation_velocity(pose.knee, rates[0])
                + rotation_velocity(pose.ankle - pose.knee, rates[1])
                + rotation_velocity(pose.foot - pose.ankle, rates[2]),
        };
        Ok((start, pose))
    }
}
