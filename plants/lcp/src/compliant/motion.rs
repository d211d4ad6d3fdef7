//! The model as a differential equation in lanes.

use twinrig_compliant::events::EventLog;
use twinrig_compliant::lanes::{Features, Kernel, Lanes, Quad, Simd, dispatch};
use twinrig_compliant::{
    BodyContact, Commands, DriveLaws, Fastest, Flows, Missed, NoMode, Step, StepControl, StepError,
    Substep, System,
};
use twinrig_legged::StepLoad;

use super::energy::Elements;
use super::evaluation::Evaluation;
use super::model::{CompliantEquations, CompliantModel, Legs};
use super::state::{Slope, State};

/// Step of the model in memory.
pub(crate) struct Advance<'a, const N: usize, const P: usize, const A: usize, const B: usize> {
    pub(crate) model: &'a CompliantModel<N, A>,
    pub(crate) step: Step<'a, CompliantEquations<N, P, A, B>>,
}

impl<const N: usize, const P: usize, const A: usize, const B: usize> Kernel
    for Advance<'_, N, P, A, B>
{
    type Output = Result<(), StepError>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let load = |quad: Quad| simd.load(quad);
        let step = self.step;
        let mut motion = Motion::<S, N, P, A, B> {
            simd,
            model: self.model,
            legs: self.model.legs.load(simd),
            commands: step.commands.load(simd),
            are_held: self.model.drives != DriveLaws::None && step.commands.are_held(),
            sums: step.sums.map(load),
            load: step.load,
            log: step.log,
        };
        let mut state = step.state.load(simd);
        let mut slope = step.slope.take().map(|slope| slope.map(load));
        step.control
            .advance(&mut motion, &mut state, &mut slope, step.seconds)?;
        *step.state = state.store();
        *step.slope = slope.map(|slope| slope.map(S::Lanes::quad));
        *step.sums = motion.sums.map(S::Lanes::quad);
        Ok(())
    }
}

/// Returns a sum of slopes, each times its seconds.
#[inline(always)]
fn sum<L: Lanes, const N: usize, const P: usize, const A: usize, const B: usize, const M: usize>(
    slopes: [&Slope<L, N, P, A, B>; M],
    seconds: [f64; M],
) -> State<L, N, P, A, B> {
    let mut sum = slopes[0].state.map(|rate| rate * seconds[0]);
    for j in 1..M {
        sum = sum.zip(&slopes[j].state, |sum, rate| sum + rate * seconds[j]);
    }
    sum
}

/// The model in lanes.
struct Motion<'a, S: Simd, const N: usize, const P: usize, const A: usize, const B: usize> {
    simd: S,
    model: &'a CompliantModel<N, A>,
    legs: Legs<S::Lanes, N, A>,
    commands: Commands<S::Lanes>,
    are_held: bool,
    sums: Flows<S::Lanes>,
    load: Option<&'a StepLoad>,
    log: &'a mut EventLog,
}

impl<S: Simd, const N: usize, const P: usize, const A: usize, const B: usize> System
    for Motion<'_, S, N, P, A, B>
{
    type State = State<S::Lanes, N, P, A, B>;
    type Slope = Slope<S::Lanes, N, P, A, B>;
    type Mode = NoMode<Self::State, Self::Slope, S::Lanes>;

    #[inline(always)]
    fn mode(&self, _: &Self::State, _: &Self::Slope) -> Option<Self::Mode> {
        None
    }

    #[inline(always)]
    fn slope(&self, time: f64, state: &Self::State) -> Self::Slope {
        self.simd.call(Evaluation {
            simd: self.simd,
            model: self.model,
            legs: &self.legs,
            commands: &self.commands,
            time,
            load: self.load,
            state,
            limits: None,
        })
    }

    #[inline(always)]
    fn along<const M: usize>(
        state: &Self::State,
        slopes: [&Self::Slope; M],
        seconds: [f64; M],
    ) -> Self::State {
        state.zip(&sum(slopes, seconds), |value, change| value + change)
    }

    #[inline(always)]
    fn error(
        &self,
        substep: f64,
        slopes: [&Self::Slope; 5],
        seconds: [f64; 5],
        _: Option<Missed<'_, Self::Mode>>,
    ) -> f64 {
        let radius = self.model.radius;
        let State {
            position,
            attitude,
            velocity,
            turning,
            angles,
            rates,
            pulley,
            pulley_rate,
            bristles,
            abduction,
            body,
        } = sum(slopes, seconds).map(S::Lanes::abs);
        let (mut angle, mut rate) = (attitude + attitude, turning);
        for i in 0..N {
            angle = angle.max(angles[i]);
            rate = rate.max(rates[i]);
        }
        for joint in abduction {
            angle = angle.max(joint.angle);
            rate = rate.max(joint.rate);
        }
        angle = angle.max(pulley);
        rate = rate.max(pulley_rate);
        let mut lengths = (angle * radius).max(position);
        for bristle in bristles {
            lengths = lengths.max((bristle[0] + bristle[1]) * StepControl::BRISTLE_WEIGHT);
        }
        for contact in body {
            let deflection = contact.greatest_deflection();
            lengths = lengths.max(deflection * StepControl::BRISTLE_WEIGHT);
        }
        if self.are_held && substep > StepControl::SHORT {
            let work = Flows::net_work(slopes.map(|slope| &slope.flows), seconds);
            lengths = lengths.max(work.abs() * self.model.work_to_length);
        }
        let speeds = (rate * radius).max(velocity);
        let size = lengths.max(speeds * (StepControl::VELOCITY_SUBSTEPS * substep));
        let [a, b, c, d] = size.quad().0;
        // The sum propagates NaN, which a maximum hides.
        let nan = 0.0 * (lengths + speeds).quad().0.iter().sum::<f64>();
        a.max(b).max(c.max(d)) + nan
    }

    fn fastest(&self, states: [&Self::State; 2], slopes: [&Self::Slope; 2]) -> Fastest {
        let difference = |[a, b]: [&Self::State; 2]| {
            let mut members = Vec::new();
            b.zip(a, |b, a| b - a)
                .map(|lanes| members.push(lanes.quad()));
            members.truncate(members.len() - B * BodyContact::<Quad>::OF_TRUNK);
            members
        };
        let slopes = slopes.map(|slope| &slope.state);
        Fastest::new(&difference(states), &difference(slopes))
    }

    #[inline(always)]
    fn accept(&mut self, substep: &Substep<'_, Self>) -> u64 {
        for (slope, seconds) in substep.slopes.into_iter().zip(substep.shares) {
            self.sums = self
                .sums
                .zip(&slope.flows, |sum, flow| sum + flow * seconds);
        }
        let (model, [before, after]) = (self.model, substep.states);
        let elements = |state: &Self::State| {
            let state = &state.store();
            dispatch(Features::Detected, Elements { model, state })
        };
        self.log.observe(
            [substep.time, substep.seconds],
            model.rigid.legs.len(),
            [substep.slopes[0].compressed, substep.last.compressed],
            || [elements(before), elements(after)],
        )
    }
}
