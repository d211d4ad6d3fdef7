use std::str::FromStr;

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;
use twinrig_runtime::Timing;

use crate::WireError;

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

/// Time from the host controller's interrupt to the host's program. ASSUMED; up to 100 µs are
/// absorbed by the microframes.
pub const TURNAROUND: SimDuration = SimDuration::from_micros(20);
/// Maximum number of packets of 512 bytes in a microframe (USB 2.0, table 5-10).
const HIGH_SPEED_PACKETS: usize = 13;
/// Maximum number of packets of 64 bytes in a full-speed frame (USB 2.0, table 5-9).
const FULL_SPEED_PACKETS: usize = 19;

/// Named timings of hosts. Measure a host to find the preset that fits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum UsbPreset {
    /// `thesis`: the only set of assumptions with which four boards of 106 µs each are served at
    /// 400 Hz directly and, with 424 µs, at 1 kHz through a bus controller. Latency timer 0.
    #[default]
    Thesis,
    /// `earliest`: each transfer in the earliest microframe. Four boards are served at 1 kHz
    /// directly.
    Earliest,
    /// `low-latency`: as `thesis`, with a latency timer of 1 ms, Linux's low-latency setting.
    LowLatency,
    /// `default`: as `thesis`, with a latency timer of 16 ms, that of an unconfigured chip.
    Default,
    /// `full-speed`: the chip on a full-speed port: frames of 1 ms, packets of 62 bytes, latency
    /// timer 1 ms.
    FullSpeed,
}

impl UsbPreset {
    /// All presets.
    pub const ALL: [Self; 5] = [
        Self::Thesis,
        Self::Earliest,
        Self::LowLatency,
        Self::Default,
        Self::FullSpeed,
    ];

    /// Returns the name in a scenario.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Thesis => "thesis",
            Self::Earliest => "earliest",
            Self::LowLatency => "low-latency",
            Self::Default => "default",
            Self::FullSpeed => "full-speed",
        }
    }
}

impl FromStr for UsbPreset {
    type Err = WireError;

    fn from_str(name: &str) -> Result<Self, WireError> {
        let found = Self::ALL.into_iter().find(|preset| preset.name() == name);
        found.ok_or_else(|| WireError::Preset {
            found: name.to_owned(),
            known: Self::ALL.map(Self::name).join(", "),
        })
    }
}

impl UsbTiming {
    /// Returns the timing of a preset.
    pub fn preset(preset: UsbPreset) -> Self {
        let thesis = Self {
            microframe: SimDuration::from_micros(125),
            out: OutRule::EndOfNext,
            inn: InRule::ByPreviousFrame,
            completion: CompletionRule::StartOfNext,
            turnaround: TURNAROUND,
            latency_timer: SimDuration::ZERO,
            payload: 510,
            packets_per_microframe: HIGH_SPEED_PACKETS,
            jitter: Timing::ZERO,
            write_jitter: Timing::ZERO,
            frame_offset: SimDuration::ZERO,
            frame_rate_ppb: 0,
        };
        match preset {
            UsbPreset::Thesis => thesis,
            UsbPreset::Earliest => Self {
                out: OutRule::StartOfNext,
                inn: InRule::ByThisFrame,
                completion: CompletionRule::AtOnce,
                ..thesis
            },
            UsbPreset::LowLatency => Self {
                latency_timer: SimDuration::from_millis(1),
                ..thesis
            },
            UsbPreset::Default => Self {
                latency_timer: SimDuration::from_millis(16),
                ..thesis
            },
            UsbPreset::FullSpeed => Self {
                microframe: SimDuration::from_millis(1),
                latency_timer: SimDuration::from_millis(1),
                payload: 62,
                packets_per_microframe: FULL_SPEED_PACKETS,
                ..thesis
            },
        }
    }
}

impl Default for UsbTiming {
    fn default() -> Self {
        Self::preset(UsbPreset::default())
    }
}
