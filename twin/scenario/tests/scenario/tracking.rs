//! Tracking of commands, against closed forms.

use std::f64::consts::{SQRT_2, TAU};

use crate::common::run::at;
use twinrig_kernel::{Direction, Layout, Port, Unit, signal};
use twinrig_runtime::Group;
use twinrig_scenario::{CommandedGait, DriveLimits, Footstep, Layouts, Tracking, TrackingReport};

/// A leg whose hip follows its command, over 5 s after a ramp of 1 s.
struct Leg<'l> {
    command: &'l dyn Fn(f64) -> f64,
    position: &'l dyn Fn(f64) -> f64,
    torque: &'l dyn Fn(f64) -> f64,
    clearance: &'l dyn Fn(f64) -> f64,
    step_height: f64,
}

fn tracked(leg: &Leg<'_>) -> TrackingReport {
    tracked_until(leg, 6_000)
}

fn tracked_until(leg: &Leg<'_>, end_ms: u64) -> TrackingReport {
    let scene = crate::common::scene(&crate::common::text("")).unwrap();
    let of = |name: &str| signal::of_leg("LF", name);
    let plant = [
        Port::output(of(signal::HIP_POSITION), Unit::Radian, 1),
        Port::output(of(signal::HIP_TORQUE), Unit::NewtonMeter, 1),
        Port::output(of(signal::FOOT_CLEARANCE), Unit::Meter, 1),
    ];
    let commands = [Port::output(signal::command("LF", "hip"), Unit::Radian, 1)];
    let none = Layout::default();
    let layouts = Layouts {
        plant: &Layout::of(&plant, Direction::Output),
        process_inputs: &none,
        process_outputs: &Layout::of(&commands, Direction::Output),
        diagnostics: &none,
        tasks: &[],
    };
    let limits = DriveLimits {
        speed: 10.0,
        torque: 2.0,
    };
    let gait = CommandedGait {
        step_heights: vec![Some(leg.step_height); scene.legs.len()],
        no_step_heights: None,
        ramp: 1.0,
        limits: Some([limits; 2]),
    };
    let mut tracking = Tracking::new(&scene, &layouts, &gait).unwrap();
    for ms in 0..=end_ms {
        let time = ms as f64 / 1e3;
        // Nothing that the leg does in the ramp counts.
        let in_ramp = if ms <= 1_000 { 9.0 } else { 0.0 };
        tracking.samples(at(ms), Group::ProcessOutputs, &[(leg.command)(time)]);
        let position = (leg.position)(time) + in_ramp;
        let values = [position, (leg.torque)(time), (leg.clearance)(time)];
        tracking.samples(at(ms), Group::Plant, &values);
        if ms % 500 == 250 {
            tracking.footstep(&Footstep {
                leg: 0,
                touch_down: at(ms - 100),
                lift_off: Some(at(ms - 20)),
                position: [0.0; 3],
                slip: 0.0,
                impulse: 1.0,
                peak_load: 1.0,
            });
        }
    }
    tracking.report()
}

const STILL: Leg<'_> = Leg {
    command: &|_| 0.0,
    position: &|_| 0.0,
    torque: &|_| 0.0,
    clearance: &|_| 0.0,
    step_height: 0.035,
};

/// A first-order lag of time constant τ follows A sin ωt with an error of amplitude A ωτ/√(1 +
/// ω²τ²), whose root mean square is that over √2.
#[test]
fn error_behind_a_sine_is_that_of_a_first_order_lag() {
    let (amplitude, omega, lag) = (0.3, TAU * 2.0, 0.02);
    let gain = 1.0 / f64::sqrt(1.0 + omega * omega * lag * lag);
    let report = tracked(&Leg {
        command: &|time| amplitude * libm::sin(omega * time),
        position: &|time| amplitude * gain * libm::sin(omega * time - libm::atan(omega * lag)),
        ..STILL
    });
    let drive = &report.legs[0].drives[0];
    let peak = amplitude * omega * lag * gain;
    // 10 whole periods of 500 samples.
    assert!((drive.rms - peak / SQRT_2).abs() < 1e-9, "{drive:?}");
    assert!((drive.peak - peak).abs() < 1e-4 * peak, "{drive:?}");
    // The fastest rate is 3.7 rad/s of 10; one period of 5000 has the jump at the end of the ramp.
    assert!(drive.saturated.unwrap() < 0.001, "{drive:?}");
}

/// On the torque–speed line τ/τ₀ + q̇/q̇₀ = 1, and driven back at the stall torque.
#[test]
fn saturation_is_the_share_of_time_on_the_torque_speed_line() {
    let share = |rate: f64, torque: &dyn Fn(f64) -> f64| {
        let report = tracked(&Leg {
            position: &|time| rate * time,
            torque,
            ..STILL
        });
        report.legs[0].drives[0].saturated.unwrap()
    };
    // The first quarter of each second.
    let pulse = |time: f64| time.fract() < 0.25;
    let of_line = share(4.0, &|time| if pulse(time) { 1.2 } else { 1.0 });
    assert!((of_line - 0.25).abs() < 0.002, "{of_line}");
    let stalled = share(0.0, &|time| if pulse(time) { -2.0 } else { 1.8 });
    assert!((stalled - 0.25).abs() < 0.002, "{stalled}");
    let driven_back = share(4.0, &|time| if pulse(time) { -2.0 } else { -1.2 });
    assert!((driven_back - 0.25).abs() < 0.002, "{driven_back}");
    // The first period contains the jump at the end of the ramp.
    assert!(share(9.9, &|_| 0.0) > 0.999 && share(9.0, &|_| 0.0) < 0.001);
}

#[test]
fn feet_that_lift_less_than_half_of_the_step_height_are_warned_about() {
    let lifting = |height: f64| {
        tracked(&Leg {
            // One swing of 0.25 s in each footstep of 0.5 s.
            clearance: &|time| height * libm::sin(TAU * 2.0 * time).max(0.0),
            ..STILL
        })
    };
    let low = lifting(0.013);
    let lift = low.legs[0].lift.unwrap();
    assert!((lift.mean - 0.013).abs() < 1e-5, "{lift:?}");
    assert_eq!(lift.count, 9);
    assert_eq!(
        low.warnings(),
        ["the gait is not followed: LF lifts its foot by 13.0 mm, and 35.0 mm are commanded"]
    );
    assert_eq!(lifting(0.018).warnings(), <[&str; 0]>::default());
}

/// A robot that falls in the ramp of its gait may do so because its drives are too weak for it.
#[test]
fn run_that_ends_in_the_ramp_has_the_tracking_of_the_ramp() {
    let stalled = Leg {
        torque: &|_| 2.0,
        ..STILL
    };
    let report = tracked_until(&stalled, 800);
    let drive = &report.legs[0].drives[0];
    assert!(report.in_ramp && report.from == at(0));
    // 9 rad from the command all the time.
    assert!(
        (drive.rms - 9.0).abs() < 1e-9 && drive.saturated == Some(1.0),
        "{drive:?}"
    );
    assert_eq!(report.warnings().len(), 1, "{:?}", report.warnings());
    let later = tracked(&stalled);
    assert!(!later.in_ramp && later.from == at(1_000));
    assert!(later.legs[0].drives[0].rms < 1e-9);
}

/// A trunk that advances at V and height h, with a stride of the first leg every half second, while
/// every drive gives torque τ at rate ω: V²/(g h), f h/V, and n τ ω/(W V).
#[test]
fn numbers_of_a_gait_are_those_of_its_speed_height_and_work() {
    let (speed, height, torque, rate) = (0.9, 0.1, 0.05, 1.5);
    let scene = crate::common::scene(&crate::common::text("")).unwrap();
    let legs = || scene.legs.iter().map(|leg| leg.name.as_str());
    let trunk = [
        Port::output(signal::BODY_POSITION, Unit::Meter, 3),
        Port::output(signal::BODY_RPY, Unit::Radian, 3),
    ];
    let drives = legs().flat_map(|leg| {
        signal::DRIVES.into_iter().flat_map(move |(angle, torque)| {
            [
                Port::output(signal::of_leg(leg, angle), Unit::Radian, 1),
                Port::output(signal::of_leg(leg, torque), Unit::NewtonMeter, 1),
            ]
        })
    });
    let plant: Vec<Port> = trunk.into_iter().chain(drives).collect();
    let commands = [Port::output(signal::command("LF", "hip"), Unit::Radian, 1)];
    let none = Layout::default();
    let layouts = Layouts {
        plant: &Layout::of(&plant, Direction::Output),
        process_inputs: &none,
        process_outputs: &Layout::of(&commands, Direction::Output),
        diagnostics: &none,
        tasks: &[],
    };
    let mut gait = CommandedGait {
        step_heights: vec![Some(0.02); scene.legs.len()],
        ramp: 1.0,
        ..CommandedGait::default()
    };
    let run = |gait: &CommandedGait| {
        let mut tracking = Tracking::new(&scene, &layouts, gait).unwrap();
        for ms in 0..=6_000 {
            let time = ms as f64 / 1e3;
            tracking.samples(at(ms), Group::ProcessOutputs, &[0.0]);
            // Nothing in the ramp counts: there it stands.
            let x = speed * (time - 1.0).max(0.0);
            let drive = [rate * time, torque];
            let drives = std::iter::repeat_n(drive, 2 * scene.legs.len()).flatten();
            let values: Vec<f64> = [x, 0.0, height, 0.0, 0.0, 0.0]
                .into_iter()
                .chain(drives)
                .collect();
            tracking.samples(at(ms), Group::Plant, &values);
            if ms % 500 == 250 {
                tracking.footstep(&Footstep {
                    leg: 0,
                    touch_down: at(ms - 100),
                    lift_off: Some(at(ms - 20)),
                    position: [0.0; 3],
                    slip: 0.0,
                    impulse: 1.0,
                    peak_load: 1.0,
                });
            }
        }
        tracking.report().similarity
    };
    let found = run(&gait).unwrap();
    let power = 2.0 * legs().count() as f64 * torque * rate;
    for (found, expected) in [
        (found.froude, speed * speed / (9.81 * height)),
        (found.strouhal, 2.0 * height / speed),
        (found.cost_of_transport, power / (scene.weight * speed)),
    ] {
        assert!(
            (found.unwrap() / expected - 1.0).abs() < 1e-9,
            "{found:?}, expected {expected}"
        );
    }
    // A controller without steps has no gait.
    gait.step_heights = vec![None; scene.legs.len()];
    assert_eq!(run(&gait), None);
}
