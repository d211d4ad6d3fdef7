//! Signals: availability, selective reading, and order of outputs.

use std::cell::RefCell;

use nalgebra::{Matrix3, Vector3};
use twinrig_contact::{Ground, Surface, Terrain};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_legged::{
    Abduction, Base, Contacts, Drives, FootMotion, GroundImpulses, LEGS, Ledger, Readings,
    SetPoint, Setup, Signals, Start, Window,
};
use twinrig_robot::Motor;
use twinrig_runtime::EnergyBalance;

const NAMES: [&str; 2] = ["LF", "RH"];

fn setup(drives: bool, ground: bool) -> Setup {
    Setup {
        base: Base::Free,
        legs: NAMES.map(str::to_owned).to_vec(),
        ground: ground.then(|| Ground::new(Terrain::Flat, 0.6, 0.0).unwrap()),
        step: SimDuration::from_millis(1),
        drives: if drives {
            Drives::Ideal { period: 2e-3 }
        } else {
            Drives::None
        },
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: Start::default(),
    }
}

fn names(signals: &Signals, direction: Direction) -> Vec<&str> {
    let ports = signals.ports().iter();
    let ports = ports.filter(|port| port.direction == direction);
    ports.map(|port| port.name.as_str()).collect()
}

#[test]
fn commands_torques_and_cables_require_drives() {
    let (with, without) = (
        Signals::new(&NAMES, &setup(true, true), &|_| true),
        Signals::new(&NAMES, &setup(false, true), &|_| true),
    );
    assert_eq!(
        names(&with, Direction::Input),
        [
            "leg/LF/hip/command",
            "leg/LF/knee/command",
            "leg/RH/hip/command",
            "leg/RH/knee/command"
        ]
    );
    assert!(names(&without, Direction::Input).is_empty());
    let mut rest = names(&with, Direction::Output);
    rest.retain(|name| {
        let of_drives = ["hip/torque", "knee/", "cable/"];
        !of_drives.iter().any(|part| name.contains(part))
    });
    assert_eq!(names(&without, Direction::Output), rest);
    assert!(rest.contains(&"leg/LF/hip/position"));
}

const MOTOR: Motor = Motor {
    resistance: 0.6,
    torque_constant: 0.014,
    gear: 14.0,
    inertia: 5e-7,
    voltage: 24.0,
};

fn with_motors() -> Setup {
    let drives = Drives::Motors {
        hip: MOTOR,
        knee: MOTOR,
    };
    Setup {
        drives,
        ..setup(true, true)
    }
}

#[test]
fn motors_have_voltage_and_bridge_inputs_and_additional_rates() {
    let setup_with_motors = with_motors();
    let by_servos = Signals::new(&NAMES, &setup(true, true), &|_| true);
    let by_motors = Signals::new(&NAMES, &setup_with_motors, &|_| true);
    let inputs = names(&by_motors, Direction::Input);
    assert_eq!(
        inputs[..4],
        [
            "leg/LF/hip/voltage",
            "leg/LF/hip/bridge",
            "leg/LF/knee/voltage",
            "leg/LF/knee/bridge"
        ]
    );
    assert_eq!(
        inputs.len(),
        NAMES.len() * setup_with_motors.drives.inputs()
    );
    let mut common = names(&by_motors, Direction::Output);
    common.retain(|name| !name.ends_with("/rate"));
    assert_eq!(common, names(&by_servos, Direction::Output));
    let layout = Layout::of(by_motors.ports(), Direction::Output);
    let mut outputs = vec![f64::NAN; layout.len()];
    by_motors.write(
        &LoggedReadings::default(),
        None,
        &Window::default(),
        0.0,
        &mut outputs,
    );
    let read = |name: &str| &outputs[layout.find(name).unwrap()];
    assert_eq!(read("leg/RH/hip/rate"), [26.0]);
    assert_eq!(read("leg/LF/knee/rate"), [45.0]);
}

#[test]
fn loads_and_clearances_require_ground() {
    let signals = Signals::new(&NAMES, &setup(true, false), &|_| true);
    for name in names(&signals, Direction::Output) {
        let of_ground = ["foot/load", "foot/force", "foot/clearance"];
        assert!(!of_ground.iter().any(|part| name.contains(part)), "{name}");
    }
}

#[test]
fn non_finite_command_is_reported_by_name() {
    let signals = Signals::new(&NAMES, &setup(true, true), &|name| name == "body/rpy");
    let now = SimTime::ZERO + SimDuration::from_millis(3);
    let unused = || panic!("the energy was evaluated without a fault");
    assert!(signals.check_inputs(&[0.0; 4], now, unused).is_ok());
    let fault = signals.check_inputs(&[0.0, 1.0, f64::NAN, 0.0], now, || 2.5);
    let fault = fault.unwrap_err();
    assert_eq!(fault.part, "leg/RH/hip/command");
    assert_eq!((fault.time, fault.energy), (now, 2.5));
}

/// Readings with distinct values that log their calls.
#[derive(Default)]
struct LoggedReadings(RefCell<Vec<&'static str>>);

impl LoggedReadings {
    fn log<T>(&self, what: &'static str, value: T) -> T {
        self.0.borrow_mut().push(what);
        value
    }
}

impl Readings for LoggedReadings {
    fn position(&self) -> Vector3<f64> {
        self.log("position", Vector3::new(1.0, 2.0, 3.0))
    }
    fn attitude(&self) -> [f64; 4] {
        self.log("attitude", [1.0, 0.0, 0.0, 0.0])
    }
    fn rotation(&self) -> Matrix3<f64> {
        // Yaw by 90°.
        let rotation = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        self.log("rotation", rotation)
    }
    fn velocity(&self) -> Vector3<f64> {
        self.log("velocity", Vector3::new(4.0, 5.0, 6.0))
    }
    fn angular_velocity(&self) -> Vector3<f64> {
        self.log("angular velocity", Vector3::new(7.0, 8.0, 9.0))
    }
    fn energy(&self) -> EnergyBalance {
        let balance = EnergyBalance {
            kinetic: 10.0,
            residual: 17.0,
            ..EnergyBalance::default()
        };
        self.log("energy", balance)
    }
    fn hip(&self, leg: usize) -> f64 {
        self.log("hip", 20.0 + leg as f64)
    }
    fn hip_rate(&self, leg: usize) -> f64 {
        self.log("hip rate", 25.0 + leg as f64)
    }
    fn hip_torque(&self, leg: usize) -> f64 {
        self.log("hip torque", 30.0 + leg as f64)
    }
    fn pulley(&self, leg: usize) -> f64 {
        self.log("pulley", 40.0 + leg as f64)
    }
    fn pulley_rate(&self, leg: usize) -> f64 {
        self.log("pulley rate", 45.0 + leg as f64)
    }
    fn knee_torque(&self, leg: usize) -> f64 {
        self.log("knee torque", 50.0 + leg as f64)
    }
    fn cable_tension(&self, leg: usize) -> f64 {
        self.log("cable tension", 60.0 + leg as f64)
    }
    fn angles(&self, leg: usize) -> [f64; 3] {
        self.log("angles", [70.0 + leg as f64, 71.0, 72.0])
    }
    fn feet(&self) -> [FootMotion; LEGS] {
        let foot = |leg: usize| FootMotion {
            position: Vector3::new(80.0 + leg as f64, 0.0, 0.0),
            velocity: Vector3::new(90.0 + leg as f64, 0.0, 0.0),
        };
        self.log("feet", std::array::from_fn(foot))
    }
    fn ground_impulse(&self, leg: usize) -> [f64; 3] {
        self.log("ground impulse", [3.0, 0.0, 4.0 + leg as f64])
    }
    fn surfaces(&self, feet: &[FootMotion; LEGS]) -> [Surface; LEGS] {
        let below = |foot: FootMotion| Surface {
            gap: foot.position.x + 20.0,
            normal: Vector3::new(0.6, 0.0, 0.8),
        };
        self.log("surfaces", feet.map(below))
    }
}

#[test]
fn only_selected_signals_are_read() {
    let selected = ["body/position", "energy/kinetic", "energy/residual"];
    let signals = Signals::new(&NAMES, &setup(true, true), &|name| selected.contains(&name));
    let readings = LoggedReadings::default();
    let mut outputs = [f64::NAN; 5];
    signals.write(&readings, None, &Window::default(), 1.0, &mut outputs);
    assert_eq!(outputs, [1.0, 2.0, 3.0, 10.0, 17.0]);
    assert_eq!(readings.0.into_inner(), ["position", "energy"]);
}

#[test]
fn common_measurements_of_all_legs_are_read_once() {
    let calls = |selected: &[&str]| {
        let select = |name: &str| selected.iter().any(|part| name.ends_with(part));
        let signals = Signals::new(&NAMES, &setup(true, true), &select);
        let readings = LoggedReadings::default();
        let mut outputs = vec![f64::NAN; Layout::of(signals.ports(), Direction::Output).len()];
        signals.write(&readings, None, &Window::default(), 1.0, &mut outputs);
        readings.0.into_inner()
    };
    assert_eq!(calls(&["foot/position", "foot/velocity"]), ["feet"]);
    assert_eq!(calls(&["LF/foot/clearance"]), ["feet", "surfaces"]);
    let impulses = ["ground impulse", "ground impulse"];
    assert_eq!(calls(&["foot/force"]), impulses);
    let all = ["foot/position", "foot/load", "foot/force", "foot/clearance"];
    assert_eq!(calls(&all), [["feet", "surfaces"], impulses].concat());
}

/// Impulses on feet alone.
fn feet(of: &[[f64; 3]]) -> GroundImpulses {
    let mut impulses = GroundImpulses::default();
    impulses.feet[..of.len()].copy_from_slice(of);
    impulses
}

#[test]
fn legs_may_differ_in_their_selected_signals() {
    let selected = ["leg/LF/foot/load", "leg/RH/foot/velocity"];
    let signals = Signals::new(&NAMES, &setup(true, true), &|name| selected.contains(&name));
    let mut outputs = [f64::NAN; 4];
    let mut window = Window::default();
    window.begin(1.0, GroundImpulses::default());
    signals.write(&LoggedReadings::default(), None, &window, 2.0, &mut outputs);
    assert_eq!(outputs, [0.6 * 3.0 + 0.8 * 4.0, 91.0, 0.0, 0.0]);
}

#[test]
fn every_measurement_is_written_to_its_port() {
    let signals = Signals::new(&NAMES, &setup(true, true), &|_| true);
    let layout = Layout::of(signals.ports(), Direction::Output);
    let mut outputs = vec![f64::NAN; layout.len()];
    let mut window = Window::default();
    window.begin(1.0, feet(&[[1.0, 0.0, 0.0], [3.0, 0.0, 1.0]]));
    signals.write(&LoggedReadings::default(), None, &window, 1.5, &mut outputs);
    assert!(outputs.iter().all(|value| value.is_finite()), "{outputs:?}");
    let read = |name: &str| &outputs[layout.find(name).unwrap()];
    assert_eq!(read("body/velocity"), [4.0, 5.0, 6.0]);
    assert_eq!(read("body/rpy"), [0.0, 0.0, core::f64::consts::FRAC_PI_2]);
    assert_eq!(read("energy/residual"), [17.0]);
    assert_eq!(read("leg/RH/hip/position"), [21.0]);
    assert_eq!(read("leg/LF/cable/tension"), [60.0]);
    assert_eq!(read("leg/RH/angles"), [71.0, 71.0, 72.0]);
    assert_eq!(read("leg/RH/foot/clearance"), [101.0]);
    // Means over half a second of the impulses since the start of the window.
    assert_eq!(read("leg/LF/foot/force"), [4.0, 0.0, 8.0]);
    assert_eq!(read("leg/RH/foot/force"), [0.0, 0.0, 8.0]);
    let load = read("leg/LF/foot/load")[0];
    assert!((load - (0.6 * 4.0 + 0.8 * 8.0)).abs() < 1e-12, "{load}");
}

#[test]
fn empty_window_has_zero_force() {
    let mut window = Window::default();
    window.begin(2.0, feet(&[[5.0; 3]]));
    let force = window.mean_force(|before| before.feet[0], &[9.0; 3], 2.0);
    assert_eq!(force, Vector3::zeros());
}

#[test]
fn ledger_reports_residual_and_counts_each_transfer_once() {
    let mut ledger = Ledger::opened([1.0, 2.0, 3.0]);
    ledger.actuator += 0.5;
    ledger.dissipated += 0.25;
    // 1 J moves from kinetic to spring energy; a quarter of a joule of the drives' work is stored.
    ledger.close_step([0.0, 3.25, 3.0]);
    let balance = ledger.balance();
    assert_eq!(balance.residual, 0.0);
    assert_eq!(balance.stored(), 6.25);
    // (1 + 1.25 stored, 0.5 + 0.25 in flows) / 2
    assert_eq!(balance.exchanged, 1.5);
    ledger.close_step([0.0, 3.25, 3.125]);
    assert_eq!(ledger.balance().residual, 0.125);
}
