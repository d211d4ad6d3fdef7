use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Timing;

/// Rule for the time at which bytes written by the host are in the chip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum OutRule {
    /// At once, as if there were no USB.
    AtOnce,
    /// At the start of the microframe after that of the write.
    StartOfNext,
    /// At the end of that microframe.
    #[default]
    EndOfNext,
}

/// Rule for the bytes that a packet to the host carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum InRule {
    /// Bytes complete in the chip by the start of the packet's microframe.
    ByThisFrame,
    /// Bytes complete by the start of the previous microframe, when the chip prepares the packet.
    #[default]
    ByPreviousFrame,
    /// Bytes complete when a timer of the chip with this period last expired, and full packets. The
    /// timer runs freely from time 0.
    ByTimer(SimDuration),
    /// Bytes complete since this time, and full packets.
    After(SimDuration),
}

impl InRule {
    /// Returns the longest time for which the chip holds back a byte, besides its latency timer.
    pub const fn hold_max(self) -> SimDuration {
        match self {
            Self::ByThisFrame | Self::ByPreviousFrame => SimDuration::ZERO,
            Self::ByTimer(time) | Self::After(time) => time,
        }
    }

    /// Returns the time from which on a packet that is not full may carry a byte complete at
    /// `arrival`.
    pub(crate) fn ready(self, arrival: SimTime) -> SimTime {
        match self {
            Self::ByThisFrame | Self::ByPreviousFrame => arrival,
            Self::ByTimer(period) => {
                let expiries = arrival.as_nanos().div_ceil(period.as_nanos().max(1));
                SimTime::ZERO + period * expiries
            }
            Self::After(delay) => arrival + delay,
        }
    }

    /// Returns the latest completion of a byte that such a packet may carry at `now`.
    pub(crate) fn ready_until(self, now: SimTime) -> Option<SimTime> {
        match self {
            Self::ByThisFrame | Self::ByPreviousFrame => Some(now),
            Self::ByTimer(period) => {
                let expiries = now.as_nanos() / period.as_nanos().max(1);
                Some(SimTime::ZERO + period * expiries)
            }
            Self::After(delay) => now
                .checked_since(SimTime::ZERO + delay)
                .map(|since| SimTime::ZERO + since),
        }
    }
}

/// Rule for the time at which the host controller reports a packet from the chip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum CompletionRule {
    /// At once, at the start of the packet's microframe.
    AtOnce,
    /// At the start of the next microframe, when the host controller reports the transfers of the
    /// previous one.
    #[default]
    StartOfNext,
}

/// Timing of USB and of the host's software. Microframes are numbered: microframe *k* starts when
/// the host controller's clock is *k* times its length.
///
/// With the default rules and a latency timer of 0, a write in microframe *k* is in the chip at the
/// start of *k* + 2, and an answer complete a time B later is read 2 + ⌈B / 125 µs⌉ microframes
/// after that. So a request whose answer is complete a time B after its first bit takes (4 + ⌈B /
/// 125 µs⌉) · 125 µs, independently of the host's processing within the rest of the microframe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UsbTiming {
    /// Length of a microframe: 125 µs; 1 ms at full speed.
    pub microframe: SimDuration,
    /// Delay from host to chip.
    pub out: OutRule,
    /// Delay from chip to host controller.
    pub inn: InRule,
    /// Delay from host controller to host.
    pub completion: CompletionRule,
    /// Time from the completion until the host's program has the bytes.
    pub turnaround: SimDuration,
    /// A packet that is not full is returned at this time after the last return, in microframes,
    /// rounded up. 0: one packet in every microframe.
    pub latency_timer: SimDuration,
    /// Payload of a packet from the chip, besides its 2 status bytes \[bytes\]. A full packet is
    /// returned at once.
    pub payload: usize,
    /// Maximum number of packets in a microframe.
    pub packets_per_microframe: usize,
    /// Added to the turnaround of each completion; a late one delays the next ones. Delays reads,
    /// and writes only where they wait for a completion.
    pub jitter: Timing,
    /// Time from a write of the host's program to the host controller; a late one delays the next
    /// ones.
    pub write_jitter: Timing,
    /// Reading of the host controller's clock at the host's time 0.
    pub frame_offset: SimDuration,
    /// Rate deviation of the host controller's clock from the host's \[ppb\]; positive: faster.
    pub frame_rate_ppb: i64,
}
