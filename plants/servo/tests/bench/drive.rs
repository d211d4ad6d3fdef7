//! The servo as the drive of a joint, against its bench: an arm of the same inertia and weight that
//! gets the torque of the drive in steps.

use twinrig_actuator::serial::{Firmware, SerialDrive, ServoCommand};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_robot::serial::SerialServo;
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
            let line = drive.begin([angle, rate], step);
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

/// Greatest and mean difference of the angles from those of the bench \[rad\].
fn errors(name: &str, gain: f64, command: &[f64], parts: u32) -> [f64; 2] {
    let file = ServoBenchFile::find(name, "".as_ref()).unwrap().unwrap();
    let mut bench = file.bench().unwrap();
    bench.controller.gain = gain;
    bench.controller.quantized = false;
    // Substeps of the bench are those of its stiffness; a short period only makes them more exact.
    let mut run = Run::new(&bench, &["servo/angle"], [0.0; 2]);
    let exact = (1..).zip(command).map(|(tick, command)| {
        let seconds = 1e-3 * f64::from(tick);
        run.at(seconds, [*command, 1.0])[0]
    });
    let differences: Vec<f64> = driven(&bench, command, parts)
        .into_iter()
        .zip(exact)
        .map(|(angle, exact)| (angle - exact).abs())
        .collect();
    let worst = differences.iter().copied().fold(0.0, f64::max);
    [
        worst,
        differences.iter().sum::<f64>() / differences.len() as f64,
    ]
}

/// The drive has the friction at the beginning of each step, which is an error of the first order:
/// with an eighth of the step an eighth of it is left, and a fifth is allowed. In the second motion
/// the command rests and friction holds the arm; the STS3215 then is within 30 µrad, where the
/// order does not show.
#[test]
fn drive_of_a_joint_converges_to_its_bench() {
    let turn = core::f64::consts::TAU * 1e-3;
    let sine: Vec<f64> = (0..3000)
        .map(|tick| 0.9 * libm::sin(turn * f64::from(tick)))
        .collect();
    let rest: Vec<f64> = (0..3000_u32)
        .map(|tick| f64::from(tick.min(1000)) * 1e-3)
        .collect();
    for (name, gain, command, most) in [
        ("xl330", 800.0, &sine, 2e-3),
        ("sts3215", 32.0, &sine, 5e-5),
        ("xl330", 400.0, &rest, 2e-3),
    ] {
        let [coarse, fine] = [1, 8].map(|parts| errors(name, gain, command, parts));
        assert!(coarse[1] < most, "{name}: {coarse:?}");
        assert!(fine[1] < coarse[1] / 5.0, "{name}: {coarse:?} {fine:?}");
    }
    let [_, mean] = errors("sts3215", 16.0, &rest, 1);
    assert!(mean < 3e-5, "{mean}");
}
