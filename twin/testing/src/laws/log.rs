use twinrig_kernel::SimTime;

use super::{Traffic, Violation};

/// Record of a session, in which a law looks for violations.
#[derive(Clone, Debug, Default)]
pub(super) struct Log {
    /// Ended transfers, in order.
    pub(super) transfers: Vec<Transfer>,
    /// Values before the opening and after it, with their times.
    pub(super) first_values: Vec<(SimTime, Vec<f64>)>,
    /// Bytes that the driver has written.
    pub(super) written: Vec<(SimTime, Vec<u8>)>,
    /// Changes of the plant's inputs.
    pub(super) actuated: Vec<(SimTime, Vec<f64>)>,
    /// Instants at which the host has read bytes from the wire.
    pub(super) reads: Vec<SimTime>,
    /// Number of bytes received and traffic at the end of the opening.
    pub(super) opened: Option<(u64, Traffic)>,
    /// End of closing, or of the session by an error of the driver.
    pub(super) ended: Option<Ending>,
}

/// End of a session: its time, and the error of the driver that is its reason.
pub(super) type Ending = (SimTime, Result<(), String>);

/// Returns an end in words.
pub(super) fn ending(ended: Option<&Ending>) -> String {
    match ended {
        None => String::from("it does not end"),
        Some((at, Ok(()))) => format!("closing ends at {at}"),
        Some((at, Err(why))) => format!("it fails at {at} ({why})"),
    }
}

/// An ended transfer.
#[derive(Clone, Debug)]
pub(super) struct Transfer {
    /// Number of the period in which it began.
    pub(super) slot: usize,
    /// Its end.
    pub(super) at: SimTime,
    pub(super) values: Vec<f64>,
    pub(super) diagnostics: Vec<f64>,
    pub(super) traffic: Traffic,
    /// Number of bytes received from the wire.
    pub(super) received: u64,
}

/// Numbers of the entries of a log, to compare what follows.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mark {
    transfers: usize,
    written: usize,
    actuated: usize,
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

impl Log {
    pub(super) fn mark(&self) -> Mark {
        Mark {
            transfers: self.transfers.len(),
            written: self.written.len(),
            actuated: self.actuated.len(),
        }
    }

    /// Checks that a session went on from `mark` as this one did.
    ///
    /// # Errors
    /// [`Violation`] of `law` at the first difference of each kind.
    pub(super) fn compare(
        &self,
        law: &'static str,
        other: &Self,
        (mark, other_mark): (Mark, Mark),
    ) -> Result<(), Violation> {
        let written = first_difference(
            &self.written[mark.written..],
            &other.written[other_mark.written..],
        );
        if let Some((at, ours, theirs)) = written {
            let what = format!("the driver wrote {theirs:02x?}, instead of {ours:02x?}");
            return Err(Violation::new(law, at, what));
        }
        let exact = |log: &Self, from: usize| -> Vec<_> {
            let changes = log.actuated[from..].iter();
            changes.map(|(at, values)| (*at, bits(values))).collect()
        };
        let ours = exact(self, mark.actuated);
        let theirs = exact(other, other_mark.actuated);
        if let Some((at, ours, theirs)) = first_difference(&ours, &theirs) {
            let [ours, theirs] = [ours, theirs].map(|change| change.map(floats));
            let what = format!("inputs of the plant: {theirs:?}, instead of {ours:?}");
            return Err(Violation::new(law, at, what));
        }
        self.compare_transfers(law, other, (mark.transfers, other_mark.transfers))?;
        if self.ended == other.ended {
            return Ok(());
        }
        let at = other.ended.as_ref().or(self.ended.as_ref());
        let at = at.map_or(SimTime::ZERO, |(at, _)| *at);
        let [found, expected] = [&other.ended, &self.ended].map(|it| ending(it.as_ref()));
        Err(Violation::new(
            law,
            at,
            format!("{found}; expected: {expected}"),
        ))
    }

    fn compare_transfers(
        &self,
        law: &'static str,
        other: &Self,
        (from, other_from): (usize, usize),
    ) -> Result<(), Violation> {
        let (ours, theirs) = (&self.transfers[from..], &other.transfers[other_from..]);
        for (ours, theirs) in ours.iter().zip(theirs) {
            let what = if (ours.slot, ours.at) != (theirs.slot, theirs.at) {
                format!("a transfer ended at {} instead of {}", theirs.at, ours.at)
            } else if bits(&ours.values) != bits(&theirs.values) {
                format!("values {:?} instead of {:?}", theirs.values, ours.values)
            } else if bits(&ours.diagnostics) != bits(&theirs.diagnostics) {
                let (ours, theirs) = (&ours.diagnostics, &theirs.diagnostics);
                format!("diagnostics {theirs:?} instead of {ours:?}")
            } else {
                continue;
            };
            return Err(Violation::new(law, theirs.at, what));
        }
        if ours.len() == theirs.len() {
            return Ok(());
        }
        let what = format!("{} transfers instead of {}", theirs.len(), ours.len());
        Err(Violation::new(law, SimTime::ZERO, what))
    }
}

fn floats((at, bits): &(SimTime, Vec<u64>)) -> (SimTime, Vec<f64>) {
    (*at, bits.iter().map(|it| f64::from_bits(*it)).collect())
}

/// Returns the time of the first difference and both entries there.
#[expect(
    clippy::type_complexity,
    reason = "pairs of time and values, as in the log"
)]
fn first_difference<'l, T: PartialEq>(
    ours: &'l [(SimTime, Vec<T>)],
    theirs: &'l [(SimTime, Vec<T>)],
) -> Option<(
    SimTime,
    Option<&'l (SimTime, Vec<T>)>,
    Option<&'l (SimTime, Vec<T>)>,
)> {
    (0..ours.len().max(theirs.len())).find_map(|index| {
        let (ours, theirs) = (ours.get(index), theirs.get(index));
        let at = theirs.or(ours)?.0;
        (ours != theirs).then_some((at, ours, theirs))
    })
}
