//! Plant-independent state of trunk and legs.

use nalgebra::Vector3;
use twinrig_contact::Ground;
use twinrig_kernel::{SimTime, signal};
use twinrig_robot::leg::Pantograph;
use twinrig_robot::{LegMount, Robot};
use twinrig_runtime::PlantState;

use crate::error::LeggedError;
use crate::setup::{Base, Setup};
use crate::start::LegStart;

/// Position and velocity of a robot, which every plant can report and start from. World axes and SI
/// units unless stated otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Posture {
    /// Centre of mass of the trunk without legs \[m\].
    pub position: Vector3<f64>,
    /// Attitude of the trunk as a quaternion w, x, y, z from trunk to world.
    pub attitude: [f64; 4],
    /// Velocity of this centre of mass \[m/s\].
    pub velocity: Vector3<f64>,
    /// Angular velocity of the trunk in trunk axes \[rad/s\].
    pub angular_velocity: Vector3<f64>,
    /// Legs by name, in the order of the ports.
    pub legs: Vec<(String, LegPosture)>,
}

/// State of a leg in its plane.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LegPosture {
    /// Absolute angles of the three segments in the leg plane, zero pointing straight down \[rad\].
    pub angles: [f64; 3],
    /// Angular velocities of the segments \[rad/s\].
    pub rates: [f64; 3],
    /// Angle of the cable pulley, zero with the leg extended \[rad\].
    pub pulley: f64,
    /// Rate of the pulley angle \[rad/s\].
    pub pulley_rate: f64,
}

/// Rates of `leg/LF/angles`, which is a state but not a signal.
const RATES: &str = "rates";

impl Setup {
    /// Returns the initial posture: trunk level and at rest, legs at their start, the lowest foot
    /// at height zero, or on the ground where that is higher.
    ///
    /// # Errors
    /// As [`Setup::selected_mounts`] and [`Start::of_leg`](crate::Start::of_leg).
    pub fn posture(&self, robot: &Robot) -> Result<Posture, LeggedError> {
        let height = self.height(robot, |mount, start| {
            Vector3::from(mount.hip) + Vector3::new(start.foot.x, 0.0, start.foot.y)
        })?;
        let mut legs = Vec::new();
        for mount in self.selected_mounts(robot)? {
            let pantograph =
                Pantograph::new(&mount.leg).map_err(LeggedError::of_leg(&mount.name))?;
            let start = self.start.of_leg(&mount.name, &pantograph)?;
            let leg = LegPosture {
                angles: start.angles,
                rates: start.rates,
                pulley: start.command.knee,
                pulley_rate: 0.0,
            };
            legs.push((mount.name.clone(), leg));
        }
        Ok(Posture {
            position: Vector3::z() * height,
            attitude: [1.0, 0.0, 0.0, 0.0],
            velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
            legs,
        })
    }

    /// Returns the initial height of the trunk \[m\]: the lowest foot is at height zero, or on the
    /// ground where that is higher; the robot falls to lower ground. `lowest` returns the lowest
    /// point of a leg relative to the centre of mass of the trunk, in its axes.
    ///
    /// The height of a fixed trunk is determined by all legs of the robot, so that it does not
    /// depend on omitted legs.
    ///
    /// # Errors
    /// As [`Setup::selected_mounts`] and [`Start::of_leg`](crate::Start::of_leg).
    pub fn height(
        &self,
        robot: &Robot,
        lowest: impl Fn(&LegMount, &LegStart) -> Vector3<f64>,
    ) -> Result<f64, LeggedError> {
        let mut mounts = self.selected_mounts(robot)?;
        if self.base == Base::Fixed {
            mounts = robot.legs.iter().collect();
        }
        let mut height = 0.0_f64;
        for mount in mounts {
            let pantograph =
                Pantograph::new(&mount.leg).map_err(LeggedError::of_leg(&mount.name))?;
            let start = self.start.of_leg(&mount.name, &pantograph)?;
            height = height.max(clearance(self.ground.as_ref(), &lowest(mount, &start)));
        }
        Ok(height)
    }
}

/// Returns the height of the trunk at which a point is at height zero, or on the ground where that
/// is higher.
fn clearance(ground: Option<&Ground>, point: &Vector3<f64>) -> f64 {
    let ground = ground.map_or(0.0, |ground| {
        let below = ground.below(&Vector3::new(point.x, point.y, 0.0));
        -below.gap / below.normal.z
    });
    ground.max(0.0) - point.z
}

impl Posture {
    /// Returns the posture as a plant state: entries have the names of the corresponding signals,
    /// plus `leg/LF/rates` for the rates of `leg/LF/angles`.
    pub fn state(&self, time: SimTime) -> PlantState {
        let mut state = PlantState::at(time)
            .with(signal::BODY_POSITION, self.position.as_slice())
            .with(signal::BODY_ORIENTATION, &self.attitude)
            .with(signal::BODY_VELOCITY, self.velocity.as_slice())
            .with(
                signal::BODY_ANGULAR_VELOCITY,
                self.angular_velocity.as_slice(),
            );
        for (leg, posture) in &self.legs {
            state = state
                .with(signal::of_leg(leg, signal::ANGLES), &posture.angles)
                .with(signal::of_leg(leg, RATES), &posture.rates)
                .with(
                    signal::of_leg(leg, signal::KNEE_POSITION),
                    &[posture.pulley],
                )
                .with(
                    signal::of_leg(leg, signal::KNEE_RATE),
                    &[posture.pulley_rate],
                );
        }
        state
    }

    /// Adopts the entries of `state` that this posture has; the others keep their values. Returns a
    /// message for every unknown and every missing entry.
    pub fn resume_from(&mut self, state: &PlantState) -> Vec<String> {
        let mut adopted = Vec::new();
        let mut messages = Vec::new();
        let mut adopt = |name: String, target: &mut [f64]| match state.get(&name) {
            Some(values) if values.len() == target.len() => {
                target.copy_from_slice(values);
                adopted.push(name);
            }
            _ => messages.push(format!("{name} is missing and keeps its value")),
        };
        adopt(
            signal::BODY_POSITION.to_owned(),
            self.position.as_mut_slice(),
        );
        adopt(signal::BODY_ORIENTATION.to_owned(), &mut self.attitude);
        adopt(
            signal::BODY_VELOCITY.to_owned(),
            self.velocity.as_mut_slice(),
        );
        adopt(
            signal::BODY_ANGULAR_VELOCITY.to_owned(),
            self.angular_velocity.as_mut_slice(),
        );
        for (leg, posture) in &mut self.legs {
            adopt(signal::of_leg(leg, signal::ANGLES), &mut posture.angles);
            adopt(signal::of_leg(leg, RATES), &mut posture.rates);
            let (pulley, rate) = (&mut posture.pulley, &mut posture.pulley_rate);
            adopt(
                signal::of_leg(leg, signal::KNEE_POSITION),
                std::slice::from_mut(pulley),
            );
            adopt(
                signal::of_leg(leg, signal::KNEE_RATE),
                std::slice::from_mut(rate),
            );
        }
        let unknown = state
            .iter()
            .filter(|(name, _)| !adopted.iter().any(|other| other == name));
        messages.extend(unknown.map(|(name, _)| format!("{name} is not a state of this plant")));
        messages
    }
}
