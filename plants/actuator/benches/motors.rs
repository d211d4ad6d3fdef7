//! Cost of eight motors between two events of a bus with four boards: about eight thousand events a
//! second, at distances that drift by nanoseconds.

use divan::Bencher;
use twinrig_actuator::drives::{BenchMotors, MotorBench, Shaft};
use twinrig_kernel::SimTime;
use twinrig_robot::RobotFile;
use twinrig_runtime::Plant;

fn main() {
    divan::main();
}

#[divan::bench]
fn eight_motors(bencher: Bencher) {
    const STEPS: u64 = 8000;
    let text = include_str!("../../../robots/oncilla.toml");
    let robot = RobotFile::parse("oncilla.toml", text).and_then(|file| file.robot());
    let robot = robot.expect("the robot of this repository");
    let motors = robot.motors.expect("the robot has motors");
    let bench_motors = BenchMotors {
        legs: robot.legs.iter().map(|mount| mount.name.clone()).collect(),
        hip: Shaft::bare(motors.hip),
        knee: Shaft::bare(motors.knee),
    };
    let requested = |name: &str| name.ends_with("/position") || name.ends_with("/rate");
    bencher
        .counter(divan::counter::ItemsCount::new(STEPS))
        .with_inputs(|| MotorBench::new(&bench_motors, &requested).expect("valid motors"))
        .bench_local_values(|mut bench| {
            let (mut inputs, mut outputs, mut now) = ([1.0; 16], [0.0; 16], 0);
            for step in 0..STEPS {
                // A board updates the voltages of its two motors at every other event, a thousand
                // times a second each.
                let board = usize::try_from(step / 2 % 4).unwrap_or_default();
                inputs[4 * board] = f64::from(u16::try_from(step % 24).unwrap_or_default());
                now += 100_000 + 31 * (step % 8) + step / 4000;
                bench
                    .advance(SimTime::from_nanos(now), &inputs)
                    .expect("finite inputs");
                bench.observe(&mut outputs);
            }
            outputs
        });
}
