//! The model as a differential equation in lanes.

use twinrig_compliant::events::EventLog;
use twinrig_compliant::lanes::{Features, Kernel, Lanes, Quad, Simd, dispatch};
use twinrig_compliant::{Commands, Fastest, Flows, Step, StepControl, StepError, Substep, System};

use super::energy::Elements;
use super::equations::CompliantEquations;
use super::model::{CompliantModel, Legs};
use super::slope::Evaluation;
use super::state::{Slope, State};

/// Step of the model in memory.
pub(crate) struct Advance<'a, const N: usize, const P: usize> {
    pub(crate) model: &'a CompliantModel<N>,
    pub(crate) step: Step<'a, CompliantEquations<N, P>>,
}

impl<const N: usize, const P: usize> Kernel for Advance<'_, N, P> {
    type Output = Result<(), StepError>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let load = |quad: Quad| simd.load(quad);
        let step = self.step;
        let mut motion = Motion::<S, N, P> {
            simd,
            model: self.model,
            legs: self.model.legs.load(simd),
            commands: step.commands.load(simd),
            sums: step.sums.map(load),
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

/// The model in lanes.
struct Motion<'a, S: Simd, const N: usize, const P: usize> {
    simd: S,
    model: &'a CompliantModel<N>,
    legs: Legs<S::Lanes, N>,
    commands: Commands<S::Lanes>,
    sums: Flows<S::Lanes>,
    log: &'a mut EventLog,
}

impl<S: Simd, const N: usize, const P: usize> System for Motion<'_, S, N, P> {
    type State = State<S::Lanes, N, P>;
    type Slope = Slope<S::Lanes, N, P>;

    #[inline(always)]
    fn slope(&self, time: f64, state: &Self::State) -> Self::Slope {
        self.simd.call(Evaluation {
            simd: self.simd,
            model: self.model,
            legs: &self.legs,
            commands: &self.commands,
            time,
            state,
            limit: None,
        })
    }

    #[inline(always)]
    fn along(state: &Self::State, seconds: f64, slope: &Self::Slope) -> Self::State {
        state.zip(&slope.state, |value, rate| value + rate * seconds)
    }

    #[inline(always)]
    fn along_mean(
        state: &Self::State,
        seconds: f64,
        [a, b, c, d]: [&Self::Slope; 4],
    ) -> Self::State {
        let ends = a.state.zip(&d.state, |a, d| a + d);
        let middle = b.state.zip(&c.state, |b, c| b + c);
        let sum = ends.zip(&middle, |ends, middle| ends + (middle + middle));
        state.zip(&sum, |value, sum| value + sum * (seconds / 6.0))
    }

    #[inline(always)]
    fn error(&self, seconds: f64, fourth: &Self::Slope, fifth: &Self::Slope) -> f64 {
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
        } = fifth
            .state
            .zip(&fourth.state, |last, before| (last - before).abs());
        let (mut angle, mut rate) = (attitude + attitude, turning);
        for i in 0..N {
            angle = angle.max(angles[i]);
            rate = rate.max(rates[i]);
        }
        angle = angle.max(pulley);
        rate = rate.max(pulley_rate);
        let mut lengths = (angle * radius).max(position);
        for bristle in bristles {
            lengths = lengths.max((bristle[0] + bristle[1]) * StepControl::BRISTLE_WEIGHT);
        }
        let speeds = (rate * radius).max(velocity);
        let flows = fifth.flows.zip(&fourth.flows, |last, before| last - before);
        let zero = angle.zero();
        let powers = S::Lanes::sums([flows.actuator, flows.dissipated, zero, zero]).abs();
        let size = lengths
            .max(speeds * seconds)
            .max(powers * self.model.per_weight);
        let [a, b, c, d] = size.quad().0;
        // The sum propagates NaN, which a maximum hides.
        let nan = 0.0 * (lengths + speeds + powers).quad().0.iter().sum::<f64>();
        a.max(b).max(c.max(d)) * (seconds / 6.0) + nan
    }

    fn fastest(&self, states: [&Self::State; 2], slopes: [&Self::Slope; 2]) -> Fastest {
        let difference = |[a, b]: [&Self::State; 2]| {
            let mut members = Vec::new();
            b.zip(a, |b, a| b - a)
                .map(|lanes| members.push(lanes.quad()));
            members
        };
        let slopes = slopes.map(|slope| &slope.state);
        Fastest::new(&difference(states), &difference(slopes))
    }

    #[inline(always)]
    fn accept(&mut self, substep: &Substep<'_, Self>) -> u64 {
        let ([a, b, c, d], seconds) = (substep.slopes, substep.seconds);
        let ends = a.flows.zip(&d.flows, |a, d| a + d);
        let middle = b.flows.zip(&c.flows, |b, c| b + c);
        let sum = ends.zip(&middle, |ends, middle| ends + (middle + middle));
        self.sums = self
            .sums
            .zip(&sum, |sum, part| sum + part * (seconds / 6.0));
        let (model, [before, after]) = (self.model, substep.states);
        let elements = |state: &Self::State| {
            let state = &state.store();
            dispatch(Features::Detected, Elements { model, state })
        };
        self.log.observe(
            [substep.time, seconds],
            model.rigid.legs.len(),
            [a.compressed, substep.last.compressed],
            || [elements(before), elements(after)],
        )
    }
}
