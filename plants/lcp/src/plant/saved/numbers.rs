//! State of a flow as a flat list of numbers, for saving.

use crate::integrators::impulse_sums::ImpulseSums;
use crate::integrators::moreau::LastImpulses;
use crate::model::real::Lanes;
use crate::model::state::State;
use crate::plant::flow::Flow;

impl<const N: usize> Flow<N> {
    /// Passes all numbers of the state to `to`.
    pub(super) fn visit(&self, to: &mut dyn FnMut(f64)) {
        let mut copy = self.clone_numbers();
        copy.each(&mut |x| to(*x));
    }

    /// Replaces all numbers of the state; returns
    /// `EventDriven::cached_recovery` at the time of saving.
    pub(super) fn replace(&mut self, by: &mut dyn FnMut() -> f64) -> f64 {
        let mut copy = self.clone_numbers();
        copy.each(&mut |x| *x = by());
        (self.run.state, self.run.impulse_sums, self.window.before) =
            (copy.state, copy.impulse_sums, copy.impulse_sums_before);
        [
            self.run.mode.active.hip,
            self.run.mode.active.closed,
            self.run.mode.active.open,
            self.run.mode.active.extended,
            self.run.mode.active.bottomed,
            self.run.mode.active.cable,
            self.run.mode.commands.hip,
            self.run.mode.commands.pulley,
            self.run.mode.commands.hip_saturated,
            self.run.mode.commands.pulley_saturated,
            self.run.mode.commands.hip_damping,
            self.run.mode.commands.pulley_damping,
            self.event_driven.step_size,
        ] = copy.lanes;
        self.window.seconds = copy.run_seconds;
        self.moreau.set_last_impulses(&copy.last_impulses);
        [
            self.fallback.remaining,
            self.fallback.backoff,
            self.fallback.steps_since,
        ] = copy.counters.map(count_from);
        (self.monitor.gained, self.modes_pending) = (copy.energy_gain, copy.modes_pending != 0.0);
        copy.cached_recovery
    }

    fn clone_numbers(&self) -> Numbers<N> {
        let (active, commands) = (&self.run.mode.active, &self.run.mode.commands);
        Numbers {
            state: self.run.state,
            impulse_sums: self.run.impulse_sums,
            impulse_sums_before: self.window.before,
            lanes: [
                active.hip,
                active.closed,
                active.open,
                active.extended,
                active.bottomed,
                active.cable,
                commands.hip,
                commands.pulley,
                commands.hip_saturated,
                commands.pulley_saturated,
                commands.hip_damping,
                commands.pulley_damping,
                self.event_driven.step_size,
            ],
            run_seconds: self.window.seconds,
            counters: [
                self.fallback.remaining,
                self.fallback.backoff,
                self.fallback.steps_since,
            ]
            .map(f64::from),
            energy_gain: self.monitor.gained,
            modes_pending: f64::from(u8::from(self.modes_pending)),
            cached_recovery: self.event_driven.cached_recovery(&self.run),
            last_impulses: *self.moreau.last_impulses(),
        }
    }
}

/// All numbers of a flow, visited in a fixed order.
struct Numbers<const N: usize> {
    state: State<Lanes, N>,
    impulse_sums: ImpulseSums,
    impulse_sums_before: ImpulseSums,
    lanes: [Lanes; 13],
    run_seconds: f64,
    counters: [f64; 3],
    energy_gain: f64,
    modes_pending: f64,
    cached_recovery: f64,
    last_impulses: LastImpulses,
}

impl<const N: usize> Numbers<N> {
    fn each(&mut self, to: &mut dyn FnMut(&mut f64)) {
        let state = &mut self.state;
        let trunk = state.position.iter_mut().chain(&mut state.attitude);
        let trunk = trunk.chain(&mut state.velocity).chain(&mut state.turning);
        trunk.for_each(&mut *to);
        let sums = [&mut self.impulse_sums, &mut self.impulse_sums_before];
        let mut lanes: Vec<&mut Lanes> = state.angles.iter_mut().chain(&mut state.rates).collect();
        lanes.extend([&mut state.pulley, &mut state.pulley_rate]);
        lanes.extend(&mut self.lanes);
        for impulse_sums in sums {
            impulse_sums.ground.iter_mut().flatten().for_each(&mut *to);
            lanes.extend([
                &mut impulse_sums.hip,
                &mut impulse_sums.knee,
                &mut impulse_sums.cable,
            ]);
        }
        for lane in lanes {
            let mut numbers = lane.to_array();
            numbers.iter_mut().for_each(&mut *to);
            *lane = Lanes::new(numbers);
        }
        to(&mut self.run_seconds);
        self.counters.iter_mut().for_each(&mut *to);
        to(&mut self.energy_gain);
        to(&mut self.modes_pending);
        to(&mut self.cached_recovery);
        self.last_impulses
            .impulses
            .iter_mut()
            .flatten()
            .for_each(&mut *to);
        to(&mut self.last_impulses.seconds);
        to(&mut self.last_impulses.correction);
    }
}

/// Converts a counter back from its saved number.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped"
)]
fn count_from(number: f64) -> u32 {
    number.clamp(0.0, f64::from(u32::MAX)) as u32
}
