//! Constant part of the plant: masses, geometry, drives, and base.

use twinrig_contact::Ground;
use twinrig_legged::{Base, DriveModels, LEGS, LeggedError, Setup, positive};
use twinrig_robot::leg::Pantograph;
use twinrig_robot::{GRAVITY, Robot};

use crate::model::constants::{Constants, LANES};
use crate::model::real::Lanes;
use crate::model::trunk::TrunkConstants;

/// Minimum ratio of a pivot of the inertia matrix to its diagonal element with all links in line;
/// below, the matrix is singular.
const REGULARITY_MIN: f64 = 1e-9;

/// Model of one leg.
#[derive(Debug, Clone)]
pub(crate) struct LegModel<const N: usize> {
    pub(crate) name: String,
    pub(crate) constants: Constants<f64, N>,
    pub(crate) pantograph: Pantograph,
}

/// Constant part of the plant, with legs of `N` links.
#[derive(Debug, Clone)]
pub(crate) struct Model<const N: usize> {
    pub(crate) base: Base,
    pub(crate) trunk: TrunkConstants,
    pub(crate) legs: Vec<LegModel<N>>,
    pub(crate) side_by_side: Constants<Lanes, N>,
    pub(crate) drives: Option<DriveModels>,
    pub(crate) ground: Option<Ground>,
    /// Coefficient of friction at each leg; zero without ground.
    pub(crate) friction: [f64; LEGS],
    /// Weight times leg length: the reference of energies \[J\].
    pub(crate) energy_scale: f64,
    /// The same for the moving masses \[J\].
    pub(crate) moving_energy: f64,
    /// Maximum leg length \[m\].
    pub(crate) reach: f64,
    /// Time constant of a pendulum of that length, which weights errors of velocities against those
    /// of positions \[s\].
    pub(crate) pendulum: f64,
    /// Whether stops are disabled, for comparison with models without them.
    pub(crate) without_stops: bool,
}

impl<const N: usize> Model<N> {
    pub(crate) fn new(robot: &Robot, setup: &Setup) -> Result<Self, LeggedError> {
        let mut legs = Vec::new();
        for mount in setup.selected_mounts(robot)? {
            let pantograph =
                Pantograph::new(&mount.leg).map_err(LeggedError::of_leg(&mount.name))?;
            let constants = Constants::new(mount, &pantograph);
            positive(
                &format!("inertia of the last link of leg {}", mount.name),
                constants.inertias[N - 1][N - 1],
            )?;
            positive(
                &format!("regularity of the inertia of leg {}", mount.name),
                (constants.regularity() - REGULARITY_MIN).max(0.0),
            )?;
            legs.push(LegModel {
                name: mount.name.clone(),
                constants,
                pantograph,
            });
        }
        let free = setup.base == Base::Free;
        let planar = setup.base == Base::Planar;
        if free || planar {
            positive("mass of the trunk", robot.trunk.mass)?;
            for (moment, axis) in robot.trunk.inertia.iter().zip(["roll", "pitch", "yaw"]) {
                positive(&format!("trunk's moment of inertia in {axis}"), *moment)?;
            }
        }
        let legs_mass = legs.iter().map(|leg| leg.constants.mass).sum::<f64>();
        let payload = robot.trunk.payload();
        let bare = robot.trunk.mass + legs_mass;
        let mass = payload.map_or(bare, |load| bare + load.mass);
        // Scales refer to the whole robot, so that omitting a leg does not change them for the
        // others.
        let all = robot.legs.iter();
        let all = all.filter_map(|mount| Pantograph::new(&mount.leg).ok());
        let reach = all.map(|leg| leg.length_max()).fold(0.0, f64::max);
        let constants: Vec<_> = legs.iter().map(|leg| leg.constants).collect();
        Ok(Self {
            base: setup.base,
            trunk: TrunkConstants {
                mass,
                inertia: robot.trunk.inertia,
                payload,
                moves: [
                    free || planar,
                    free,
                    free || planar,
                    free,
                    free || planar,
                    free,
                ],
            },
            side_by_side: Constants::side_by_side(&constants),
            legs,
            drives: setup.drive_models(robot)?,
            friction: [setup.ground.as_ref().map_or(0.0, |ground| ground.friction); LEGS],
            ground: setup.ground.clone(),
            energy_scale: robot.mass() * GRAVITY * reach,
            moving_energy: if free || planar { mass } else { legs_mass } * GRAVITY * reach,
            reach,
            pendulum: libm::sqrt(reach / GRAVITY),
            without_stops: false,
        })
    }

    /// Returns the force below which a force counts as zero \[N\].
    pub(crate) fn least_force(&self) -> f64 {
        /// Share of the robot's weight.
        const SHARE: f64 = 1e-8;
        SHARE * self.energy_scale / self.reach
    }

    /// Returns the compliance of a foot contact, by which redundant contacts share their load
    /// \[m/s² N⁻¹\]. Mode selection and motion use the same value; otherwise the signs of their
    /// forces would disagree.
    pub(crate) fn contact_compliance(&self) -> f64 {
        /// Share of the mobility of the whole robot.
        const SHARE: f64 = 1e-8;
        SHARE * GRAVITY * self.reach / self.energy_scale
    }

    /// Returns the coefficient of restitution; zero without ground.
    pub(crate) fn restitution(&self) -> f64 {
        let ground = self.ground.as_ref();
        ground.map_or(0.0, |ground| ground.restitution)
    }

    /// Returns whether the trunk moves.
    pub(crate) fn is_free(&self) -> bool {
        self.base != Base::Fixed
    }

    /// Returns the number of coordinates of a leg: its links, and its pulley where there are
    /// drives.
    pub(crate) fn coordinates(&self) -> usize {
        N + usize::from(self.drives.is_some())
    }

    /// Returns the islands, which move independently, as ranges of legs: the whole robot, or each
    /// leg on a fixed trunk.
    pub(crate) fn islands(&self) -> impl Iterator<Item = core::ops::Range<usize>> + use<N> {
        let (legs, free) = (self.legs.len(), self.is_free());
        let islands = if free { 1 } else { legs };
        (0..islands).map(move |i| if free { 0..legs } else { i..i + 1 })
    }

    /// Returns the lanes of an island: all lanes where the trunk moves.
    pub(crate) fn lanes_of(&self, island: core::ops::Range<usize>) -> core::ops::Range<usize> {
        if self.is_free() { 0..LANES } else { island }
    }

    /// Returns `seconds` in the lanes of existing legs, and zero in the others.
    pub(crate) fn leg_times(&self, seconds: f64) -> Lanes {
        let legs = self.legs.len();
        if self.is_free() {
            return Lanes::splat(seconds);
        }
        Lanes::new(std::array::from_fn(
            |leg| if leg < legs { seconds } else { 0.0 },
        ))
    }
}
