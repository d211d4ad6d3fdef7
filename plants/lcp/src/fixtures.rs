//! Robots for tests.

use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::SimDuration;
use twinrig_legged::{Abduction, Base, Contacts, Drives, Ledger, SetPoint, Setup, StartPose};
use twinrig_robot::{Robot, RobotFile};

use crate::constraints::motion::Motion;
use crate::integrators::right_hand_side::RightHandSide;
use crate::model::Model;
use crate::model::real::{Lanes, Real};
use crate::model::state::State;
use crate::plant::flow::Flow;

/// Relative joint angles \[°\] and rates \[rad/s\] of a start.
pub(crate) type Pose = ([f64; 3], [f64; 3]);

/// The passive legs of the thesis, at rest on their lower stop.
pub(crate) const PASSIVE: Pose = ([10.0, -9.5, 9.5], [0.0; 3]);

/// A start with hard impacts on the stops.
pub(crate) const HARD: Pose = ([20.0, -40.0, 62.0], [-10.0, 15.0, 30.0]);

pub(crate) fn robot() -> Robot {
    let text = include_str!("../../../robots/cheetah-cub.toml");
    RobotFile::parse("cheetah-cub.toml", text)
        .unwrap()
        .robot()
        .unwrap()
}

/// Returns drives with the robot's servos.
pub(crate) fn servo_drives(robot: &Robot) -> Drives {
    let (hip, knee) = (robot.actuators.hip, robot.actuators.knee);
    Drives::Servos { hip, knee }
}

pub(crate) fn flat() -> Ground {
    Ground::new(Terrain::Flat, 0.6, 0.0).unwrap()
}

/// Returns the setup of all legs of a robot in a pose.
pub(crate) fn setup(
    robot: &Robot,
    base: Base,
    (angles, rates): Pose,
    drives: Drives,
    ground: Option<Ground>,
) -> Setup {
    Setup {
        base,
        legs: robot.legs.iter().map(|mount| mount.name.clone()).collect(),
        ground,
        step: SimDuration::from_millis(2),
        drives,
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: StartPose {
            q: angles.map(f64::to_radians),
            rates,
        }
        .into(),
    }
}

/// Builds a robot in a pose, with legs of `N` links.
pub(crate) fn flow<const N: usize>(
    robot: &Robot,
    base: Base,
    pose: Pose,
    drives: Drives,
    ground: Option<Ground>,
) -> Flow<N> {
    let setup = setup(robot, base, pose, drives, ground);
    let model = Model::<N>::new(robot, &setup).unwrap();
    let zero = Lanes::zero();
    let mut state = State {
        position: [0.0; 3],
        attitude: [1.0, 0.0, 0.0, 0.0],
        velocity: [0.0; 3],
        turning: [0.0; 3],
        angles: [zero; N],
        rates: [zero; N],
        pulley: zero,
        pulley_rate: zero,
    };
    for (i, leg) in model.legs.iter().enumerate() {
        let start = setup.start.of_leg(&leg.name, &leg.pantograph).unwrap();
        for k in 0..N {
            let toe = if k > 2 { leg.constants.toe[1] } else { 0.0 };
            state.angles[k] = state.angles[k].with_lane(i, start.angles[k.min(2)] + toe);
            state.rates[k] = state.rates[k].with_lane(i, start.rates[k.min(2)]);
        }
        state.pulley = state.pulley.with_lane(i, start.command.knee);
    }
    let [hip, pulley] = [state.angles[0], state.pulley];
    let mut flow = new_flow(model, state);
    (flow.run.mode.commands.hip, flow.run.mode.commands.pulley) = (hip, pulley);
    flow
}

fn new_flow<const N: usize>(model: Model<N>, state: State<Lanes, N>) -> Flow<N> {
    Flow::new(model, state, crate::options::Method::Rodas4, f64::INFINITY)
}

/// Returns the right-hand side in a state, in the mode of the flow.
pub(crate) fn motion<const N: usize>(
    flow: &mut Flow<N>,
    state: &State<Lanes, N>,
    recovery: f64,
) -> Motion<Lanes, N> {
    RightHandSide::default().motion(&flow.model, &mut flow.run, state, recovery)
}

/// Gives the trunk linear and angular velocity in all directions.
pub(crate) fn tumbling<const N: usize>(flow: &mut Flow<N>) {
    flow.run.state.position = [0.1, -0.2, 0.5];
    flow.run.state.attitude = [0.9, 0.3, -0.2, 0.245];
    flow.run.state.velocity = [1.0, 0.5, 2.0];
    flow.run.state.turning = [3.0, -2.0, 5.0];
    let size = libm::sqrt(flow.run.state.attitude.iter().map(|c| c * c).sum());
    flow.run.state.attitude = flow.run.state.attitude.map(|c| c / size);
    let stored = flow.stored();
    flow.run.ledger = Ledger::opened(stored);
}

/// Returns the position of the first leg's foot in the leg plane \[m\].
pub(crate) fn foot<const N: usize>(flow: &Flow<N>) -> [f64; 2] {
    let links = &flow.model.legs[0].constants.links;
    let mut foot = [0.0; 2];
    for (link, angle) in links.iter().zip(&flow.run.state.angles) {
        foot[0] += link * libm::sin(angle.lane(0));
        foot[1] -= link * libm::cos(angle.lane(0));
    }
    foot
}

/// Returns the root mean square distance of two traces.
pub(crate) fn rms(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let squares = a.iter().zip(b).map(|(a, b)| {
        let [x, y] = [a[0] - b[0], a[1] - b[1]];
        x * x + y * y
    });
    libm::sqrt(squares.sum::<f64>() / a.len() as f64)
}

/// Returns the maximum difference of two states over all coordinates and rates.
pub(crate) fn distance<const N: usize>(a: &State<Lanes, N>, b: &State<Lanes, N>) -> f64 {
    let mut most = 0.0_f64;
    let trunk = [
        (&a.position[..], &b.position[..]),
        (&a.attitude[..], &b.attitude[..]),
        (&a.velocity[..], &b.velocity[..]),
        (&a.turning[..], &b.turning[..]),
    ];
    for (a, b) in trunk.into_iter().flat_map(|(a, b)| a.iter().zip(b)) {
        most = most.max((a - b).abs());
    }
    let legs = [(&a.angles, &b.angles), (&a.rates, &b.rates)];
    let legs = legs.into_iter().flat_map(|(a, b)| a.iter().zip(b));
    let pulleys = [(&a.pulley, &b.pulley), (&a.pulley_rate, &b.pulley_rate)];
    for (a, b) in legs.chain(pulleys) {
        for lane in 0..4 {
            most = most.max((a.lane(lane) - b.lane(lane)).abs());
        }
    }
    most
}

/// Returns a robot with point feet whose legs swing between their stops.
pub(crate) fn between_stops() -> (Robot, Pose) {
    let mut robot = robot();
    for mount in &mut robot.legs {
        let leg = &mut mount.leg;
        leg.toe = None;
        leg.diagonal.preload = -0.004;
        leg.parallel.preload = -0.004;
        leg.parallel_travel = 0.014;
    }
    (robot, ([10.0, -25.0, 37.0], [6.0, -4.0, 3.0]))
}

/// Returns a robot with point feet.
pub(crate) fn without_toes() -> Robot {
    let mut robot = robot();
    for mount in &mut robot.legs {
        mount.leg.toe = None;
    }
    robot
}

/// Builds a robot that hangs from a fixed trunk, without motors.
pub(crate) fn hanging(robot: &Robot, pose: Pose) -> Flow<3> {
    flow(robot, Base::Fixed, pose, Drives::None, None)
}

/// Returns the trace of the foot in steps of 2 ms, and the flow at its end.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "small counts"
)]
pub(crate) fn trace(
    mut flow: Flow<3>,
    seconds: f64,
    h: f64,
    mut step: impl FnMut(&mut Flow<3>, f64),
) -> (Vec<[f64; 2]>, Flow<3>) {
    let per = libm::round(2e-3 / h) as usize;
    let mut feet = Vec::new();
    for _ in 0..libm::round(seconds / 2e-3) as usize {
        for _ in 0..per {
            step(&mut flow, h);
        }
        feet.push(foot(&flow));
    }
    (feet, flow)
}
