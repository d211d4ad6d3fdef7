//! Changes of process variables while a run in real time goes on.

use rtrb::{Consumer, Producer, RingBuffer};

/// Number of changes that wait for a control step at most.
const WAITING: usize = 256;

/// Sending end of the changes of a run; it neither waits nor allocates.
#[derive(Debug)]
pub struct Steering(Producer<(usize, f64)>);

impl Steering {
    /// Lets a variable, by its index, have a value from the next control step on; returns whether
    /// the run has room for it. A value that the process refuses then is no change: the observer
    /// receives an event for each that is one.
    pub fn set(&mut self, variable: usize, value: f64) -> bool {
        self.0.push((variable, value)).is_ok()
    }
}

/// Receiving end, of the control thread.
pub(super) type Steered = Consumer<(usize, f64)>;

pub(super) fn steering() -> (Steering, Steered) {
    let (producer, consumer) = RingBuffer::new(WAITING);
    (Steering(producer), consumer)
}
