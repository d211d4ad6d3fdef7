//! Linear set-points in the plants: an ideal servo follows a ramp as in closed form.

use std::path::Path;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_lcp::{Lcp, Method};
use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, StartPose};
use twinrig_massless::{Force, Massless};
use twinrig_robot::{Robot, RobotFile};
use twinrig_runtime::Plant;

/// Lag of the servos \[s\].
const LAG: f64 = 10e-3;
/// Duration of an approach; at 1 ms it ends within a step.
const PERIOD: SimDuration = SimDuration::from_micros(20_300);
/// Change of the command \[rad\].
const COMMAND: f64 = 0.1;

const HIP: f64 = 0.1;

fn cheetah() -> Robot {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let file = RobotFile::find("cheetah-cub", root).unwrap();
    file.robot().unwrap()
}

/// One hanging leg with ideal servos.
fn setup(step_us: u64) -> Setup {
    let q = [HIP, -0.2, 0.25];
    Setup {
        base: Base::Fixed,
        legs: vec!["LF".to_owned()],
        ground: None,
        step: SimDuration::from_micros(step_us),
        drives: Drives::Ideal { period: LAG },
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Linear { period: PERIOD },
        start: StartPose { q, rates: [0.0; 3] }.into(),
    }
}

fn plants(step_us: u64) -> Vec<(&'static str, Box<dyn Plant>)> {
    let (robot, setup) = (cheetah(), setup(step_us));
    let is_hip = |name: &str| name == "leg/LF/hip/position";
    let lcp = |method| {
        let options = twinrig_lcp::Options {
            constraints: twinrig_lcp::Constraints::Rigid,
            setup: setup.clone(),
            method,
            tolerance: twinrig_lcp::Options::TOLERANCE,
            features: twinrig_lcp::Features::Detected,
            toe: false,
        };
        Box::new(Lcp::new(&robot, &options, &is_hip).unwrap())
    };
    let options = twinrig_massless::Options::new(setup.clone(), Force::Solve);
    vec![
        (
            "massless",
            Box::new(Massless::new(&robot, &options, &is_hip).unwrap()),
        ),
        ("rk4", lcp(Method::Rk4)),
        ("rodas4", lcp(Method::Rodas4)),
        ("moreau", lcp(Method::Moreau)),
    ]
}

/// Angle after `t` of a critically damped servo of this lag, whose set-point is r t from zero on.
fn after_ramp(r: f64, t: f64) -> f64 {
    if t <= 0.0 {
        return 0.0;
    }
    r * (t - LAG + (t + LAG) * libm::exp(-2.0 * t / LAG))
}

/// Greatest deviation from the closed form over 60 ms \[rad\].
fn deviation(plant: &mut dyn Plant) -> f64 {
    let mut inputs = [0.0; 2];
    plant.initial_inputs(&mut inputs);
    inputs[0] += COMMAND;
    let (mut hip, mut worst) = ([0.0], 0.0_f64);
    let period = PERIOD.as_secs_f64();
    for ms in 1..=60 {
        let now = SimTime::ZERO + SimDuration::from_millis(ms);
        plant.advance(now, &inputs).unwrap();
        plant.observe(&mut hip);
        let (t, rate) = (now.as_secs_f64(), COMMAND / period);
        let exact = after_ramp(rate, t) - after_ramp(rate, t - period);
        worst = worst.max((hip[0] - HIP - exact).abs());
    }
    worst
}

#[test]
fn ideal_servo_follows_a_ramp_as_in_closed_form() {
    let [coarse, fine] = [1_000, 250].map(|step_us| {
        plants(step_us)
            .into_iter()
            .map(|(name, mut plant)| (name, deviation(&mut *plant)))
    });
    for ((name, coarse), (_, fine)) in coarse.zip(fine) {
        // Held set-points would deviate by a step of the ramp, 0.005 rad.
        assert!(coarse < 2e-4, "{name}: {coarse} rad");
        // The mean over a step is of second order.
        assert!(
            fine < coarse / 10.0,
            "{name}: {fine} rad after {coarse} rad"
        );
    }
}
