use twinrig_kernel::{SimDuration, SimTime};

use crate::{Part, PlantAccess, TaskError};

/// Transmit buffer of a serial port or converter, emptied by the transmitter at the baud rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TransmitBuffer {
    /// Time at which all bytes written so far are sent.
    pub idle_from: SimTime,
    /// Transmission time of a byte.
    pub byte_time: SimDuration,
    /// Capacity \[bytes\].
    pub capacity: usize,
}

impl TransmitBuffer {
    /// Returns the number of bytes that can be written at `now` without blocking the writer. Time
    /// before the transmitter begins counts as busy.
    pub fn room(&self, now: SimTime) -> usize {
        let busy = self.idle_from.checked_since(now).unwrap_or_default();
        let unsent = busy.as_nanos().div_ceil(self.byte_time.as_nanos().max(1));
        self.capacity
            .saturating_sub(usize::try_from(unsent).unwrap_or(usize::MAX))
    }
}

/// The transport with its timing and the emulated boards, in virtual time: the counterpart of a
/// driver. Exchanges bytes with the driver and signals with the plant.
///
/// The owner calls [`Wire::advance`] at every instant of [`Wire::next_wake`], and before each
/// [`Wire::send`] and [`Wire::receive`].
pub trait Wire: Part {
    /// Writes `bytes` from the host at `now`, in one piece.
    fn send(&mut self, now: SimTime, bytes: &[u8]);

    /// Writes more bytes from the host at `now` while the transmitter is busy or just idle
    /// ([`TransmitBuffer::idle_from`]): they follow the earlier ones without a pause, as in one
    /// piece.
    fn send_contiguous(&mut self, now: SimTime, bytes: &[u8]) {
        self.send(now, bytes);
    }

    /// Returns the transmit buffer between host and line, if it is bounded. The host should write
    /// no more than its free space.
    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        None
    }

    /// Returns the time of the next event that is visible to the host or acts on the plant.
    fn next_wake(&self) -> Option<SimTime>;

    /// Advances to `now`, inclusive.
    ///
    /// # Errors
    /// [`TaskError`] if the plant fails, or the port is lost.
    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError>;

    /// Handles the events after `now` that are not visible to the host, each at its own instant
    /// ([`PlantAccess::run_ahead`]), up to the next one that may be, but only those before
    /// `before`; returns the time of the last one. By default it handles none.
    ///
    /// # Errors
    /// As [`Wire::advance`].
    fn run_ahead(
        &mut self,
        now: SimTime,
        before: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<SimTime, TaskError> {
        let _ = (before, plant);
        Ok(now)
    }

    /// Appends the bytes that are available to the host at this time.
    fn receive(&mut self, bytes: &mut Vec<u8>);
}

impl<W: Wire + ?Sized> Wire for Box<W> {
    fn send(&mut self, now: SimTime, bytes: &[u8]) {
        (**self).send(now, bytes);
    }

    fn send_contiguous(&mut self, now: SimTime, bytes: &[u8]) {
        (**self).send_contiguous(now, bytes);
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

    fn run_ahead(
        &mut self,
        now: SimTime,
        before: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<SimTime, TaskError> {
        (**self).run_ahead(now, before, plant)
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) {
        (**self).receive(bytes);
    }
}
