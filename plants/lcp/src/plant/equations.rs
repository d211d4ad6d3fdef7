//! Equations of motion in one state, for comparison with another engine.

use twinrig_legged::Setup;
use twinrig_robot::Robot;

use crate::constraints::mode::Mode;
use crate::model::Model;
use crate::model::articulated::Articulated;
use crate::model::coupling::COUPLED;
use crate::model::elimination::ConstraintSet;
use crate::model::leg_constraints::{CONSTRAINTS, DriveAction};
use crate::model::real::{Lanes, Real};
use crate::model::rotation::into_trunk;
use crate::model::site::Site;
use crate::model::state::State;
use crate::options::LcpError;

/// Configuration and velocities of a robot; legs in the order of the robot file, angles as in
/// [`Equations`].
#[derive(Debug, Clone, PartialEq)]
pub struct Posture {
    /// Position of the trunk's own centre of mass, world frame \[m\].
    pub position: [f64; 3],
    /// Attitude of the trunk as a quaternion w, x, y, z from trunk to world.
    pub orientation: [f64; 4],
    /// Absolute angles of the links of each leg in its plane, zero pointing straight down, positive
    /// forward \[rad\].
    pub angles: Vec<Vec<f64>>,
    /// Velocity and angular velocity of the trunk in trunk axes, then the rates of the links, leg
    /// by leg: n values.
    pub velocity: Vec<f64>,
}

/// M u̇ + bias = generalised force, without constraints: n = 6 + 3 for each leg, or 4 where it has
/// a toe joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Equations {
    /// M, n × n, row by row.
    pub inertia: Vec<f64>,
    /// Gravity and velocity terms; springs and friction count as forces.
    pub bias: Vec<f64>,
    /// Kinetic, spring and gravity energy \[J\].
    pub energy: [f64; 3],
    /// Contact points, leg by leg: the foot, or the tip of its toe; world frame \[m\].
    pub feet: Vec<[f64; 3]>,
    /// Jacobian of each foot's velocity in the world, 3 × n, row by row.
    pub jacobians: Vec<Vec<f64>>,
    /// u̇ under springs, joint friction and gravity.
    pub acceleration: Vec<f64>,
}

impl Equations {
    /// Computes the equations of a robot in the air with its drives removed, with or without the
    /// toe as a link.
    ///
    /// # Errors
    /// [`LcpError`] if robot and setup do not match, or the posture has other legs.
    pub fn new(
        robot: &Robot,
        setup: &Setup,
        toe: bool,
        posture: &Posture,
    ) -> Result<Self, LcpError> {
        if toe {
            Self::of::<4>(robot, setup, posture)
        } else {
            Self::of::<3>(robot, setup, posture)
        }
    }

    fn of<const N: usize>(
        robot: &Robot,
        setup: &Setup,
        posture: &Posture,
    ) -> Result<Self, LcpError> {
        let model = Model::<N>::new(robot, setup)?;
        let state = state(&model, posture)?;
        let mode = Mode::free();
        let drive = DriveAction::none();
        let constraint_set = ConstraintSet {
            active: &mode.active,
            drive: &drive,
            recovery: Lanes::zero(),
            implicit_seconds: 0.0,
            any: [false; CONSTRAINTS],
        };
        let legs = &model.side_by_side;
        let articulated = Articulated::new(&model, legs, &state, &constraint_set, None);
        let Some(base) = &articulated.base else {
            return Err(LcpError::Start("the trunk has to be free".to_owned()));
        };
        let (chain, coupling) = (&articulated.chain, &base.coupling);
        let count = model.legs.len();
        let n = 6 + N * count;
        let mut inertia = vec![0.0; n * n];
        let mut bias = vec![0.0; n];
        let accelerations = articulated.accelerations();
        let mut acceleration = accelerations.trunk.to_vec();
        for (i, row) in base.trunk.matrix(model.trunk.mass).iter().enumerate() {
            inertia[i * n..i * n + 6].copy_from_slice(row);
            bias[i] = -base.trunk.force[i];
        }
        for leg in 0..count {
            for i in 0..N {
                let at = 6 + N * leg + i;
                for j in 0..N {
                    inertia[at * n + 6 + N * leg + j] = chain.inertia[i][j].lane(leg);
                }
                for (column, &row) in coupling.columns[i].iter().zip(&COUPLED) {
                    inertia[at * n + row] = column.lane(leg);
                    inertia[row * n + at] = column.lane(leg);
                }
                let forces = chain.springs[i] + chain.friction[i];
                bias[at] = (forces - coupling.torques[i]).lane(leg);
                acceleration.push(accelerations.links[i].lane(leg));
            }
        }
        let (mut feet, mut jacobians) = (Vec::new(), Vec::new());
        for leg in 0..count {
            let site = Site::new(legs, chain, &state, leg, N);
            feet.push(site.in_world(state.position, &base.rotation));
            let mut jacobian = Vec::new();
            for axis in 0..3 {
                let mut direction = [0.0; 3];
                direction[axis] = 1.0;
                let row = site.row(into_trunk(&base.rotation, direction));
                let mut line = vec![0.0; n];
                line[..6].copy_from_slice(&row.trunk);
                line[6 + N * leg..6 + N * (leg + 1)].copy_from_slice(&row.links);
                jacobian.extend(line);
            }
            jacobians.push(jacobian);
        }
        Ok(Self {
            inertia,
            bias,
            energy: articulated.stored(&model, legs, &state),
            feet,
            jacobians,
            acceleration,
        })
    }
}

/// Converts the posture to a state.
fn state<const N: usize>(model: &Model<N>, posture: &Posture) -> Result<State<Lanes, N>, LcpError> {
    let count = model.legs.len();
    let fits = posture.angles.len() == count && posture.velocity.len() == 6 + N * count;
    if !fits || posture.angles.iter().any(|leg| leg.len() != N) {
        let why = format!("the posture does not match {count} legs of {N} links");
        return Err(LcpError::Start(why));
    }
    let zero = Lanes::zero();
    let three = |from: usize| std::array::from_fn(|i| posture.velocity[from + i]);
    let mut state = State {
        position: posture.position,
        attitude: posture.orientation,
        velocity: three(0),
        turning: three(3),
        angles: [zero; N],
        rates: [zero; N],
        pulley: zero,
        pulley_rate: zero,
    };
    for (leg, angles) in posture.angles.iter().enumerate() {
        for i in 0..N {
            state.angles[i] = state.angles[i].with_lane(leg, angles[i]);
            let rate = posture.velocity[6 + N * leg + i];
            state.rates[i] = state.rates[i].with_lane(leg, rate);
        }
    }
    Ok(state)
}
