//! The model as a differential equation in lanes.

use twinrig_compliant::lanes::{Kernel, Lanes, Quad, Simd};
use twinrig_compliant::{Commands, Flows, Step, StepControl, StepError, System};

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
        };
        let mut state = step.state.load(simd);
        let mut slope = step.slope.take().map(|slope| Slope {
            state: slope.state.load(simd),
            flows: slope.flows.map(load),
        });
        step.control
            .advance(&mut motion, &mut state, &mut slope, step.seconds)?;
        *step.state = state.store();
        *step.slope = slope.map(|slope| Slope {
            state: slope.state.store(),
            flows: slope.flows.map(S::Lanes::quad),
        });
        *step.sums = motion.sums.map(S::Lanes::quad);
        Ok(())
    }
}

/// Returns a sum of slopes, each times its seconds.
#[inline(always)]
fn sum<L: Lanes, const M: usize>(slopes: [&Slope<L>; M], seconds: [f64; M]) -> State<L> {
    let mut sum = slopes[0].state.map(|rate| rate * seconds[0]);
    for j in 1..M {
        sum = sum.zip(&slopes[j].state, |sum, rate| sum + rate * seconds[j]);
    }
    sum
}

/// The model in lanes.
struct Motion<'a, S: Simd> {
    simd: S,
    model: &'a CompliantModel,
    legs: Legs<S::Lanes>,
    commands: Commands<S::Lanes>,
    sums: Flows<S::Lanes>,
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
    fn along<const M: usize>(
        state: &Self::State,
        slopes: [&Self::Slope; M],
        seconds: [f64; M],
    ) -> Self::State {
        state.zip(&sum(slopes, seconds), |value, change| value + change)
    }

    #[inline(always)]
    fn error(&self, substep: f64, slopes: [&Self::Slope; 5], seconds: [f64; 5]) -> f64 {
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
        } = sum(slopes, seconds).map(S::Lanes::abs);
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
        let [a, b, c, d] = lengths
            .max(speeds * (StepControl::VELOCITY_SUBSTEPS * substep))
            .quad()
            .0;
        // The sum propagates NaN, which a maximum hides.
        let [e, f, g, h] = (lengths + speeds).quad().0;
        let nan = 0.0 * ((e + f) + (g + h));
        a.max(b).max(c.max(d)) + nan
    }

    #[inline(always)]
    fn accept(&mut self, _: f64, slopes: [&Self::Slope; 4], seconds: [f64; 4], _: &Self::State) {
        for (slope, seconds) in slopes.into_iter().zip(seconds) {
            self.sums = self
                .sums
                .zip(&slope.flows, |sum, flow| sum + flow * seconds);
        }
    }
}
