use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Part, PlantAccess, TaskError};

use crate::{Addresses, Piece};

/// Device on a bus: an emulated board.
///
/// The bus delivers the bytes transmitted by others, complete by now ([`Node::receive`]), and then
/// calls [`Node::advance`]; after each such call it polls [`Node::poll_transmit`],
/// [`Node::min_bytes_needed`], [`Node::listens_to`] and [`Node::next_wake`], which change at no other
/// time.
pub trait Node: Part {
    /// Name, for messages, diagnostics and faults: `LF`.
    fn name(&self) -> &str;

    /// Receives bytes transmitted by others, complete by now, including damaged ones. The node
    /// drops and counts those with a framing error.
    fn receive(&mut self, piece: Piece<'_>);

    /// Returns the minimum number of further bytes that the node must receive before it can react:
    /// those missing of the shortest packet. The bus delivers that byte on time. With None the node
    /// receives a transmission at its end at the latest, which suffices if every transmission is
    /// one packet.
    fn min_bytes_needed(&self) -> Option<usize> {
        None
    }

    /// Returns the addresses to which the node listens, if for now it
    ///
    /// - ignores every packet to another address whose bytes are complete at `spacing`: it need not
    ///   receive it, and is the same afterwards;
    /// - transmits nothing but one answer to a packet to one of them, as soon as it is received.
    ///
    /// None, the default, if it must receive everything, or may transmit at any time. It concerns
    /// buses with packets ([`crate::Rs485::with_packets`]).
    fn listens_to(&self, spacing: SimDuration) -> Option<Addresses> {
        let _ = spacing;
        None
    }

    /// Returns the time from the return of its supply until the node works again; none, the
    /// default, if it does not model a loss of it. Constant.
    fn boot_time(&self) -> Option<SimDuration> {
        None
    }

    /// Loses its supply: it opens the bridges of its motors, and forgets all but its non-volatile
    /// memory. Until [`Node::power_on`] nothing else is called but queries and snapshots.
    ///
    /// # Errors
    /// [`TaskError`] if the plant fails.
    fn power_off(&mut self, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        let _ = plant;
        Ok(())
    }

    /// Begins to work at `now`, from its non-volatile memory.
    fn power_on(&mut self, now: SimTime) {
        let _ = now;
    }

    /// Returns the time of the next call of [`Node::advance`] that the node requires.
    fn next_wake(&self) -> Option<SimTime>;

    /// Processes all events of the node up to and including `now`.
    ///
    /// # Errors
    /// [`TaskError`] if the plant fails.
    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError>;

    /// Appends the next transmission to `bytes` and returns the start of its first bit: now or
    /// later, and not before the end of the previous transmission. None if there is nothing to
    /// transmit.
    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime>;

    /// The same with a flag for wrong stop bits, for wrappers that damage transmissions.
    fn poll_transmit_framed(&mut self, bytes: &mut Vec<u8>) -> Option<(SimTime, bool)> {
        self.poll_transmit(bytes).map(|start| (start, false))
    }
}

impl<N: Node + ?Sized> Node for Box<N> {
    fn name(&self) -> &str {
        (**self).name()
    }

    fn receive(&mut self, piece: Piece<'_>) {
        (**self).receive(piece);
    }

    fn min_bytes_needed(&self) -> Option<usize> {
        (**self).min_bytes_needed()
    }

    fn listens_to(&self, spacing: SimDuration) -> Option<Addresses> {
        (**self).listens_to(spacing)
    }

    fn boot_time(&self) -> Option<SimDuration> {
        (**self).boot_time()
    }

    fn power_off(&mut self, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        (**self).power_off(plant)
    }

    fn power_on(&mut self, now: SimTime) {
        (**self).power_on(now);
    }

    fn next_wake(&self) -> Option<SimTime> {
        (**self).next_wake()
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        (**self).advance(now, plant)
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        (**self).poll_transmit(bytes)
    }

    fn poll_transmit_framed(&mut self, bytes: &mut Vec<u8>) -> Option<(SimTime, bool)> {
        (**self).poll_transmit_framed(bytes)
    }
}
