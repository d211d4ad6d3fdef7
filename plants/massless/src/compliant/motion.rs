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
pub(crate) struct Advance<'a> {
    pub(crate) model: &'a CompliantModel,
    pub(crate) step: Step<'a, CompliantEquations>,
}

impl Kernel for Advance<'_> {
    type Output = Result<(), StepError>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let load = |quad: Quad| simd.load(quad);
        let step = self.step;
        let mut motion = Motion {
            simd,
            model: self.model,
            legs: self.model.legs.load(simd),
            commands: step.commands.load(simd),
            sums: step.sums.map(load),
            log: step.log,
        };
        let mut state = step.state.load(simd);
        let mut slope = step.slope.take().map(|slope| Slope {
            state: slope.state.load(simd),
            flows: slope.flows.map(load),
            compressed: load(slope.compressed),
        });
        step.control
            .advance(&mut motion, &mut state, &mut slope, step.seconds)?;
        *step.state = state.store();
        *step.slope = slope.map(|slope| Slope {
            state: slope.state.store(),
            flows: slope.flows.map(S::Lanes::quad),
            compressed: slope.compressed.quad(),
        });
        *step.sums = motion.sums.map(S::Lanes::quad);
        Ok(())
    }
}

/// The model in lanes.
struct Motion<'a, S: Simd> {
    simd: S,
    model: &'a CompliantModel,
    legs: Legs<S::Lanes>,
    commands: Commands<S::Lanes>,
    sums: Flows<S::Lanes>,
    log: &'a mut EventLog,
}

impl<S: Simd> System for Motion<'_, S> {
    type State = State<S::Lanes>;
    type Slope = Slope<S::Lanes>;

    #[inline(always)]
    fn slope(&self, time: f64, state: &Self::State) -> Self::Slope {
        self.simd.call(Evaluation {
            simd: self.simd,
            model: self.model,
            legs: &self.legs,
            commands: &self.commands,
            time,
            state,
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
        let State {
            position,
            attitude,
            velocity,
            turning,
            angles: [first, second, third],
            hip_rate,
            pulley,
            pulley_rate,
            foot: [ahead, up],
            bristle: [along, across],
        } = fifth
            .state
            .zip(&fourth.state, |last, before| (last - before).abs());
        // An angle of a link moves the foot by its length, one of the pulley by its radius.
        let pantographs = &self.legs.pantographs;
        let ([l1, l2, l3], winding) = (pantographs.links, pantographs.pulley_radius);
        let radius = self.model.radius;
        let links = (first * l1).max(second * l2).max(third * l3);
        let lengths = links.max(pulley * winding).max(position);
        let lengths = lengths.max(attitude * (2.0 * radius));
        let lengths = lengths.max((along + across) * StepControl::BRISTLE_WEIGHT);
        let drives = (hip_rate * l1).max(pulley_rate * winding);
        let trunk = (turning * radius).max(velocity);
        let speeds = drives.max(trunk).max(ahead.max(up));
        let zero = lengths.zero();
        let powers = S::Lanes::sums([
            fifth.flows.actuator - fourth.flows.actuator,
            fifth.flows.dissipated - fourth.flows.dissipated,
            zero,
            zero,
        ]);
        let powers = powers.abs() * self.model.per_weight;
        let [a, b, c, d] = lengths.max(speeds * seconds).max(powers).quad().0;
        // The sum propagates NaN, which a maximum hides.
        let [e, f, g, h] = (lengths + speeds + powers).quad().0;
        let nan = 0.0 * ((e + f) + (g + h));
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
