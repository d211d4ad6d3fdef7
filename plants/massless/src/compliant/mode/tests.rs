use twinrig_compliant::lanes::{Features, Kernel, Quad, Simd, dispatch};
use twinrig_compliant::{Commands, DriveLaws, StepControl};
use twinrig_legged::{Base, Drives, Setup, StepInputs};
use twinrig_testing::robots::{robot_named, standing};

use super::*;
use crate::compliant::equations::{CompliantFlow, initial};
use crate::compliant::slope::Evaluation;
use crate::model::Options;

/// Oncilla on its motors.
fn oncilla() -> CompliantFlow {
    let robot = robot_named("oncilla");
    let motors = robot.motors.unwrap();
    let drives = Drives::Motors {
        hip: motors.hip,
        knee: motors.knee,
    };
    let setup = Setup {
        base: Base::Free,
        ..standing(drives, 1000)
    };
    initial(&robot, &Options::compliant(setup, StepControl::TOLERANCE)).unwrap()
}

/// Applies voltages to the motors that swing and wind, and returns their least tension over the
/// last half and the greatest rate of the modes.
fn run(flow: &mut CompliantFlow, steps: u32) -> [f64; 2] {
    let (mut tension, mut rate) = (f64::INFINITY, 0.0_f64);
    for step in 0..steps {
        let swing = libm::sin(0.2 * f64::from(step));
        let inputs = [4.0 * swing, 1.0, 14.0 + 2.0 * swing, 1.0].repeat(4);
        flow.set_inputs(&StepInputs {
            start: &inputs,
            rates: &[0.0; 16],
            mean: &inputs,
        });
        flow.step(1e-3).unwrap();
        if 2 * step > steps {
            let [found, ..] = dispatch(Features::Detected, Derivatives(flow));
            rate = found.0.into_iter().fold(rate, |most, rate| most.max(-rate));
            let slope = flow.slope.unwrap();
            tension = slope.flows.cable.0.into_iter().fold(tension, f64::min);
        }
    }
    [tension, rate]
}

/// Rate of the mode, and pairs of derivatives along it, the last two halves of second ones: found by
/// differences, and those of the mode.
struct Derivatives<'a>(&'a CompliantFlow);

impl Kernel for Derivatives<'_> {
    type Output = [Quad; 18];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        const SMALL: f64 = 1e-8;
        let model = &self.0.equations.model;
        let legs = model.legs.load(simd);
        let mut commands = Commands::zero();
        commands.damping = [Quad::splat(0.07), Quad::splat(0.06)];
        let commands = commands.load(simd);
        let slope_of = |state: &State<S::Lanes>| {
            Evaluation {
                simd,
                model,
                legs: &legs,
                commands: &commands,
                time: 0.0,
                load: None,
                state,
            }
            .run()
        };
        let state = self.0.state.load(simd);
        let DriveLaws::Motors(inertias) = model.drives else {
            panic!("motors");
        };
        let mode = Find {
            legs: &legs,
            state: &state,
            slope: &slope_of(&state),
            inertias,
            damping: commands.damping,
        }
        .run();
        let amount = simd.splat(SMALL / 100.0);
        let [after, before] = [amount, -amount].map(|amount| slope_of(&mode.added(&state, amount)));
        let per = 50.0 / SMALL;
        let found = [
            mode.part(&after) - mode.part(&before),
            after.flows.hip - before.flows.hip,
            after.flows.knee - before.flows.knee,
            after.flows.cable - before.flows.cable,
            after.flows.actuator - before.flows.actuator,
            after.flows.dissipated - before.flows.dissipated,
        ];
        let own = [
            mode.rate,
            mode.loads[0],
            mode.loads[1],
            mode.tension,
            mode.driven[0],
            mode.lost[0],
        ];
        let mut all = [mode.rate.quad(); 18];
        for k in 0..6 {
            all[2 + 2 * k] = (found[k] * per).quad();
            all[3 + 2 * k] = own[k].quad();
        }
        const WIDE: f64 = 1e-6;
        let amount = simd.splat(WIDE);
        let middle = slope_of(&state);
        let [after, before] = [amount, -amount].map(|amount| slope_of(&mode.added(&state, amount)));
        let bend = |after: S::Lanes, middle: S::Lanes, before: S::Lanes| {
            (after - middle + (before - middle)) * (0.5 / (WIDE * WIDE))
        };
        let [after, middle, before] = [after.flows, middle.flows, before.flows];
        all[14] = bend(after.actuator, middle.actuator, before.actuator).quad();
        all[15] = mode.driven[1].quad();
        all[16] = bend(after.dissipated, middle.dissipated, before.dissipated).quad();
        all[17] = mode.lost[1].quad();
        all
    }
}

#[test]
fn mode_is_that_of_differences() {
    let mut flow = oncilla();
    let [tension, _] = run(&mut flow, 40);
    assert!(tension > 5.0, "{tension}");
    let found = dispatch(Features::Detected, Derivatives(&flow));
    for leg in 0..4 {
        for pair in found[2..].chunks_exact(2) {
            let [a, b] = [pair[0].0[leg], pair[1].0[leg]];
            assert!((a - b).abs() < 0.1 * b.abs(), "leg {leg}: {a} {b}");
        }
    }
}

/// An explicit method of this order takes substeps of at most 2.8 of its time constants.
#[test]
fn substeps_are_longer_than_the_stiff_mode_permits_and_energy_is_kept() {
    let mut flow = oncilla();
    run(&mut flow, 20);
    let before = (flow.control.work, flow.ledger.balance());
    let [_, rate] = run(&mut flow, 100);
    let (work, balance) = (flow.control.work, flow.ledger.balance());
    let substeps = (work.accepted - before.0.accepted) as f64;
    let constants = 0.1 / substeps * rate;
    assert!(constants > 5.0, "{constants} {substeps}");
    let exchanged = balance.exchanged - before.1.exchanged;
    let residual = balance.residual - before.1.residual;
    assert!(residual.abs() < 1e-4 * exchanged, "{residual} {exchanged}");
}
