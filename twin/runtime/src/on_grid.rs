use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_kernel::{
    Direction, Field, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit,
};

use crate::between::{Between, Rows, integral_of};
use crate::plant::{EnergyBooks, Plant, PlantEvent, PlantFault, WorkCounts};
use crate::plant_state::PlantState;

/// A plant that keeps its step, whenever boards sample and actuate: *grid* coupling.
///
/// The plant is moved from one instant of a grid to the next, H later, and to nowhere else. It is moved as soon as somebody
/// wants to know of the time between, under the commands of then; so what is seen there is interpolated, never extrapolated,
/// and a command that is given between two instants acts from the later one on. At an instant of the grid itself nothing is
/// late and nothing interpolated: where everybody meets the plant there and nowhere else, it goes the same way as by itself,
/// bit for bit.
///
/// # What it costs
/// A command that is given at θH after an instant acts (1 − θ)H late. Held as they are ([`Hold::Plain`]), commands that come at
/// phases without relation to the grid are ½H late in the mean, like those of boards so much slower. With the delay τ of a loop the
/// motion x(τ) changes by ½H ∂x/∂τ + O(H²): first order, whatever the plant's own order and that of the curves
/// between.
///
/// What a force misses by being late is its impulse, (1 − θ)H Δu, and that can be made up for: under [`Hold::Balanced`] the step
/// after gets the mean of what the step before has missed on top,
///
/// ```text
///  ũₖ = u(tₖ) + (1/H) ∫ u(t) − u(tₖ₋₁) dt      from tₖ₋₁ to tₖ
/// ```
///
/// so that ∫ũ = ∫u again one step after any change. What is left is that the impulse comes late by H or less: its
/// moment, O(H²) for each change, and as the changes of a command add up to no more than where it goes, O(H²) in all. Of a
/// command that goes evenly ũₖ is the mean over the step ahead. Nothing is fed back: a bounded command makes at most thrice itself. Only voltages,
/// forces and torques are balanced. A position or a switch acts by what it is and not by its integral, and is held.
///
/// # What is told of it
/// Energy, work, drift and state are those of the instant of the grid that the plant has reached: less than H ahead between two.
/// Events are told once their time has come. Means begin anew with the next instant of the grid, if not on one.
pub struct OnGrid {
    plant: Box<dyn Plant>,
    ports: Vec<Port>,
    step: SimDuration,
    hold: Hold,
    between: Between,
    shown: Vec<Shown>,
    /// Which inputs are made up for.
    balanced: Vec<bool>,
    /// What the plant is held to, and where it writes its outputs.
    applied: Vec<f64>,
    outputs: Vec<f64>,
    state: State,
}

/// What becomes of a command that is given between two instants of the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Hold {
    /// It acts from the next one on.
    Plain,
    /// And what its impulse lacks for that is added to the first step of it.
    #[default]
    Balanced,
}

/// Steps of no length lead nowhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("a grid has steps longer than 0 s")]
pub struct NoGrid;

/// An output that is passed on: the fields of the plant, by their number, with its place there and here.
#[derive(Clone, Debug)]
struct Shown {
    field: usize,
    from: std::ops::Range<usize>,
    to: std::ops::Range<usize>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    now: SimTime,
    /// The instant of the grid where the plant is: now, or the next one.
    reached: SimTime,
    /// What was given as the step to there began.
    begun: Vec<f64>,
    given: Vec<Given>,
    rows: Rows,
}

/// An input that is made up for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Given {
    /// Its value, and since when: it is counted when it changes, so that looking more often changes no bit.
    value: f64,
    since: SimTime,
    /// Integral of what it was less what it was as the step began, up to then.
    missed: f64,
}

impl Given {
    const NONE: Self = Self {
        value: 0.0,
        since: SimTime::ZERO,
        missed: 0.0,
    };

    fn count(&mut self, begun: f64, until: SimTime) {
        if self.value != begun {
            self.missed += (until - self.since).as_secs_f64() * (self.value - begun);
        }
        self.since = until;
    }
}

#[derive(Serialize, Deserialize)]
struct Saved {
    step: SimDuration,
    hold: Hold,
    state: State,
    plant: Snapshot,
}

impl OnGrid {
    /// Puts `plant`, which is at its start, on a grid of `step` from there on. Of its outputs those are passed on that `shown`
    /// says; the others may be rates that only curves need, see [`OnGrid::needs`].
    ///
    /// # Errors
    /// [`NoGrid`] if the step is none.
    pub fn new(
        plant: Box<dyn Plant>,
        step: SimDuration,
        hold: Hold,
        shown: &dyn Fn(&str) -> bool,
    ) -> Result<Self, NoGrid> {
        if step.is_zero() {
            return Err(NoGrid);
        }
        let all = plant.ports();
        let (inputs, outputs) = (
            Layout::of(&all, Direction::Input),
            Layout::of(&all, Direction::Output),
        );
        let is_shown =
            |port: &&Port| port.direction == Direction::Input || shown(port.name.as_str());
        let fields: Vec<Field> = outputs.fields().cloned().collect();
        let balanced = inputs.fields().flat_map(|field| {
            let acts_by_impulse = matches!(
                field.port.unit,
                Unit::Volt | Unit::Newton | Unit::NewtonMeter
            );
            std::iter::repeat_n(hold == Hold::Balanced && acts_by_impulse, field.port.size)
        });
        let between = Between::new(step.as_secs_f64(), outputs.len(), &fields);
        Ok(Self {
            ports: all.iter().filter(is_shown).cloned().collect(),
            shown: placed(&fields, shown),
            balanced: balanced.collect(),
            applied: vec![0.0; inputs.len()],
            outputs: vec![0.0; outputs.len()],
            state: State {
                now: SimTime::ZERO,
                reached: SimTime::ZERO,
                begun: vec![0.0; inputs.len()],
                given: vec![Given::NONE; inputs.len()],
                rows: between.rows(),
            },
            between,
            step,
            hold,
            plant,
        })
    }

    /// Whether a plant on a grid, of which the outputs that are `wanted` are, has to tell `name`: those, and their rates, so
    /// that a signal is interpolated alike whether anybody wants its rate or not.
    pub fn needs(name: &str, wanted: &dyn Fn(&str) -> bool) -> bool {
        wanted(name) || integral_of(name).is_some_and(|integral| wanted(&integral))
    }

    /// Takes note of what is given from now on.
    fn give(&mut self, inputs: &[f64]) {
        let state = &mut self.state;
        let all = state.given.iter_mut().zip(inputs).zip(&state.begun);
        for (n, ((given, input), begun)) in all.enumerate() {
            if self.balanced[n] && given.value != *input {
                given.count(*begun, state.now);
                given.value = *input;
            }
        }
    }

    /// Moves the plant from now, an instant of the grid, to the next one, under what is given from now on.
    fn go_on(&mut self, inputs: &[f64]) -> Result<(), PlantFault> {
        let state = &mut self.state;
        if state.rows.is_empty() {
            self.plant.observe(state.rows.push());
        }
        let step_s = self.step.as_secs_f64();
        let given = inputs.iter().zip(&state.given);
        for (applied, (input, given)) in self.applied.iter_mut().zip(given) {
            // Not by adding nothing, which would make +0 of −0.
            *applied = if given.missed == 0.0 {
                *input
            } else {
                input + given.missed / step_s
            };
        }
        let next = state.reached + self.step;
        self.plant.advance(next, &self.applied)?;
        self.plant.observe(state.rows.push());
        state.reached = next;
        state.begun.copy_from_slice(inputs);
        for (given, input) in state.given.iter_mut().zip(inputs) {
            *given = Given {
                value: *input,
                since: state.now,
                missed: 0.0,
            };
        }
        Ok(())
    }
}

fn placed(fields: &[Field], shown: &dyn Fn(&str) -> bool) -> Vec<Shown> {
    let mut end = 0;
    let fields = fields.iter().enumerate();
    fields
        .filter(|(_, field)| shown(&field.port.name))
        .map(|(number, field)| {
            let start = end;
            end += field.port.size;
            Shown {
                field: number,
                from: field.range(),
                to: start..end,
            }
        })
        .collect()
}

impl Plant for OnGrid {
    fn name(&self) -> &str {
        self.plant.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn first_inputs(&self, inputs: &mut [f64]) {
        self.plant.first_inputs(inputs);
    }

    /// If the plant fails, it is where the last step of the grid ended.
    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.give(inputs);
        while self.state.reached < to {
            let state = &mut self.state;
            state.now = state.reached;
            for (given, begun) in state.given.iter_mut().zip(&state.begun) {
                given.count(*begun, state.now);
            }
            self.go_on(inputs)?;
        }
        self.state.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let state = &self.state;
        if state.now == state.reached {
            self.plant.observe(&mut self.outputs);
            for shown in &self.shown {
                outputs[shown.to.clone()].copy_from_slice(&self.outputs[shown.from.clone()]);
            }
            return;
        }
        let ahead = (state.reached - state.now).as_secs_f64();
        let at = 1.0 - ahead / self.step.as_secs_f64();
        for shown in &self.shown {
            let out = &mut outputs[shown.to.clone()];
            self.between.write(&state.rows, at, shown.field, out);
        }
    }

    fn begin_window(&mut self) {
        self.plant.begin_window();
    }

    fn energy(&self) -> EnergyBooks {
        self.plant.energy()
    }

    fn work(&self) -> WorkCounts {
        self.plant.work()
    }

    fn drift(&self) -> Option<f64> {
        self.plant.drift()
    }

    fn log_events(&mut self, wanted: bool) {
        self.plant.log_events(wanted);
    }

    fn events(&self) -> &[PlantEvent] {
        let events = self.plant.events();
        let now_s = self.state.now.as_secs_f64();
        let come = events.partition_point(|event| event.at_s <= now_s);
        &events[..come]
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            step: self.step,
            hold: self.hold,
            state: self.state.clone(),
            plant: self.plant.save(),
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        let make = |step, hold, state: &State| {
            let inputs = (state.begun.len(), state.given.len());
            format!("{hold:?} on a grid of {step}, inputs {inputs:?}")
        };
        let (own, other) = (
            make(self.step, self.hold, &self.state),
            make(saved.step, saved.hold, &saved.state),
        );
        if own != other || !saved.state.rows.fits(&self.state.rows) {
            return Err(SnapshotError::Mismatch {
                expected: own,
                found: other,
            });
        }
        self.plant.restore(&saved.plant)?;
        self.state = saved.state;
        Ok(())
    }

    fn state(&self) -> Option<PlantState> {
        self.plant.state()
    }

    /// The grid begins anew there.
    fn take_over(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let lost = self.plant.take_over(from)?;
        let state = &mut self.state;
        (state.now, state.reached) = (from.time, from.time);
        state.begun.fill(0.0);
        state.given.fill(Given {
            since: from.time,
            ..Given::NONE
        });
        state.rows.clear();
        Ok(lost)
    }
}
