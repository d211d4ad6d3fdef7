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
    initial(
        &robot,
        &Options::compliant(setup, StepControl::TOLERANCE),
        [],
        [],
    )
    .unwrap()
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

/// Returns the slope in a state, with motors without voltage.
#[inline(always)]
fn slope_of<S: Simd>(simd: S, flow: &CompliantFlow, state: &State<S::Lanes>) -> Slope<S::Lanes> {
    let model = &flow.equations.model;
    Evaluation {
        simd,
        model,
        legs: &model.legs.load(simd),
        commands: &damped(simd),
        time: 0.0,
        load: None,
        state,
        limited: None,
    }
    .run()
}

/// Returns the mode in the state of a flow.
#[inline(always)]
fn mode_of<S: Simd>(simd: S, flow: &CompliantFlow) -> StiffMode<S::Lanes> {
    let (model, state) = (&flow.equations.model, flow.state.load(simd));
    let DriveLaws::Motors(inertias) = model.drives else {
        panic!("motors");
    };
    let [hip, pulley, _] = damped(simd).damping;
    let damping = [hip, pulley];
    Find {
        legs: &model.legs.load(simd),
        state: &state,
        slope: &slope_of(simd, flow, &state),
        inertias,
        damping,
    }
    .run()
}

fn damped<S: Simd>(simd: S) -> Commands<S::Lanes> {
    let mut commands = Commands::zero();
    commands.damping = [0.07, 0.06, 0.0].map(Quad::splat);
    commands.load(simd)
}

/// Rate of the mode, and pairs of derivatives along it, of which the last two are halves of second
/// ones: found by differences, and those of the mode.
struct Derivatives<'a>(&'a CompliantFlow);

impl Kernel for Derivatives<'_> {
    type Output = [Quad; 18];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        const SMALL: f64 = 1e-8;
        const WIDE: f64 = 1e-6;
        let Self(flow) = self;
        let state = flow.state.load(simd);
        let slope_of = |state: &State<S::Lanes>| slope_of(simd, flow, state);
        let mode = mode_of(simd, flow);
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

/// Adds a multiple of the vector of the mode to a state.
struct Kicked<'a>(&'a CompliantFlow, f64);

impl Kernel for Kicked<'_> {
    type Output = State<Quad>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> State<Quad> {
        let (state, mode) = (self.0.state.load(simd), mode_of(simd, self.0));
        mode.added(&state, simd.splat(self.1)).store()
    }
}

/// Of a motion along the mode, from which most of the losses come, work, losses and loads are those
/// of a far tighter tolerance, at which no substep is exponential.
#[test]
fn work_and_loads_along_the_mode_are_those_of_short_substeps() {
    let mut flow = oncilla();
    run(&mut flow, 40);
    let state = dispatch(Features::Detected, Kicked(&flow, 1e-5));
    let [found, exact] = [StepControl::TOLERANCE, 1e-10].map(|tolerance| {
        let equations = flow.equations.clone();
        let mut flow = CompliantFlow::new(equations, state, tolerance, Features::Detected);
        let inputs = [1.0, 1.0, 14.0, 1.0].repeat(4);
        flow.set_inputs(&StepInputs {
            start: &inputs,
            rates: &[0.0; 16],
            mean: &inputs,
        });
        flow.step(1e-3).unwrap();
        let sums = flow.sums;
        let sums = [
            sums.actuator,
            sums.dissipated,
            sums.hip,
            sums.knee,
            sums.cable,
        ];
        (sums.map(|sum| sum.0[0]), flow.control.work.accepted)
    });
    assert!(found.1 < 15 && exact.1 > 200, "{} {}", found.1, exact.1);
    for (found, exact) in found.0.into_iter().zip(exact.0) {
        // The method errs by up to 4e-5; the least part that weighted sums miss is 1.0e-4.
        let error = found / exact - 1.0;
        assert!(error.abs() < 6e-5, "{found} {exact} {error}");
    }
}
