//! Serial servos as the drives of legs, in all plants of this build.

use std::path::Path;

use twinrig_actuator::serial::{Bridge, Firmware, ServoCommand};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_lcp::{Constraints, Lcp, Method};
use twinrig_legged::{Abduction, Base, Contacts, Drives, FirmwarePlace, SetPoint, Setup, Start};
use twinrig_massless::{Force, Massless};
use twinrig_robot::serial::{Gear, Heating, SerialServo};
use twinrig_robot::{Robot, RobotFile};
use twinrig_runtime::Plant;

fn robot(name: &str) -> Robot {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    RobotFile::find(name, root).unwrap().robot().unwrap()
}

fn cub() -> Robot {
    robot("cheetah-cub-sts3215")
}

/// Two legs of a robot that hangs from its trunk, with this servo.
fn setup(servo: &SerialServo) -> Setup {
    setup_with(servo, FirmwarePlace::Plant)
}

fn setup_with(servo: &SerialServo, firmware: FirmwarePlace) -> Setup {
    Setup {
        base: Base::Fixed,
        legs: vec!["LF".to_owned(), "RH".to_owned()],
        ground: None,
        step: SimDuration::from_millis(1),
        drives: Drives::Serial {
            servo: Box::new(*servo),
            firmware,
        },
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: Start::default(),
    }
}

fn is_position(name: &str) -> bool {
    name.ends_with("hip/position") || name.ends_with("knee/position")
}

fn is_measured(name: &str) -> bool {
    is_position(name) || name.ends_with("/current") || name.ends_with("/supply")
}

fn lcp(robot: &Robot, setup: Setup, constraints: Constraints, method: Method) -> Box<dyn Plant> {
    let options = twinrig_lcp::Options {
        constraints,
        setup,
        method,
        tolerance: twinrig_lcp::Options::TOLERANCE,
        features: twinrig_lcp::Features::Detected,
        toe: false,
    };
    Box::new(Lcp::new(robot, &options, &is_measured).unwrap())
}

fn massless(robot: &Robot, setup: Setup, constraints: Constraints) -> Box<dyn Plant> {
    let mut options = twinrig_massless::Options::new(setup, Force::Solve);
    options.constraints = constraints;
    Box::new(Massless::new(robot, &options, &is_measured).unwrap())
}

/// All plants, with their names.
fn plants(servo: &SerialServo) -> Vec<(&'static str, Box<dyn Plant>)> {
    plants_of(setup(servo))
}

fn plants_of(setup: Setup) -> Vec<(&'static str, Box<dyn Plant>)> {
    let robot = cub();
    let (rigid, compliant) = (Constraints::Rigid, Constraints::Compliant);
    vec![
        ("lcp", lcp(&robot, setup.clone(), compliant, Method::Rk4)),
        ("lcp, rigid", lcp(&robot, setup.clone(), rigid, Method::Rk4)),
        (
            "lcp, time stepping",
            lcp(&robot, setup.clone(), rigid, Method::Moreau),
        ),
        ("massless", massless(&robot, setup.clone(), compliant)),
        ("massless, rigid", massless(&robot, setup, rigid)),
    ]
}

/// Angles of hip and knee of the second leg.
fn angles(plant: &mut dyn Plant) -> [f64; 2] {
    let layout = Layout::of(&plant.ports(), Direction::Output);
    let mut outputs = vec![0.0; layout.len()];
    plant.observe(&mut outputs);
    ["hip", "knee"].map(|joint| {
        let field = layout.find(&format!("leg/RH/{joint}/position")).unwrap();
        outputs[field.start]
    })
}

fn instant(ms: f64) -> SimTime {
    SimTime::ZERO + SimDuration::try_from_secs_f64(1e-3 * ms).unwrap()
}

/// Returns commands at a time \[ms\]: hips swing, knees bend, those of the first leg by half and
/// the other way.
fn swing_commands(ms: u32, home: [f64; 2]) -> [f64; 4] {
    let phase = core::f64::consts::TAU * 1e-3 * f64::from(ms);
    let (hip, knee) = (libm::sin(phase), 1.0 - libm::cos(2.0 * phase));
    [
        home[0] - 0.15 * hip,
        home[1] + 0.07 * knee,
        home[0] + 0.3 * hip,
        home[1] + 0.15 * knee,
    ]
}

/// Advances by commands every 2 ms from `from` to `to` \[ms\].
fn swing(plant: &mut dyn Plant, [from, to]: [u32; 2], home: [f64; 2]) -> Vec<[f64; 2]> {
    let ticks = (from + 2..=to).step_by(2);
    ticks
        .map(|ms| {
            let commands = swing_commands(ms, home);
            plant.advance(instant(f64::from(ms)), &commands).unwrap();
            angles(plant)
        })
        .collect()
}

/// The inertia of a leg is 2.5 % of that of the servo. It is not quite that of a mass at the foot,
/// and methods differ: 0.3 mrad of a swing of 0.3 rad were found.
#[test]
fn plants_move_a_leg_alike() {
    let servo = cub().serial.unwrap();
    let tracks: Vec<_> = plants(&servo)
        .into_iter()
        .map(|(name, mut plant)| {
            let home = angles(&mut *plant);
            (name, swing(&mut *plant, [0, 2000], home))
        })
        .collect();
    let [(_, reference), others @ ..] = &tracks[..] else {
        panic!("no plants");
    };
    let reached = reference.iter().map(|[hip, _]| hip - reference[0][0]);
    assert!(reached.fold(0.0, f64::max) > 0.25);
    for (name, track) in others {
        for joint in 0..2 {
            let pairs = track.iter().zip(reference);
            let worst = pairs
                .map(|(a, b)| (a[joint] - b[joint]).abs())
                .fold(0.0, f64::max);
            assert!(worst < 1e-3, "{name}: {worst} rad at {joint}");
        }
    }
}

/// Saved between two steps of the firmware, with commands under way.
#[test]
fn restored_servos_continue_bit_for_bit() {
    let mut servo = cub().serial.unwrap();
    servo.controller.command_delay = 5e-3;
    servo.motor.heating = Some(Heating {
        capacity: 0.5,
        cooling: Some(20.0),
    });
    let others = plants(&servo).into_iter();
    for ((name, mut plant), (_, mut other)) in plants(&servo).into_iter().zip(others) {
        let home = angles(&mut *plant);
        swing(&mut *plant, [0, 300], home);
        plant
            .advance(instant(300.3), &[0.1, 0.2, 0.4, 0.1])
            .unwrap();
        let saved = plant.save();
        let expected = swing(&mut *plant, [300, 600], home);
        swing(&mut *other, [0, 20], home);
        other.restore(&saved).unwrap();
        assert_eq!(other.save(), saved);
        assert_eq!(swing(&mut *other, [300, 600], home), expected, "{name}");
    }
}

/// Steps of 1 ms and a firmware of 1.5 ms: 1 ms, 1.5 ms, 2.5 ms, 3 ms. A run that observes all of
/// them, and one that observes each other step of the firmware.
#[test]
fn steps_of_a_plant_end_with_those_of_the_firmware() {
    let mut servo = cub().serial.unwrap();
    servo.controller.period = 1.5e-3;
    let others = plants(&servo).into_iter();
    for ((name, mut plant), (_, mut other)) in plants(&servo).into_iter().zip(others) {
        let home = angles(&mut *plant);
        let commands = [home[0], home[1] + 0.1, home[0] + 0.3, home[1] + 0.2];
        for period in 1..=50_u32 {
            let end = 3.0 * f64::from(period);
            for before in [2.0, 1.5, 0.5, 0.0] {
                other.advance(instant(end - before), &commands).unwrap();
            }
            plant.advance(instant(end), &commands).unwrap();
            assert_eq!(angles(&mut *plant), angles(&mut *other), "{name}: {end} ms");
        }
    }
}

/// Without a gain the motor only brakes: the leg is held by friction beyond its weight, for ever,
/// and sinks without. Rigid constraints of mass-less legs end there with a fault: their correction
/// of the energy needs a motion.
#[test]
fn friction_holds_a_leg() {
    let mut servo = cub().serial.unwrap();
    servo.controller.gain = 0.0;
    servo.controller.starting_duty = 0.0;
    servo.gear = Gear::IDEAL;
    for (coulomb, is_held) in [(0.1, true), (0.0, false)] {
        servo.friction.coulomb = coulomb;
        for (name, mut plant) in plants(&servo) {
            let home = angles(&mut *plant);
            let held = [home[0], home[1], home[0], home[1]];
            if is_held && name == "massless, rigid" {
                let fault = plant.advance(instant(20_000.0), &held).unwrap_err();
                assert!(fault.why.contains("take compliant constraints"));
                continue;
            }
            let mut hip_at = |ms| {
                plant.advance(instant(ms), &held).unwrap();
                angles(&mut *plant)[0]
            };
            let [settled, late] = [5000.0, 20_000.0].map(&mut hip_at);
            if is_held {
                // The bristle deflects, by T h²/κJ under a weight of 15 mN·m, and the leg settles.
                assert!((settled - home[0]).abs() < 1e-5, "{name}: {settled}");
                assert!((late - settled).abs() < 1e-9, "{name}: {settled} {late}");
            } else {
                assert!((settled - home[0]).abs() > 1e-2, "{name}: {settled}");
            }
        }
    }
}

/// The same firmware outside of the plant, which commands the bridges: legs swing bit for bit as
/// with the firmware in the plant.
#[test]
fn firmware_on_a_bus_moves_a_leg_as_that_in_the_plant() {
    let servo = cub().serial.unwrap();
    let on_bus = plants_of(setup_with(&servo, FirmwarePlace::Bus)).into_iter();
    for ((name, mut plant), (_, mut other)) in plants(&servo).into_iter().zip(on_bus) {
        let home = angles(&mut *plant);
        let mut first = [0.0; 4];
        plant.initial_inputs(&mut first);
        let mut firmware = first.map(|angle| {
            let mut firmware = Firmware::new(&servo.controller, 0.0);
            firmware.restart(angle);
            firmware
        });
        let mut commands = first;
        for ms in 0..300_u32 {
            let now = instant(f64::from(ms));
            if ms.is_multiple_of(2) {
                commands = swing_commands(ms + 2, home);
                for (firmware, position) in firmware.iter_mut().zip(commands) {
                    let enabled = true;
                    firmware.command(now, now, ServoCommand { position, enabled });
                }
            }
            let layout = Layout::of(&other.ports(), Direction::Output);
            let mut outputs = vec![0.0; layout.len()];
            other.observe(&mut outputs);
            let positions = layout
                .fields()
                .filter(|field| is_position(&field.port.name));
            let mut duties = Vec::new();
            for (firmware, field) in firmware.iter_mut().zip(positions) {
                match firmware.step(now, outputs[field.offset]) {
                    Bridge::Duty(duty) => duties.extend([duty, 1.0]),
                    Bridge::Open => duties.extend([0.0, 0.0]),
                }
            }
            let next = instant(f64::from(ms + 1));
            other.advance(next, &duties).unwrap();
            plant.advance(next, &commands).unwrap();
            assert_eq!(angles(&mut *plant), angles(&mut *other), "{name}: {ms} ms");
        }
        let moved = angles(&mut *plant)[0] - home[0];
        assert!(moved > 0.1, "{name}: {moved} rad");
    }
}

/// Servos of the joints of two legs that abduct, in the order of their inputs.
const JOINTS: [&str; 6] = [
    "LF/hip",
    "LF/knee",
    "RH/hip",
    "RH/knee",
    "LF/abduction",
    "RH/abduction",
];

/// Plants of these legs, whose servos are on a bus.
fn abducting() -> (SerialServo, [Box<dyn Plant>; 2]) {
    let robot = robot("half-cub-xl330");
    let servo = robot.serial.unwrap();
    let setup = Setup {
        abduction: Abduction::Serial,
        ..setup_with(&servo, FirmwarePlace::Bus)
    };
    let compliant = Constraints::Compliant;
    let lcp = lcp(&robot, setup.clone(), compliant, Method::Rk4);
    (servo, [lcp, massless(&robot, setup, compliant)])
}

/// Inputs of one servo with a duty cycle; the bridges of the others are open.
fn driven(joint: usize, duty: f64) -> [f64; 12] {
    let mut inputs = [0.0; 12];
    (inputs[2 * joint], inputs[2 * joint + 1]) = (duty, 1.0);
    inputs
}

/// I = d V/(R + r d²), and V − r d I, of a motor at rest at a supply with the resistance r; the
/// other motors have no current.
#[test]
fn current_and_supply_are_those_of_the_servo_that_is_driven() {
    let duty = 0.5;
    let (servo, mut plants) = abducting();
    let (supply, motor) = (servo.supply, servo.motor);
    let resistance = motor.resistance + supply.resistance * duty * duty;
    let current = duty * supply.voltage / resistance;
    let sagging = supply.voltage - supply.resistance * duty * current;
    for plant in &mut plants {
        let ports = plant.ports();
        let inputs = ports
            .iter()
            .filter(|port| port.direction == Direction::Input);
        let inputs: Vec<_> = inputs.map(|port| port.name.clone()).collect();
        let names = JOINTS.map(|joint| ["duty", "bridge"].map(|it| format!("leg/{joint}/{it}")));
        assert_eq!(inputs, names.concat());
        let layout = Layout::of(&ports, Direction::Output);
        let mut outputs = vec![0.0; layout.len()];
        for i in 0..JOINTS.len() {
            plant.advance(SimTime::ZERO, &driven(i, duty)).unwrap();
            plant.observe(&mut outputs);
            for (j, joint) in JOINTS.iter().enumerate() {
                let expected = if i == j {
                    [current, sagging]
                } else {
                    [0.0, supply.voltage]
                };
                for (what, expected) in ["current", "supply"].into_iter().zip(expected) {
                    let field = layout.find(&format!("leg/{joint}/{what}")).unwrap();
                    let found = outputs[field.start];
                    assert!((found - expected).abs() < 1e-12, "{joint} {what}: {found}");
                }
            }
        }
    }
}

#[test]
fn restored_servos_on_a_bus_continue_bit_for_bit() {
    let (_, others) = abducting();
    for (mut plant, mut other) in abducting().1.into_iter().zip(others) {
        let run = |plant: &mut dyn Plant, [from, to]: [u32; 2]| {
            for ms in from + 1..=to {
                let inputs = driven(ms as usize / 7 % JOINTS.len(), 0.2);
                plant.advance(instant(f64::from(ms)), &inputs).unwrap();
            }
            plant.save()
        };
        let saved = run(&mut *plant, [0, 50]);
        let expected = run(&mut *plant, [50, 100]);
        run(&mut *other, [0, 3]);
        other.restore(&saved).unwrap();
        assert_eq!(other.save(), saved);
        assert_eq!(run(&mut *other, [50, 100]), expected);
    }
}
