//! Signals: which there are, that they are asked for only when wanted, and that each lands in its place.

use std::cell::RefCell;

use nalgebra::{Matrix3, Vector3};
use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_legged::{Base, Drives, Ledger, Readings, Setup, Signals, Start, Window};
use twinrig_robot::Motor;
use twinrig_runtime::EnergyBalance;

const LEGS: [&str; 2] = ["LF", "RH"];

fn setup(drives: bool, ground: bool) -> Setup {
    Setup {
        base: Base::Free,
        legs: LEGS.map(str::to_owned).to_vec(),
        ground: ground.then(|| Ground::new(Terrain::Flat, 0.6, 0.0).unwrap()),
        step: SimDuration::from_millis(1),
        drives: if drives {
            Drives::Ideal { period: 2e-3 }
        } else {
            Drives::None
        },
        start: Start::default(),
    }
}

fn names(signals: &Signals, direction: Direction) -> Vec<&str> {
    let ports = signals.ports().iter();
    let ports = ports.filter(|port| port.direction == direction);
    ports.map(|port| port.name.as_str()).collect()
}

#[test]
fn without_drives_there_are_no_commands_torques_and_cables() {
    let (with, without) = (
        Signals::new(&LEGS, &setup(true, true), &|_| true),
        Signals::new(&LEGS, &setup(false, true), &|_| true),
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
fn motors_are_given_voltages_and_bridges_and_measured_like_servos_with_their_rates_besides() {
    let driven = with_motors();
    let by_servos = Signals::new(&LEGS, &setup(true, true), &|_| true);
    let by_motors = Signals::new(&LEGS, &driven, &|_| true);
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
    assert_eq!(inputs.len(), LEGS.len() * driven.drives.inputs());
    let mut measured = names(&by_motors, Direction::Output);
    measured.retain(|name| !name.ends_with("/rate"));
    assert_eq!(measured, names(&by_servos, Direction::Output));
    let layout = Layout::of(by_motors.ports(), Direction::Output);
    let mut outputs = vec![f64::NAN; layout.len()];
    by_motors.write(&Asked::default(), &Window::default(), 0.0, &mut outputs);
    let read = |name: &str| &outputs[layout.find(name).unwrap()];
    assert_eq!(read("leg/RH/hip/rate"), [26.0]);
    assert_eq!(read("leg/LF/knee/rate"), [45.0]);
}

#[test]
fn without_ground_there_are_no_loads_and_clearances() {
    let signals = Signals::new(&LEGS, &setup(true, false), &|_| true);
    for name in names(&signals, Direction::Output) {
        let of_ground = ["foot/load", "foot/force", "foot/clearance"];
        assert!(!of_ground.iter().any(|part| name.contains(part)), "{name}");
    }
}

#[test]
fn a_command_that_is_no_number_is_named() {
    let signals = Signals::new(&LEGS, &setup(true, true), &|name| name == "body/rpy");
    let now = SimTime::ZERO + SimDuration::from_millis(3);
    let unasked = || panic!("nobody needs the energy");
    assert!(signals.check_inputs(&[0.0; 4], now, unasked).is_ok());
    let fault = signals.check_inputs(&[0.0, 1.0, f64::NAN, 0.0], now, || 2.5);
    let fault = fault.unwrap_err();
    assert_eq!(fault.part, "leg/RH/hip/command");
    assert_eq!((fault.time, fault.energy), (now, 2.5));
}

/// Answers with numbers of its own, and notes what it is asked.
#[derive(Default)]
struct Asked(RefCell<Vec<&'static str>>);

impl Asked {
    fn note<T>(&self, what: &'static str, answer: T) -> T {
        self.0.borrow_mut().push(what);
        answer
    }
}

impl Readings for Asked {
    fn position(&self) -> Vector3<f64> {
        self.note("position", Vector3::new(1.0, 2.0, 3.0))
    }
    fn attitude(&self) -> [f64; 4] {
        self.note("attitude", [1.0, 0.0, 0.0, 0.0])
    }
    fn rotation(&self) -> Matrix3<f64> {
        // Yaw by 90°.
        let turned = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        self.note("rotation", turned)
    }
    fn velocity(&self) -> Vector3<f64> {
        self.note("velocity", Vector3::new(4.0, 5.0, 6.0))
    }
    fn angular_velocity(&self) -> Vector3<f64> {
        self.note("angular velocity", Vector3::new(7.0, 8.0, 9.0))
    }
    fn energy(&self) -> EnergyBalance {
        let balance = EnergyBalance {
            kinetic: 10.0,
            residual: 17.0,
            ..EnergyBalance::default()
        };
        self.note("energy", balance)
    }
    fn hip(&self, leg: usize) -> f64 {
        self.note("hip", 20.0 + leg as f64)
    }
    fn hip_rate(&self, leg: usize) -> f64 {
        self.note("hip rate", 25.0 + leg as f64)
    }
    fn hip_torque(&self, leg: usize) -> f64 {
        self.note("hip torque", 30.0 + leg as f64)
    }
    fn pulley(&self, leg: usize) -> f64 {
        self.note("pulley", 40.0 + leg as f64)
    }
    fn pulley_rate(&self, leg: usize) -> f64 {
        self.note("pulley rate", 45.0 + leg as f64)
    }
    fn knee_torque(&self, leg: usize) -> f64 {
        self.note("knee torque", 50.0 + leg as f64)
    }
    fn cable_tension(&self, leg: usize) -> f64 {
        self.note("cable tension", 60.0 + leg as f64)
    }
    fn angles(&self, leg: usize) -> [f64; 3] {
        self.note("angles", [70.0 + leg as f64, 71.0, 72.0])
    }
    fn foot_position(&self, leg: usize) -> Vector3<f64> {
        self.note("foot position", Vector3::new(80.0 + leg as f64, 0.0, 0.0))
    }
    fn foot_velocity(&self, leg: usize) -> Vector3<f64> {
        self.note("foot velocity", Vector3::new(90.0 + leg as f64, 0.0, 0.0))
    }
    fn ground_impulse(&self, leg: usize) -> [f64; 3] {
        self.note("ground impulse", [3.0, 0.0, 4.0 + leg as f64])
    }
    fn ground_normal(&self, _: usize) -> Vector3<f64> {
        self.note("ground normal", Vector3::new(0.6, 0.0, 0.8))
    }
    fn clearance(&self, leg: usize) -> f64 {
        self.note("clearance", 100.0 + leg as f64)
    }
}

#[test]
fn only_what_is_wanted_is_asked_for() {
    let wanted = ["body/position", "energy/kinetic", "energy/residual"];
    let signals = Signals::new(&LEGS, &setup(true, true), &|name| wanted.contains(&name));
    let asked = Asked::default();
    let mut outputs = [f64::NAN; 5];
    signals.write(&asked, &Window::default(), 1.0, &mut outputs);
    assert_eq!(outputs, [1.0, 2.0, 3.0, 10.0, 17.0]);
    assert_eq!(asked.0.into_inner(), ["energy", "position"]);
}

#[test]
fn every_measurement_lands_in_its_place() {
    let signals = Signals::new(&LEGS, &setup(true, true), &|_| true);
    let layout = Layout::of(signals.ports(), Direction::Output);
    let mut outputs = vec![f64::NAN; layout.len()];
    let mut window = Window::default();
    window.begin(1.0, &[[1.0, 0.0, 0.0], [3.0, 0.0, 1.0]]);
    signals.write(&Asked::default(), &window, 1.5, &mut outputs);
    assert!(outputs.iter().all(|value| value.is_finite()), "{outputs:?}");
    let read = |name: &str| &outputs[layout.find(name).unwrap()];
    assert_eq!(read("body/velocity"), [4.0, 5.0, 6.0]);
    assert_eq!(read("body/rpy"), [0.0, 0.0, core::f64::consts::FRAC_PI_2]);
    assert_eq!(read("energy/residual"), [17.0]);
    assert_eq!(read("leg/RH/hip/position"), [21.0]);
    assert_eq!(read("leg/LF/cable/tension"), [60.0]);
    assert_eq!(read("leg/RH/angles"), [71.0, 71.0, 72.0]);
    assert_eq!(read("leg/RH/foot/clearance"), [101.0]);
    // Means over half a second, of what has come since the window began.
    assert_eq!(read("leg/LF/foot/force"), [4.0, 0.0, 8.0]);
    assert_eq!(read("leg/RH/foot/force"), [0.0, 0.0, 8.0]);
    let load = read("leg/LF/foot/load")[0];
    assert!((load - (0.6 * 4.0 + 0.8 * 8.0)).abs() < 1e-12, "{load}");
}

#[test]
fn a_window_that_begins_has_no_force_yet() {
    let mut window = Window::default();
    window.begin(2.0, &[[5.0; 3]]);
    let force = window.mean_force(0, &[9.0; 3], 2.0);
    assert_eq!(force, Vector3::zeros());
}

#[test]
fn books_show_what_does_not_add_up_and_count_what_moves_once() {
    let mut ledger = Ledger::opened([1.0, 2.0, 3.0]);
    ledger.actuator += 0.5;
    ledger.dissipated += 0.25;
    // A joule goes from kinetic to spring energy, a quarter of the drives' work stays.
    ledger.close_step([0.0, 3.25, 3.0]);
    let balance = ledger.balance();
    assert_eq!(balance.residual, 0.0);
    assert_eq!(balance.stored(), 6.25);
    // (1 + 1.25 in store, 0.5 + 0.25 in flows) / 2
    assert_eq!(balance.exchanged, 1.5);
    ledger.close_step([0.0, 3.25, 3.125]);
    assert_eq!(ledger.balance().residual, 0.125);
}
