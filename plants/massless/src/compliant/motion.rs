//! The model as a differential equation in lanes.

use twinrig_compliant::events::EventLog;
use twinrig_compliant::lanes::{Features, Kernel, Lanes, Quad, Simd, dispatch};
use twinrig_compliant::{
    BodyContact, Commands, DriveLaws, Fastest, Flows, Missed, Mode, Step, StepControl, StepError,
    Substep, System, Unseen,
};
use twinrig_legged::StepLoad;

use super::energy::Elements;
use super::mode::{Find, StiffMode};
use super::model::{CompliantEquations, CompliantModel, Legs};
use super::slope::Evaluation;
use super::state::{Slope, State};

/// Step of the model in memory.
pub(crate) struct Advance<'a, const A: usize, const B: usize> {
    pub(crate) model: &'a CompliantModel<A>,
    pub(crate) step: Step<'a, CompliantEquations<A, B>>,
}

impl<const A: usize, const B: usize> Kernel for Advance<'_, A, B> {
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
            are_held: self.model.drives != DriveLaws::None && step.commands.are_held(),
            sums: step.sums.map(load),
            load: step.load,
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

/// Returns a sum of slopes, each times its seconds.
#[inline(always)]
fn sum<L: Lanes, const A: usize, const B: usize, const M: usize>(
    slopes: [&Slope<L, A, B>; M],
    seconds: [f64; M],
) -> State<L, A, B> {
    let mut sum = slopes[0].state.map(|rate| rate * seconds[0]);
    for j in 1..M {
        sum = sum.zip(&slopes[j].state, |sum, rate| sum + rate * seconds[j]);
    }
    sum
}

/// The model in lanes.
struct Motion<'a, S: Simd, const A: usize, const B: usize> {
    simd: S,
    model: &'a CompliantModel<A>,
    legs: Legs<S::Lanes, A>,
    commands: Commands<S::Lanes>,
    are_held: bool,
    sums: Flows<S::Lanes>,
    load: Option<&'a StepLoad>,
    log: &'a mut EventLog,
}

impl<S: Simd, const A: usize, const B: usize> System for Motion<'_, S, A, B> {
    type State = State<S::Lanes, A, B>;
    type Slope = Slope<S::Lanes, A, B>;
    type Mode = StiffMode<S::Lanes, A, B>;

    #[inline(always)]
    fn mode(&self, state: &Self::State, slope: &Self::Slope) -> Option<Self::Mode> {
        // Servos impose the motion of the rotors, so that no damper is stiff.
        let DriveLaws::Motors(inertias) = self.model.drives else {
            return None;
        };
        let [hip, pulley, _] = self.commands.damping;
        Some(self.simd.call(Find {
            legs: &self.legs,
            state,
            slope,
            inertias,
            damping: [hip, pulley],
        }))
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
            limited: None,
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
        missed: Option<Missed<'_, Self::Mode>>,
    ) -> f64 {
        let mut change = sum(slopes, seconds);
        if let Some(Missed { mode, amount, .. }) = &missed {
            change = mode.added(&change, *amount);
        }
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
            abduction,
            body,
        } = change.map(S::Lanes::abs);
        // An angle of a link moves the foot by its length, one of the pulley by its radius.
        let pantographs = &self.legs.pantographs;
        let ([l1, l2, l3], winding) = (pantographs.links, pantographs.pulley_radius);
        let radius = self.model.radius;
        let links = (first * l1).max(second * l2).max(third * l3);
        let lengths = links.max(pulley * winding).max(position);
        let lengths = lengths.max(attitude * (2.0 * radius));
        let mut lengths = lengths.max((along + across) * StepControl::BRISTLE_WEIGHT);
        for contact in body {
            let deflection = contact.greatest_deflection();
            lengths = lengths.max(deflection * StepControl::BRISTLE_WEIGHT);
        }
        if self.are_held && substep > StepControl::SHORT {
            let mut work = Flows::net_work(slopes.map(|slope| &slope.flows), seconds);
            if let Some(Missed { mode, integral, .. }) = &missed {
                work += (mode.driven[0] - mode.lost[0]) * *integral;
            }
            lengths = lengths.max(work.abs() * self.model.work_to_length);
        }
        let mut drives = (hip_rate * l1).max(pulley_rate * winding);
        for joint in abduction {
            lengths = lengths.max(joint.angle * radius);
            drives = drives.max(joint.rate * radius);
        }
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
        if let Some(Unseen { mode, integrals }) = &substep.unseen {
            let [x, square] = *integrals;
            self.sums.actuator += mode.driven[0] * x + mode.driven[1] * square;
            self.sums.dissipated += mode.lost[0] * x + mode.lost[1] * square;
            self.sums.hip += mode.loads[0] * x;
            self.sums.knee += mode.loads[1] * x;
            self.sums.cable += mode.tension * x;
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
