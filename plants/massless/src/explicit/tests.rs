//! The largest stable step against its closed form.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{
    Abduction, Base, Contacts, Drives, LeggedPlant, Push, PushShape, PushTarget, Setup,
};
use twinrig_legged::{SetPoint, StartPose};
use twinrig_robot::leg::{EnergyTable, Joints, Pantograph, Planar, Pose};
use twinrig_robot::{Robot, RobotFile};
use twinrig_runtime::Plant;

use crate::model::GRAVITY;
use crate::plant::Islands;
use crate::{Force, Method, Options};

/// Cells of the table, and share of the closed form within which the measured limit is.
const CELLS: usize = 64;
const TOLERANCE: f64 = 2e-3;

/// Cheetah-cub with a multiple of the friction of its joints.
fn robot(friction: f64) -> Robot {
    let text = include_str!("../../../../robots/cheetah-cub.toml");
    let file = RobotFile::parse("cheetah-cub.toml", text).unwrap();
    let mut robot = file.robot().unwrap();
    for mount in &mut robot.legs {
        mount.leg.joint_friction.knee *= friction;
        mount.leg.joint_friction.ankle *= friction;
    }
    robot
}

/// A leg whose hip is held, on half of the robot's weight as in a trot: its pantograph is closed,
/// so that the knee alone moves.
struct Stance {
    leg: Pantograph,
    table: Option<EnergyTable>,
    /// Force on the foot other than that of the leg.
    load: Planar,
    /// Angle of the knee at rest.
    knee: f64,
}

impl Stance {
    fn new(robot: &Robot, force: Force) -> Self {
        let of_leg = &robot.legs[0].leg;
        let leg = Pantograph::new(of_leg).unwrap();
        let table = match force {
            Force::LinearLookup { cells } => {
                let table = EnergyTable::new(&leg, cells).unwrap();
                Some(table.with_linear_forces().unwrap())
            }
            _ => None,
        };
        let load = 0.5 * robot.mass() - of_leg.mass.lumped_foot;
        let mut stance = Self {
            leg,
            table,
            load: Planar::new(0.0, load * GRAVITY),
            knee: 0.0,
        };
        let (mut bent, mut straight) = (-1.2, 0.0);
        for _ in 0..60 {
            let middle = 0.5 * (bent + straight);
            if stance.torque(middle) > 0.0 {
                straight = middle;
            } else {
                bent = middle;
            }
        }
        stance.knee = bent;
        stance
    }

    fn pose(&self, knee: f64) -> Pose {
        let joints = Joints {
            q2: knee,
            q3: -knee,
        };
        self.leg
            .pose_of_angles(self.leg.angles(0.0, joints))
            .unwrap()
    }

    /// Derivative of the foot by the knee.
    fn travel(&self, knee: f64) -> Planar {
        let h = 1e-6;
        (self.pose(knee + h).foot - self.pose(knee - h).foot) / (2.0 * h)
    }

    /// Torque against the angle of the knee, of springs and load.
    fn torque(&self, knee: f64) -> f64 {
        let pose = self.pose(knee);
        let hip = self.leg.hip_reference();
        let spring = match &self.table {
            None => self.leg.spring_gradient(&pose),
            Some(table) => {
                table
                    .look_up(libm::sin(hip), libm::cos(hip), pose.foot)
                    .unwrap()
                    .1
            }
        };
        (spring.foot - self.load).dot(&self.travel(knee))
    }

    /// Inertia, damping and stiffness of m q̈ + c q̇ + k q = 0 about the stance.
    fn linear(&self, robot: &Robot) -> [f64; 3] {
        let of_leg = &robot.legs[0].leg;
        let friction = of_leg.joint_friction;
        let h = 1e-5;
        let slope = self.torque(self.knee + h) - self.torque(self.knee - h);
        [
            of_leg.mass.lumped_foot * self.travel(self.knee).norm_squared(),
            // Hip held: the second segment turns by the angle of the knee, the third not at all.
            friction.knee + friction.ankle,
            slope / (2.0 * h),
        ]
    }
}

/// Plant in the stance, its foot moving by 0.1 mm/s along its path.
fn plant(robot: &Robot, stance: &Stance, force: Force, step: SimDuration) -> LeggedPlant<Islands> {
    let leg = robot.legs[0].name.clone();
    let q = [0.0, stance.knee, -stance.knee];
    let setup = Setup {
        base: Base::Fixed,
        legs: vec![leg.clone()],
        ground: None,
        step,
        drives: Drives::Ideal { period: 5e-3 },
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: StartPose { q, rates: [0.0; 3] }.into(),
    };
    let options = Options {
        method: Method::ExplicitEuler,
        ..Options::new(setup, force)
    };
    let weight = robot.legs[0].leg.mass.lumped_foot * GRAVITY;
    let load = Push {
        name: "load".to_owned(),
        target: PushTarget::Foot(leg),
        at: SimTime::ZERO,
        duration: SimDuration::from_secs(3600),
        shape: PushShape::Rectangle,
        peak: [0.0, 0.0, stance.load.y + weight],
    };
    let plant = LeggedPlant::new(robot, &options, &|_| false).unwrap();
    let mut plant: LeggedPlant<Islands> = plant.with_pushes(&[load], &|_| false).unwrap();
    let mut state = plant.dynamics().flows[0].state;
    state.set_foot_velocity(0, stance.travel(stance.knee).normalize() * 1e-4);
    plant.dynamics_mut().flows[0].replace(&state).unwrap();
    plant
}

/// Whether the speed of the foot grows from the first to the last quarter of a run.
fn grows(robot: &Robot, stance: &Stance, force: Force, seconds: f64) -> bool {
    const STEPS: usize = 10_000;
    let step = SimDuration::try_from_secs_f64(seconds).unwrap();
    let mut plant = plant(robot, stance, force, step);
    let mut now = SimTime::ZERO;
    let mut peaks = [0.0_f64; 4];
    for i in 0..STEPS {
        now += step;
        plant.advance(now, &[0.0, 0.0]).unwrap();
        let speed = plant.dynamics().flows[0].state.foot_velocity(0).norm();
        let quarter = &mut peaks[4 * i / STEPS];
        *quarter = quarter.max(speed);
    }
    peaks[3] > peaks[0]
}

/// The amplification of explicit Euler on m q̈ + c q̇ + k q = 0 has λ² − (2 − hc/m) λ + 1 − hc/m +
/// h²k/m = 0. Below critical damping its roots are conjugate, |λ|² = 1 − hc/m + h²k/m, which is at
/// most 1 for h ≤ c/k. At 2e-3 from the limit the amplitude changes by h²k/2m · 2e-3 a step, 1.8e-5
/// and more, hence by a tenth and more over the run; the motion, of some µm, changes k by 1e-4.
#[test]
fn largest_stable_step_of_a_stance_is_damping_over_stiffness() {
    for (friction, force) in [
        (1.0, Force::Solve),
        (0.4, Force::Solve),
        (1.0, Force::LinearLookup { cells: CELLS }),
    ] {
        let robot = robot(friction);
        let stance = Stance::new(&robot, force);
        let [m, c, k] = stance.linear(&robot);
        assert!(stance.knee < -0.1 && c * c < 4.0 * k * m, "underdamped");
        let limit = c / k;
        for (share, unstable) in [(1.0 - TOLERANCE, false), (1.0 + TOLERANCE, true)] {
            let found = grows(&robot, &stance, force, share * limit);
            assert_eq!(
                found, unstable,
                "{share} of {limit:e} s at {friction} {force:?}"
            );
        }
    }
}
