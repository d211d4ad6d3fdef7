//! The numbers of a robot in motion, one after the other, as they are saved.

use crate::flow::{Flow, ImpulseSums};
use crate::moreau::Pushed;
use crate::real::Lanes;
use crate::state::State;

impl<const N: usize> Flow<N> {
    /// The numbers that the way ahead depends on.
    pub(super) fn visit(&self, to: &mut dyn FnMut(f64)) {
        let mut copy = self.clone_numbers();
        copy.each(&mut |x| to(*x));
    }

    /// Takes numbers for its own; gives what [`Flow::recalled`] said when they were saved.
    pub(super) fn replace(&mut self, by: &mut dyn FnMut() -> f64) -> f64 {
        let mut copy = self.clone_numbers();
        copy.each(&mut |x| *x = by());
        (self.state, self.impulse_sums, self.impulse_sums_before) =
            (copy.state, copy.impulse_sums, copy.impulse_sums_before);
        [
            self.mode.active.hip,
            self.mode.active.closed,
            self.mode.active.open,
            self.mode.active.extended,
            self.mode.active.bottomed,
            self.mode.active.cable,
            self.mode.commands.hip,
            self.mode.commands.pulley,
            self.mode.commands.hip_saturated,
            self.mode.commands.pulley_saturated,
            self.mode.commands.hip_damping,
            self.mode.commands.pulley_damping,
            self.stride,
        ] = copy.lanes;
        (self.tallied, self.pushed) = (copy.tallied, copy.pushed);
        [self.rattles, self.backoff, self.calm] = copy.rattles.map(counted);
        (self.gained, self.fresh) = (copy.gained, copy.fresh != 0.0);
        copy.recalled
    }

    fn clone_numbers(&self) -> Numbers<N> {
        let (active, commands) = (&self.mode.active, &self.mode.commands);
        Numbers {
            state: self.state,
            impulse_sums: self.impulse_sums,
            impulse_sums_before: self.impulse_sums_before,
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
                self.stride,
            ],
            tallied: self.tallied,
            rattles: [self.rattles, self.backoff, self.calm].map(f64::from),
            gained: self.gained,
            fresh: f64::from(u8::from(self.fresh)),
            recalled: self.recalled(),
            pushed: self.pushed,
        }
    }
}

/// All numbers of a flow, to be gone through in one order.
struct Numbers<const N: usize> {
    state: State<Lanes, N>,
    impulse_sums: ImpulseSums,
    impulse_sums_before: ImpulseSums,
    lanes: [Lanes; 13],
    tallied: f64,
    rattles: [f64; 3],
    gained: f64,
    fresh: f64,
    recalled: f64,
    pushed: Pushed,
}

impl<const N: usize> Numbers<N> {
    fn each(&mut self, to: &mut dyn FnMut(&mut f64)) {
        let state = &mut self.state;
        let trunk = state.position.iter_mut().chain(&mut state.attitude);
        let trunk = trunk.chain(&mut state.velocity).chain(&mut state.turning);
        trunk.for_each(&mut *to);
        let tallies = [&mut self.impulse_sums, &mut self.impulse_sums_before];
        let mut lanes: Vec<&mut Lanes> = state.angles.iter_mut().chain(&mut state.rates).collect();
        lanes.extend([&mut state.pulley, &mut state.pulley_rate]);
        lanes.extend(&mut self.lanes);
        for impulse_sums in tallies {
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
        to(&mut self.tallied);
        self.rattles.iter_mut().for_each(&mut *to);
        to(&mut self.gained);
        to(&mut self.fresh);
        to(&mut self.recalled);
        self.pushed.impulses.iter_mut().flatten().for_each(&mut *to);
        to(&mut self.pushed.seconds);
    }
}

/// A count that was saved as a number.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped"
)]
fn counted(number: f64) -> u32 {
    number.clamp(0.0, f64::from(u32::MAX)) as u32
}
