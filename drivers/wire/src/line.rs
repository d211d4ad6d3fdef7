use twinrig_kernel::SimTime;
use twinrig_runtime::{Part, PlantAccess, TaskError, TransmitBuffer};

use crate::{Arrivals, Piece};

/// Returns the earlier of two optional instants.
pub fn earlier(one: Option<SimTime>, other: Option<SimTime>) -> Option<SimTime> {
    // Called at every wake-up; the minimum of an iterator costs a tenth of a run over a bus.
    match (one, other) {
        (Some(one), Some(other)) => Some(one.min(other)),
        (one, other) => one.or(other),
    }
}

/// Byte transport in virtual time, seen from its near end (towards the host), with everything at
/// its far end. Lines nest: one that changes bytes or times wraps the next.
///
/// The owner calls [`Line::advance`] at every instant of [`Line::next_wake`], in order, and at any
/// other instant at which it reads received bytes.
pub trait Line: Part {
    /// Transmits bytes from the near end. They may be announced before they are complete, even
    /// before the first one begins; pieces are in order of time and do not overlap.
    fn send(&mut self, piece: Piece<'_>);

    /// Returns the transmit buffer at the near end, if there is one.
    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        None
    }

    /// Returns the time of the next event that may be visible at the near end or act on the plant.
    /// Of contiguous bytes only the first and the last are reported. The value changes only by
    /// calls on `&mut self`.
    fn next_wake(&self) -> Option<SimTime>;

    /// Processes all events up to and including `now`.
    ///
    /// # Errors
    /// [`TaskError`] if the plant or the transport fails.
    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError>;

    /// Appends the bytes that were complete at the near end by the last [`Line::advance`] and not
    /// taken yet. Further bytes that are certain to arrive may be announced before they are
    /// complete; they need no wake-up.
    fn receive(&mut self, arrivals: &mut Arrivals);

    /// Handles the events after `now` that are not visible at the near end, each at its own instant
    /// ([`PlantAccess::run_ahead`]), up to the next one that is, but only those before `before`;
    /// returns the time of the last one. By default it handles none.
    ///
    /// # Errors
    /// As [`Line::advance`].
    fn run_ahead(
        &mut self,
        now: SimTime,
        before: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<SimTime, TaskError> {
        let _ = (before, plant);
        Ok(now)
    }

    /// Passes a packet on its way to the near end, none of whose bytes is complete, to `accept` if
    /// nothing disturbs it until its end but bytes from the near end. `accept` returns whether the
    /// near end receives it as it is and transmits nothing before its end; then it is received, and
    /// is not among the bytes of [`Line::receive`]. There is at most one after each
    /// [`Line::advance`]; by default there is none.
    fn take_packet(&mut self, accept: &mut dyn FnMut(Piece<'_>) -> bool) {
        let _ = accept;
    }

    /// Whether all bytes that will be complete at the near end before [`Line::next_wake`] have been
    /// announced, so that no call is required until then.
    fn is_announced(&self) -> bool {
        false
    }

    /// Whether nothing is on the line, and will be but packets from the near end and the answers to
    /// them: then it makes no difference whether a packet is sent before it begins.
    fn is_quiet(&self) -> bool {
        false
    }
}

impl<L: Line + ?Sized> Line for Box<L> {
    fn send(&mut self, piece: Piece<'_>) {
        (**self).send(piece);
    }
    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        (**self).transmit_buffer()
    }
    fn next_wake(&self) -> Option<SimTime> {
        (**self).next_wake()
    }
    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        (**self).advance(now, plant)
    }
    fn receive(&mut self, arrivals: &mut Arrivals) {
        (**self).receive(arrivals);
    }
    fn run_ahead(
        &mut self,
        now: SimTime,
        before: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<SimTime, TaskError> {
        (**self).run_ahead(now, before, plant)
    }
    fn take_packet(&mut self, accept: &mut dyn FnMut(Piece<'_>) -> bool) {
        (**self).take_packet(accept);
    }
    fn is_announced(&self) -> bool {
        (**self).is_announced()
    }
    fn is_quiet(&self) -> bool {
        (**self).is_quiet()
    }
}
