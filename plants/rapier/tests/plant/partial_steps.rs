//! Steps that are interrupted at any instant, as by boards with their own clocks.

use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, Start, StartPose};
use twinrig_rapier::Joints;
use twinrig_robot::Robot;
use twinrig_runtime::Plant;
use twinrig_testing::robots::{LEGS, robot, robot_named, suspended};

use crate::fixture::{Fixture, with_joints};

/// Advances to an instant.
fn advance_to_ns(fixture: &mut Fixture, ns: u64) {
    let at = SimTime::ZERO + SimDuration::from_nanos(ns);
    fixture.plant.advance(at, &fixture.commands).unwrap();
}

/// Setup of Oncilla on its motors, standing or with a fixed trunk.
fn on_motors(robot: &Robot, base: Base) -> Setup {
    let motors = robot.motors.unwrap();
    Setup {
        base,
        legs: LEGS.map(str::to_owned).to_vec(),
        ground: (base == Base::Free).then(|| Ground::new(Terrain::Flat, 0.6, 0.0).unwrap()),
        step: SimDuration::from_millis(1),
        drives: Drives::Motors {
            hip: motors.hip,
            knee: motors.knee,
        },
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: Start::default(),
    }
}

/// Results of a second in which the knees bend and stretch once, under a position loop of 1 kHz:
/// heights of the trunk every 0.1 s \[m\], the largest deviation of a hip angle \[rad\], the
/// largest torque \[N·m\].
struct MotionResult {
    heights: Vec<f64>,
    deviation: f64,
    torque: f64,
    fixture: Fixture,
}

/// Runs the motion with interruptions at the instants `cuts` within each millisecond \[ns\].
fn run_knee_bends(base: Base, cuts: impl Fn(u64) -> [u64; 2]) -> MotionResult {
    let robot = robot_named("oncilla");
    let mut fixture = with_joints(&robot, on_motors(&robot, base), Joints::Impulse);
    let names = LEGS
        .iter()
        .flat_map(|leg| ["hip", "knee"].map(|joint| format!("leg/{leg}/{joint}")));
    let names: Vec<String> = names.collect();
    let angles = |fixture: &mut Fixture, what: &str| -> Vec<f64> {
        let read = |name: &String| fixture.read(&format!("{name}/{what}"))[0];
        names.iter().map(read).collect()
    };
    let home = angles(&mut fixture, "position");
    let (mut heights, mut deviation, mut torque) = (Vec::new(), 0.0_f64, 0.0_f64);
    for ms in 0..1000_u64 {
        let now = angles(&mut fixture, "position");
        let bend = 0.25 * (1.0 - libm::cos(2.0 * core::f64::consts::PI * ms as f64 * 1e-3));
        for i in 0..8 {
            let requested = home[i] + [0.0, bend][i % 2];
            fixture.commands[2 * i] = 40.0 * (requested - now[i]);
            fixture.commands[2 * i + 1] = 1.0;
        }
        let hips = now.iter().zip(&home).step_by(2);
        deviation = hips.fold(deviation, |largest, (now, home)| {
            largest.max((now - home).abs())
        });
        for cut in cuts(ms) {
            advance_to_ns(&mut fixture, 1_000_000 * ms + cut);
            let torques = angles(&mut fixture, "torque");
            torque = torques
                .iter()
                .fold(torque, |largest, one| largest.max(one.abs()));
        }
        advance_to_ns(&mut fixture, 1_000_000 * (ms + 1));
        if ms % 100 == 99 {
            heights.push(fixture.read("body/position")[2]);
        }
    }
    MotionResult {
        heights,
        deviation,
        torque,
        fixture,
    }
}

#[test]
fn partial_steps_add_no_energy() {
    for base in [Base::Free, Base::Fixed] {
        let even = run_knee_bends(base, |_| [500_000, 750_000]);
        // Two boards whose ticks approach each other by 1 µs per millisecond, coincide to the
        // nanosecond after half a second, and separate again.
        let drifting = run_knee_bends(base, |ms| {
            let (one, other) = (300_000, 1000 * ms.abs_diff(500) + 1);
            [one, (one + other).min(999_999)]
        });
        let [a, b] = [&even, &drifting].map(|run| run.fixture.plant.energy());
        // Measured: 2 and 4 % difference, with residuals of 0.8 and 1.1 %: the work of ropes that
        // are corrected in parts of a step includes the velocity of the correction.
        assert!(
            (a.exchanged - b.exchanged).abs() < 0.1 * a.exchanged,
            "{base:?}: {a:?} {b:?}"
        );
        assert!(b.residual.abs() < 0.03 * b.exchanged, "{base:?}: {b:?}");
        assert!(
            drifting.deviation < 0.2,
            "{base:?}: {} rad",
            drifting.deviation
        );
        for (a, b) in even.heights.iter().zip(&drifting.heights) {
            assert!((a - b).abs() < 2e-3, "{base:?}: {a} {b} m");
        }
        // Measured: 0.1 % difference. An impulse divided by the length of a partial step would be a
        // torque a thousand times as large.
        assert!(
            drifting.torque < 1.05 * even.torque,
            "{base:?}: {} {} N·m",
            even.torque,
            drifting.torque
        );
    }
}

#[test]
fn partial_steps_do_not_saturate_a_servo() {
    // The torque of a servo follows from impulses, which belong to the time between the middles of
    // two steps.
    let drives = Drives::Servos {
        hip: robot().actuators.hip,
        knee: robot().actuators.knee,
    };
    let start = StartPose {
        q: [0.3, -0.3, 0.3],
        rates: [0.0; 3],
    };
    let setup = Setup {
        drives,
        ..suspended(&["LF"], start, 1000)
    };
    let largest = |cuts: [u64; 2]| {
        let mut fixture = with_joints(&robot(), setup.clone(), Joints::Impulse);
        let mut largest = 0.0_f64;
        for ms in 0..200_u64 {
            for end in cuts.into_iter().chain([1_000_000]) {
                advance_to_ns(&mut fixture, 1_000_000 * ms + end);
                largest = largest.max(fixture.read("leg/LF/hip/torque")[0].abs());
            }
        }
        largest
    };
    let [even, cut] = [[400_000, 700_000], [500_000, 500_001]].map(largest);
    // Measured: at most 0.02 and 0.04 N·m, while the leg settles. Stops that yield over a
    // nanosecond give 0.2 N·m, and an impulse divided by the length of the partial step 250 000
    // times as much.
    assert!(even < 0.1 && cut < 0.1, "{even} {cut} N·m");
}
