//! The servo as the drive of a joint, against its bench: an arm of the same inertia and weight that
//! gets the torque of the drive in steps.

use twinrig_actuator::serial::{Firmware, SerialDrive, ServoCommand};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_robot::serial::{Gear, Heating, SerialServo};
use twinrig_servo::{ServoBenchFile, ServoBenchParameters};

use crate::{GRAVITY, Run};

/// Parts of a step of the drive, each of the method of Runge and Kutta: its error is none beside
/// that of the drive.
const SUBSTEPS: u32 = 4;

/// Angles of the arm at each millisecond, under a command at these, with a drive in steps of
/// 1/`parts` of a millisecond.
fn driven(bench: &ServoBenchParameters, command: &[f64], parts: u32) -> Vec<f64> {
    let servo = SerialServo {
        supply: bench.supply,
        motor: bench.motor,
        friction: bench.friction,
        gear: bench.gear,
        controller: bench.controller,
    };
    let (load, step) = (&bench.load, 1e-3 / f64::from(parts));
    let inertia = servo.motor.inertia + load.mass * load.length * load.length;
    let weight = load.mass * load.length * GRAVITY;
    let mut firmware = Firmware::new(&servo.controller, 0.0);
    let mut drive = SerialDrive::new(&servo, step);
    let [mut angle, mut rate] = [0.0; 2];
    let mut angles = Vec::new();
    for (tick, command) in (0..).zip(command) {
        let now = SimTime::ZERO + SimDuration::from_millis(tick);
        let goal = ServoCommand {
            position: *command,
            enabled: true,
        };
        firmware.command(now, now, goal);
        drive.set_bridge(firmware.step(now, angle));
        for _ in 0..parts {
            let line = drive.start_step([angle, rate], step);
            let slope = |[angle, rate]: [f64; 2]| {
                let weight = -weight * libm::sin(angle + load.offset);
                [rate, (line.torque_at(rate) + weight) / inertia]
            };
            for _ in 0..SUBSTEPS {
                [angle, rate] = runge_kutta([angle, rate], step / f64::from(SUBSTEPS), slope);
            }
        }
        angles.push(angle);
    }
    angles
}

fn runge_kutta(from: [f64; 2], h: f64, slope: impl Fn([f64; 2]) -> [f64; 2]) -> [f64; 2] {
    let along = |k: [f64; 2], h: f64| [from[0] + h * k[0], from[1] + h * k[1]];
    let first = slope(from);
    let second = slope(along(first, 0.5 * h));
    let third = slope(along(second, 0.5 * h));
    let fourth = slope(along(third, h));
    core::array::from_fn(|i| {
        from[i] + h / 6.0 * (first[i] + 2.0 * (second[i] + third[i]) + fourth[i])
    })
}

/// Angles of the arm on the bench at each millisecond.
fn on_bench(bench: &ServoBenchParameters, command: &[f64]) -> Vec<f64> {
    let mut run = Run::new(bench, &["servo/angle"], [0.0; 2]);
    let ticks = (1..).zip(command);
    ticks
        .map(|(tick, command)| run.at(1e-3 * f64::from(tick), [*command, 1.0])[0])
        .collect()
}

fn mean_distance(a: &[f64], b: &[f64]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum();
    sum / a.len() as f64
}

/// Mean distance from the bench \[rad\] of an arm with a drive in steps of 1/`parts` of a
/// millisecond.
fn error(bench: &ServoBenchParameters, command: &[f64], parts: u32) -> f64 {
    mean_distance(&driven(bench, command, parts), &on_bench(bench, command))
}

/// The servo of a bench at a gain, whose angle has no counts.
fn servo(name: &str, gain: f64) -> ServoBenchParameters {
    let file = ServoBenchFile::find(name, "".as_ref()).unwrap().unwrap();
    let mut bench = file.bench().unwrap();
    bench.controller.gain = gain;
    bench.controller.quantized = false;
    bench
}

/// A sine of 0.9 rad and 1 Hz over three seconds.
fn sine() -> Vec<f64> {
    let turn = core::f64::consts::TAU * 1e-3;
    let ticks = (0..3000).map(f64::from);
    ticks.map(|tick| 0.9 * libm::sin(turn * tick)).collect()
}

/// The drive has the friction at the start of each step, which is an error of the first order: with
/// an eighth of the step an eighth of it is left, and a fifth is allowed. In the second motion the
/// command rests and friction holds the arm; the STS3215 then is within 30 µrad, where the order
/// does not show.
#[test]
fn drive_of_a_joint_converges_to_its_bench() {
    let rest: Vec<f64> = (0..3000_u32)
        .map(|tick| f64::from(tick.min(1000)) * 1e-3)
        .collect();
    for (name, gain, command, most) in [
        ("xl330", 800.0, &sine(), 2e-3),
        ("sts3215", 32.0, &sine(), 5e-5),
        ("xl330", 400.0, &rest, 2e-3),
    ] {
        let bench = servo(name, gain);
        let [coarse, fine] = [1, 8].map(|parts| error(&bench, command, parts));
        assert!(coarse < most, "{name}: {coarse:?}");
        assert!(fine < coarse / 5.0, "{name}: {coarse:?} {fine:?}");
    }
    let mean = error(&servo("sts3215", 16.0), &rest, 1);
    assert!(mean < 3e-5, "{mean}");
}

/// A change of a servo.
type Change = fn(&mut ServoBenchParameters);

/// Each part alone, at a size that moves the arm of the bench by ten times the error of the drive:
/// without the part in the drive the test fails.
#[test]
fn each_part_of_the_drive_converges_to_that_of_its_bench() {
    let parts: [(&str, Change); 8] = [
        ("current limit", |servo| {
            servo.motor.current_limit = Some(0.6);
        }),
        ("saturation", |servo| {
            servo.motor.saturation_current = Some(1.0);
        }),
        ("sag", |servo| servo.supply.resistance = 2.0),
        ("heating", |servo| {
            servo.motor.heating = Some(Heating {
                capacity: 0.2,
                cooling: Some(5.0),
            });
        }),
        ("Stribeck", |servo| {
            (servo.friction.stribeck, servo.friction.stribeck_rate) = (0.1, 3.0);
        }),
        ("load of the motor", |servo| servo.friction.motor_load = 0.3),
        ("square", |servo| servo.friction.motor_load_square = 0.5),
        ("driving and driven gear", |servo| {
            (servo.gear.driving, servo.gear.driven) = (5.0, 0.5);
        }),
    ];
    let mut plain = servo("xl330", 800.0);
    plain.gear = Gear::IDEAL;
    plain.motor.heating = None;
    plain.motor.saturation_current = None;
    plain.supply.resistance = 0.0;
    for (part, change) in parts {
        let mut servo = plain.clone();
        change(&mut servo);
        let effect = mean_distance(&on_bench(&servo, &sine()), &on_bench(&plain, &sine()));
        let [coarse, fine] = [1, 8].map(|parts| error(&servo, &sine(), parts));
        assert!(10.0 * coarse < effect, "{part}: {effect} {coarse}");
        assert!(fine < (coarse / 4.0).max(1e-5), "{part}: {coarse} {fine}");
    }
}

/// The load of a joint is the torque that the gear transmits, that of a bench is gravity: in slow
/// motion they are the same.
#[test]
fn load_of_a_joint_in_slow_motion_is_that_of_its_bench() {
    let slow: Vec<f64> = (0..3000).map(|tick| 3e-4 * f64::from(tick)).collect();
    let mut servo = crate::ideal();
    (servo.controller.gain, servo.friction.coulomb) = (800.0, 5e-3);
    (servo.friction.motor_load, servo.friction.external_load) = (0.3, 0.3);
    let both = on_bench(&servo, &slow);
    let error = mean_distance(&driven(&servo, &slow, 4), &both);
    servo.friction.external_load = 0.0;
    let effect = mean_distance(&on_bench(&servo, &slow), &both);
    assert!(error < 2e-3 && effect > 5.0 * error, "{error} {effect}");
}
