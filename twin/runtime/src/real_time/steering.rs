//! Changes of process variables while a run in real time goes on.

use rtrb::{Consumer, Producer, RingBuffer};
use twinrig_kernel::{SimDuration, SimTime};

use crate::process_slot::ProcessSlot;
use crate::{Observer, slewed};

/// Number of changes that wait for a control step at most.
const WAITING: usize = 256;

/// Number of changes that a control step takes from the queue at most.
const TAKEN_MOST: usize = 64;

/// Value that a variable is to have.
#[derive(Clone, Copy, Debug)]
struct Sent {
    variable: usize,
    value: f64,
    /// Greatest change per second; infinite: at once.
    slew: f64,
}

/// Sending end of the changes of a run; it neither waits nor allocates.
#[derive(Debug)]
pub struct Steering(Producer<Sent>);

impl Steering {
    /// Lets a variable, by its index, have a value from the next control step on; returns whether
    /// the run has room for it. With `slew`, the greatest change per second, it is approached in
    /// steps, one at each control step. A value that the process refuses then is no change: the
    /// observer receives an event for each that is one.
    pub fn set(&mut self, variable: usize, value: f64, slew: Option<f64>) -> bool {
        let slew = slew.unwrap_or(f64::INFINITY);
        let sent = Sent {
            variable,
            value,
            slew,
        };
        self.0.push(sent).is_ok()
    }
}

/// Receiving end, of the control thread.
pub(super) struct Steered {
    queue: Consumer<Sent>,
    /// Last value and target of each variable that approaches one.
    targets: Box<[Option<(f64, Sent)>]>,
}

pub(super) fn steering(variables: usize) -> (Steering, Steered) {
    let (producer, queue) = RingBuffer::new(WAITING);
    let targets = vec![None; variables].into();
    (Steering(producer), Steered { queue, targets })
}

impl Steered {
    /// Makes the changes of a control step.
    pub(super) fn apply<O: Observer>(
        &mut self,
        slot: &mut ProcessSlot,
        period: SimDuration,
        now: SimTime,
        observer: &mut O,
    ) {
        for _ in 0..TAKEN_MOST {
            let Ok(sent) = self.queue.pop() else {
                break;
            };
            let Some(target) = self.targets.get_mut(sent.variable) else {
                continue;
            };
            *target = None;
            if sent.slew.is_infinite() {
                slot.try_change(sent.variable, sent.value, period, now, observer);
            } else {
                let variable = slot.process.variables().get(sent.variable);
                *target = variable.map(|variable| (variable.value(), sent));
            }
        }
        for target in &mut self.targets {
            let Some((present, sent)) = target else {
                continue;
            };
            *present = slewed(*present, sent.value, sent.slew, period);
            let is_set = slot.try_change(sent.variable, *present, period, now, observer);
            if !is_set || present.to_bits() == sent.value.to_bits() {
                *target = None;
            }
        }
    }
}
