//! The numbers of a robot in motion, one after the other, as they are saved.

use crate::flow::{Flow, Tally};
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
        (self.state, self.tally, self.tally_before) = (copy.state, copy.tally, copy.tally_before);
        [
            self.mode.holds.hip,
            self.mode.holds.closed,
            self.mode.holds.open,
            self.mode.holds.extended,
            self.mode.holds.bottomed,
            self.mode.holds.cable,
            self.mode.commands.hip,
            self.mode.commands.pulley,
            self.mode.commands.hip_spent,
            self.mode.commands.pulley_spent,
            self.mode.commands.hip_damping,
            self.mode.commands.pulley_damping,
            self.stride,
        ] = copy.lanes;
        (self.tallied, self.pushed) = (copy.tallied, copy.pushed);
        [self.rattles, self.patience, self.calm] = copy.rattles.map(counted);
        (self.gained, self.fresh) = (copy.gained, copy.fresh != 0.0);
        copy.recalled
    }

    fn clone_numbers(&self) -> Numbers<N> {
        let (holds, commands) = (&self.mode.holds, &self.mode.commands);
        Numbers {
            state: self.state,
            tally: self.tally,
            tally_before: self.tally_before,
            lanes: [
                holds.hip,
                holds.closed,
                holds.open,
                holds.extended,
                holds.bottomed,
                holds.cable,
                commands.hip,
                commands.pulley,
                commands.hip_spent,
                commands.pulley_spent,
                commands.hip_damping,
                commands.pulley_damping,
                self.stride,
            ],
            tallied: self.tallied,
            rattles: [self.rattles, self.patience, self.calm].map(f64::from),
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
    tally: Tally,
    tally_before: Tally,
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
        let tallies = [&mut self.tally, &mut self.tally_before];
        let mut lanes: Vec<&mut Lanes> = state.angles.iter_mut().chain(&mut state.rates).collect();
        lanes.extend([&mut state.pulley, &mut state.pulley_rate]);
        lanes.extend(&mut self.lanes);
        for tally in tallies {
            tally.ground.iter_mut().flatten().for_each(&mut *to);
            lanes.extend([&mut tally.hip, &mut tally.knee, &mut tally.cable]);
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
