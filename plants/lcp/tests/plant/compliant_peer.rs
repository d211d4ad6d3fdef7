//! Comparison of compliant constraints with `tests/reference/compliant.py`: point masses in the
//! world frame, integrated by DOP853.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use twinrig_kernel::SimDuration;
use twinrig_lcp::{Lcp, Method, Options};
use twinrig_legged::{Abduction, Base, Constraints, Contacts, Drives, SetPoint, Setup, Start};
use twinrig_robot::{Compliance, Robot, Servo};
use twinrig_runtime::{Plant, PlantState};
use twinrig_testing::plant_harness::PlantHarness;
use twinrig_testing::python;
use twinrig_testing::reference_trajectory::flatten;
use twinrig_testing::robots::{LEGS, SERVO, flat_ground, pose, suspended, with_legs};

/// Interval of commands and comparisons.
const PERIOD_US: u64 = 2000;
const PERIOD_S: f64 = 1e-6 * PERIOD_US as f64;
const LINEAR: SetPoint = SetPoint::Linear {
    period: SimDuration::from_micros(PERIOD_US),
};

/// Duration in periods.
const PERIODS: usize = 100;

/// Greatest distance between the two trajectories of a trunk or foot \[m\].
const AGREEMENT: f64 = 2e-10;

/// Greatest distance from a trajectory with twice the step \[m\]: three times the error.
const HALVING: f64 = 3e-10;

/// A tolerance of the plant's error control, and the greatest distance from the peer under it, in
/// steps of a period \[m\].
const CONTROLLED: f64 = 2e-8;
const CONTROLLED_AGREEMENT: f64 = 3e-6;

/// Relative tolerance of the peer.
const TOLERANCE: f64 = 1e-12;

/// Relative change of a parameter that the comparison must notice.
const CHANGE: f64 = 1.0 + 1e-6;

/// Length of the steps in which the effect of a change is computed, in steps of the comparison: the
/// errors of both trajectories are nearly the same.
const SENSITIVITY_STEPS: u64 = 8;

/// Coefficient of friction.
const FRICTION: f64 = 0.6;

/// Change of the compliance of all legs, with the name of the parameter.
type Change = (&'static str, fn(&mut Compliance));

const STOPS: Change = ("stops", |leg| leg.stops.stiffness *= CHANGE);
const STOP_DAMPING: Change = ("damping of stops", |leg| leg.stops.damping *= CHANGE);
const CABLE: Change = ("cable", |leg| leg.cable.stiffness *= CHANGE);
const CABLE_DAMPING: Change = ("damping of the cable", |leg| leg.cable.damping *= CHANGE);
const SOLE: Change = ("sole", |leg| leg.sole.stiffness *= CHANGE);
const SOLE_DAMPING: Change = ("damping of the sole", |leg| leg.sole.damping *= CHANGE);
const SLIP: Change = ("slip deflection", |leg| leg.slip_deflection *= CHANGE);

/// Motion of a robot from a start under commands.
#[derive(Clone)]
struct Case {
    /// Fixed step of the plant \[ns\]. Kinks of the forces leave errors of second order; all others
    /// are rounding errors.
    step_ns: u64,
    base: Base,
    legs: &'static [&'static str],
    start: Start,
    /// Whether springs are less preloaded and joints less damped than in the robot file.
    loose: bool,
    servo: Option<Servo>,
    set_point: SetPoint,
    landing: Option<Landing>,
    /// Amplitudes of the sines that hips and pulleys follow \[rad\]; their frequency is
    /// [`FREQUENCY`].
    swing: [f64; 2],
}

/// Angular frequency of the commands \[rad/s\].
const FREQUENCY: f64 = 40.0;

/// Start of the trunk above level ground.
#[derive(Clone, Copy)]
struct Landing {
    /// Height of the trunk \[m\].
    height: f64,
    /// Velocity \[m/s\] and angular velocity \[rad/s\].
    velocity: [f64; 3],
    turning: [f64; 3],
}

impl Case {
    /// Returns a leg hanging from a fixed trunk without drives.
    fn hanging(q: [f64; 3], rates: [f64; 3]) -> Self {
        Self {
            step_ns: 125,
            base: Base::Fixed,
            legs: &["LF"],
            start: pose(q, rates),
            loose: false,
            servo: None,
            set_point: SetPoint::Held,
            landing: None,
            swing: [0.0; 2],
        }
    }

    /// Returns a leg hanging from a fixed trunk whose servos follow sines.
    fn swinging(set_point: SetPoint) -> Self {
        Self {
            loose: true,
            step_ns: 250,
            servo: Some(SERVO),
            set_point,
            swing: [0.3, 0.4],
            ..Self::hanging([-10.0, -20.0, 24.0], [0.0; 3])
        }
    }

    /// Returns a robot that lands in motion.
    fn landing(base: Base, landing: Landing) -> Self {
        Self {
            base,
            legs: &LEGS,
            start: Start::default(),
            landing: Some(landing),
            swing: [0.0; 2],
            ..Self::swinging(SetPoint::Held)
        }
    }

    fn robot(&self, change: Option<Change>) -> Robot {
        with_legs(|leg| {
            if self.loose {
                (leg.diagonal.preload, leg.parallel.preload) = (1e-4, 1e-4);
                let joints = &mut leg.joint_friction;
                for joint in [&mut joints.hip, &mut joints.knee, &mut joints.ankle] {
                    *joint *= 0.02;
                }
            }
            if let Some((_, change)) = change {
                change(leg.compliance.as_mut().unwrap());
            }
        })
    }

    fn harness(&self, robot: &Robot, step_ns: u64, tolerance: f64) -> PlantHarness<Lcp> {
        let drives = self.servo.map(|servo| Drives::Servos {
            hip: servo,
            knee: servo,
        });
        let options = Options {
            setup: Setup {
                base: self.base,
                ground: self.landing.map(|_| flat_ground(FRICTION)),
                step: SimDuration::from_nanos(step_ns),
                drives: drives.unwrap_or(Drives::None),
                abduction: Abduction::Locked,
                contacts: Contacts::Feet,
                set_point: self.set_point,
                ..suspended(self.legs, self.start.clone(), PERIOD_US)
            },
            constraints: Constraints::Compliant,
            method: Method::Rk4,
            tolerance,
            toe: false,
            features: twinrig_lcp::Features::Detected,
        };
        let mut plant = Lcp::new(robot, &options, &|_| true).unwrap();
        if let Some(landing) = self.landing {
            let state = plant.state().unwrap();
            let state = state
                .with("body/position", &[0.0, 0.0, landing.height])
                .with("body/velocity", &landing.velocity)
                .with("body/angular_velocity", &landing.turning);
            assert!(plant.resume_from(&state).unwrap().is_empty());
        }
        PlantHarness::new(plant)
    }

    /// Returns the commands of all periods, after those that hold the start.
    fn commands(&self, start: &[f64]) -> Vec<Vec<f64>> {
        let at = |period: usize| {
            let sine = libm::sin(FREQUENCY * PERIOD_S * period as f64);
            let inputs = start.iter().zip(self.swing.iter().cycle());
            inputs.map(|(at, swing)| at + swing * sine).collect()
        };
        (0..=PERIODS).map(at).collect()
    }

    /// Returns the positions in steps of a fixed length.
    fn trajectory(&self, change: Option<Change>, step_ns: u64) -> Vec<f64> {
        self.follow(self.harness(&self.robot(change), step_ns, f64::INFINITY))
    }

    /// Returns the positions of trunk and feet of a plant after each period.
    fn follow(&self, mut harness: PlantHarness<Lcp>) -> Vec<f64> {
        let feet = self.legs.iter();
        let feet = feet.map(|leg| format!("leg/{leg}/foot/position"));
        let signals: Vec<String> = [String::from("body/position")]
            .into_iter()
            .chain(feet)
            .collect();
        let mut positions = Vec::new();
        for commands in self.commands(&harness.commands).into_iter().skip(1) {
            harness.commands = commands;
            harness.advance_us(PERIOD_US);
            positions.extend(signals.iter().flat_map(|signal| harness.read(signal)));
        }
        positions
    }

    /// Returns the result of the peer.
    fn peer(&self, interpreter: &Path, tolerance: f64) -> Peer {
        let robot = self.robot(None);
        let harness = self.harness(&robot, self.step_ns, f64::INFINITY);
        let leg = &robot.legs[0].leg;
        let joints = leg.joint_friction;
        let case = json!({
            "base": match self.base {
                Base::Fixed => "fixed",
                Base::Planar => "planar",
                Base::Free => "free",
            },
            "legs": self.legs,
            "leg": {
                "preload_d": leg.diagonal.preload,
                "preload_p": leg.parallel.preload,
                "friction": [joints.hip, joints.knee, joints.ankle],
            },
            "friction": self.landing.map(|_| FRICTION),
            "servo": self.servo.map(|servo| json!({
                "lag": servo.lag,
                "speed": servo.speed,
                "torque": servo.torque,
                "inertia": servo.inertia,
            })),
            "linear": self.set_point != SetPoint::Held,
            "period_s": PERIOD_S,
            "commands": match self.servo {
                Some(_) => self.commands(&harness.commands),
                None => vec![vec![0.0; 2 * self.legs.len()]; PERIODS + 1],
            },
            "state": object(&harness.plant.state().unwrap()),
            "tolerance": tolerance,
        });
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/compliant.py");
        Peer(python::run(interpreter, &script, &[], &case))
    }

    /// Compares plant and peer, and checks that the comparison notices `changes`.
    fn compare(&self, interpreter: &Path, changes: &[Change]) -> Peer {
        let peer = self.peer(interpreter, TOLERANCE);
        let expected = peer.positions();
        let found = self.trajectory(None, self.step_ns);
        let [deviation, halving] = [&expected, &self.trajectory(None, 2 * self.step_ns)]
            .map(|other| distance(&found, other));
        assert!(deviation < AGREEMENT, "{deviation:e} m");
        assert!(halving < HALVING, "{halving:e} m");
        let controlled = self.harness(&self.robot(None), 1000 * PERIOD_US, CONTROLLED);
        let controlled = distance(&self.follow(controlled), &expected);
        assert!(controlled < CONTROLLED_AGREEMENT, "{controlled:e} m");
        let step_ns = SENSITIVITY_STEPS * self.step_ns;
        let unchanged = self.trajectory(None, step_ns);
        for &change in changes {
            let changed = distance(&self.trajectory(Some(change), step_ns), &unchanged);
            assert!(changed > AGREEMENT, "{}: {changed:e} m", change.0);
        }
        peer
    }
}

/// Result of the peer.
struct Peer(Value);

impl Peer {
    /// Returns the positions of trunk and feet after each period.
    fn positions(&self) -> Vec<f64> {
        flatten(&self.0["positions"])
    }

    /// Checks which elements were pressed.
    fn assert_pressed(&self, elements: &[&str]) {
        assert_eq!(self.0["pressed"], json!(elements));
    }

    /// Checks that a foot slides, and later sticks for 20 ms.
    fn assert_slid_and_stuck(&self) {
        let grips = flatten(&self.0["grips"]);
        let slides_then_sticks = |foot: usize| {
            let of_foot = grips.iter().skip(foot).step_by(LEGS.len());
            let later: Vec<&f64> = of_foot.skip_while(|&&grip| grip < 0.995).collect();
            later
                .windows(10)
                .any(|span| span.iter().all(|grip| (0.0..0.95).contains(*grip)))
        };
        assert!((0..LEGS.len()).any(slides_then_sticks), "{grips:?}");
    }
}

/// Returns a state as an object of JSON.
fn object(state: &PlantState) -> Value {
    let entries = state.iter();
    entries
        .map(|(name, values)| (name.to_owned(), json!(values)))
        .collect()
}

/// Returns the greatest difference between two trajectories.
fn distance(one: &[f64], other: &[f64]) -> f64 {
    assert_eq!(one.len(), other.len());
    let differences = one.iter().zip(other).map(|(a, b)| (a - b).abs());
    let finite = differences.inspect(|difference| assert!(difference.is_finite()));
    finite.fold(0.0, f64::max)
}

fn interpreter() -> Option<PathBuf> {
    python::python_of_peers("numpy, scipy")
}

#[test]
#[ignore = "slow"]
fn hanging_leg_agrees_with_peer() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    let loose = Case {
        loose: true,
        ..Case::hanging([-30.0, -20.0, 24.0], [20.0, -15.0, 25.0])
    };
    let peer = loose.compare(&interpreter, &[STOPS, STOP_DAMPING]);
    peer.assert_pressed(&["extended", "closed"]);
    // Released near the lower stop of the diagonal, towards it.
    let bent = Case::hanging([-10.0, -94.5, 97.0], [5.0, -40.0, 40.0]);
    let peer = bent.compare(&interpreter, &[STOPS, STOP_DAMPING]);
    peer.assert_pressed(&["extended", "bottomed", "open", "closed"]);
    let coarser = bent.peer(&interpreter, 10.0 * TOLERANCE);
    let error = distance(&coarser.positions(), &peer.positions());
    assert!(error < 1e-10, "error of the peer: {error:e} m");
}

#[test]
#[ignore = "slow"]
fn leg_with_servos_agrees_with_peer() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    let changes = [CABLE, CABLE_DAMPING];
    for set_point in [SetPoint::Held, LINEAR] {
        let peer = Case::swinging(set_point).compare(&interpreter, &changes);
        peer.assert_pressed(&["extended", "closed", "cable"]);
        // Steps of a held set-point saturate the torque of the hip.
        let saturated = peer.0["saturated"] != json!(0);
        assert_eq!(saturated, set_point == SetPoint::Held);
    }
}

#[test]
#[ignore = "slow"]
fn planar_landing_agrees_with_peer() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    let landing = Landing {
        height: 0.14,
        velocity: [0.4, 0.0, -0.1],
        turning: [0.0, -0.3, 0.0],
    };
    let case = Case::landing(Base::Planar, landing);
    let peer = case.compare(&interpreter, &[CABLE, SOLE, SOLE_DAMPING, SLIP]);
    peer.assert_pressed(&["closed", "cable", "sole"]);
    peer.assert_slid_and_stuck();
}

#[test]
#[ignore = "slow"]
fn free_landing_agrees_with_peer() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    let landing = Landing {
        height: 0.14,
        velocity: [0.4, 0.1, -0.1],
        turning: [0.3, -0.3, -0.5],
    };
    let case = Case {
        set_point: LINEAR,
        swing: [0.02, 0.05],
        ..Case::landing(Base::Free, landing)
    };
    let peer = case.compare(&interpreter, &[CABLE, SOLE, SOLE_DAMPING, SLIP]);
    peer.assert_pressed(&["closed", "cable", "sole"]);
    peer.assert_slid_and_stuck();
}
