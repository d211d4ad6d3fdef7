//! Where trunk and legs are, in coordinates that no plant has for its own.

use nalgebra::Vector3;
use twinrig_kernel::SimTime;
use twinrig_leg::Pantograph;
use twinrig_robot::Robot;
use twinrig_runtime::PlantState;

use crate::error::LeggedError;
use crate::setup::Setup;

/// Where the robot is and how it moves: what every plant of it can say, and start from. World axes and SI units unless said
/// otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Posture {
    /// The trunk's own centre of mass, legs apart \[m\].
    pub position: Vector3<f64>,
    /// Attitude of the trunk as a quaternion w, x, y, z from trunk to world.
    pub attitude: [f64; 4],
    /// Velocity of that centre of mass \[m/s\].
    pub velocity: Vector3<f64>,
    /// Angular velocity of the trunk, in the trunk's own axes \[rad/s\].
    pub angular_velocity: Vector3<f64>,
    /// The legs by name, in the order of the ports.
    pub legs: Vec<(String, LegPosture)>,
}

/// Where a leg is in its plane.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LegPosture {
    /// Absolute angles of the three segments in the leg plane, zero pointing straight down \[rad\].
    pub angles: [f64; 3],
    /// Their rates \[rad/s\].
    pub rates: [f64; 3],
    /// Angle of the cable pulley, zero with the leg extended \[rad\].
    pub pulley: f64,
    /// Its rate \[rad/s\].
    pub pulley_rate: f64,
}

const POSITION: &str = "body/position";
const ORIENTATION: &str = "body/orientation";
const VELOCITY: &str = "body/velocity";
const ANGULAR_VELOCITY: &str = "body/angular_velocity";

impl Setup {
    /// The robot at the start: the trunk level and at rest, the legs at their start, the lowest foot at height zero, or on the
    /// ground where that is higher.
    ///
    /// # Errors
    /// As [`Setup::chosen`] and [`Start::of_leg`](crate::Start::of_leg).
    pub fn posture(&self, robot: &Robot) -> Result<Posture, LeggedError> {
        let height = self.height(robot, |mount, start| {
            Vector3::from(mount.hip) + Vector3::new(start.foot.x, 0.0, start.foot.y)
        })?;
        let mut legs = Vec::new();
        for mount in self.chosen(robot)? {
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
}

impl Posture {
    /// The posture as a plant's state: the names of the signals where there is one, and `leg/LF/rates` beside
    /// `leg/LF/angles`.
    pub fn state(&self, time: SimTime) -> PlantState {
        let mut state = PlantState::at(time)
            .with(POSITION, self.position.as_slice())
            .with(ORIENTATION, &self.attitude)
            .with(VELOCITY, self.velocity.as_slice())
            .with(ANGULAR_VELOCITY, self.angular_velocity.as_slice());
        for (leg, posture) in &self.legs {
            state = state
                .with(format!("leg/{leg}/angles"), &posture.angles)
                .with(format!("leg/{leg}/rates"), &posture.rates)
                .with(format!("leg/{leg}/knee/position"), &[posture.pulley])
                .with(format!("leg/{leg}/knee/rate"), &[posture.pulley_rate]);
        }
        state
    }

    /// Takes over what `state` tells of what is here; what it does not tell stays. Returns a line on everything that found no
    /// place or was not told.
    pub fn resume_from(&mut self, state: &PlantState) -> Vec<String> {
        let mut taken = Vec::new();
        let mut missing = Vec::new();
        let mut take = |name: String, here: &mut [f64]| match state.get(&name) {
            Some(values) if values.len() == here.len() => {
                here.copy_from_slice(values);
                taken.push(name);
            }
            _ => missing.push(format!("{name} is not told, and stays as it is")),
        };
        take(POSITION.to_owned(), self.position.as_mut_slice());
        take(ORIENTATION.to_owned(), &mut self.attitude);
        take(VELOCITY.to_owned(), self.velocity.as_mut_slice());
        take(
            ANGULAR_VELOCITY.to_owned(),
            self.angular_velocity.as_mut_slice(),
        );
        for (leg, posture) in &mut self.legs {
            take(format!("leg/{leg}/angles"), &mut posture.angles);
            take(format!("leg/{leg}/rates"), &mut posture.rates);
            let (pulley, rate) = (&mut posture.pulley, &mut posture.pulley_rate);
            take(
                format!("leg/{leg}/knee/position"),
                std::slice::from_mut(pulley),
            );
            take(format!("leg/{leg}/knee/rate"), std::slice::from_mut(rate));
        }
        let strange = state
            .iter()
            .filter(|(name, _)| !taken.iter().any(|other| other == name));
        missing.extend(strange.map(|(name, _)| format!("{name} has no place here")));
        missing
    }
}
