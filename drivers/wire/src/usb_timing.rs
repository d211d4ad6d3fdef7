use std::str::FromStr;

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;
use twinrig_runtime::Timing;

use crate::WireError;

/// When bytes that the host writes are in the chip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum OutRule {
    /// At once: as if there were no bus in between.
    AtOnce,
    /// At the start of the microframe after the one that the write falls in.
    StartOfNext,
    /// At the end of that microframe.
    #[default]
    EndOfNext,
}

/// Which bytes a packet to the host carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum InRule {
    /// Those that were complete in the chip by the start of its own microframe.
    ByThisFrame,
    /// Those that were complete by the start of the microframe before: the chip had readied the packet then.
    #[default]
    ByPreviousFrame,
}

/// When the host learns of a packet from the chip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum CompletionRule {
    /// As it passes, at the start of its microframe.
    AtOnce,
    /// At the start of the next microframe, when the host controller reports what the last one did.
    #[default]
    StartOfNext,
}

/// How long USB and the host's software take. Microframes are numbered; microframe *k* starts when the host
/// controller's clock shows *k* times its length.
///
/// With the default rules and a timer of 0, a write in microframe *k* is in the chip at the start of *k* + 2; what
/// comes back B later is seen 2 + ⌈B / 125 µs⌉ microframes after that. A request whose answer is there
/// B after it began therefore costs (4 + ⌈B / 125 µs⌉) · 125 µs, whatever the host does within the rest of the microframe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UsbTiming {
    /// Length of a microframe: 125 µs; 1 ms at full speed.
    pub microframe: SimDuration,
    /// Host to chip.
    pub out: OutRule,
    /// Chip to host.
    pub inn: InRule,
    /// Host controller to host.
    pub completion: CompletionRule,
    /// From there until the host's program has the bytes.
    pub turnaround: SimDuration,
    /// A packet that is not full is returned when that long has passed since the last return; counted
    /// in microframes, rounded up. 0: one every microframe.
    pub latency_timer: SimDuration,
    /// What a packet from the chip carries beside its 2 status bytes \[bytes\]. A full one is returned at once.
    pub payload: usize,
    /// How many packets fit into a microframe.
    pub packets_per_microframe: usize,
    /// Added to the turnaround of each completion. One that is late makes the next ones wait. It delays what the host reads,
    /// and what it writes only where that waits for a completion.
    pub jitter: Timing,
    /// From a write of the host's program to the host controller. One that is late makes the next ones wait.
    pub write_jitter: Timing,
    /// What the host controller's clock shows when the host's shows 0.
    pub frame_offset: SimDuration,
    /// How much faster than the host's clock it runs \[ppb\].
    pub frame_rate_ppb: i64,
}

/// Time from the host controller's interrupt to the host's program. ASSUMED; up to 100 µs the microframes absorb it.
pub const TURNAROUND: SimDuration = SimDuration::from_micros(20);
/// Packets of 512 bytes that a microframe has room for (USB 2.0, table 5-10).
const HIGH_SPEED_PACKETS: usize = 13;
/// Packets of 64 bytes that a full-speed frame has room for (USB 2.0, table 5-9).
const FULL_SPEED_PACKETS: usize = 19;

/// Named timings of hosts. Which one a host is like wants measuring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum UsbPreset {
    /// `thesis`: the one family of assumptions with which four boards of 106 µs each are served at 400 Hz
    /// directly and, with 424 µs, at 1 kHz through a bus controller. Latency timer 0.
    #[default]
    Thesis,
    /// `earliest`: each transfer in the earliest microframe. Four boards are served at 1 kHz directly.
    Earliest,
    /// `low-latency`: like `thesis`, with the latency timer at 1 ms, as Linux sets it when asked for low latency.
    LowLatency,
    /// `default`: like `thesis`, with the latency timer at the 16 ms of a chip that nobody has configured.
    Default,
    /// `full-speed`: the chip on a full-speed port: frames of 1 ms, packets of 62 bytes, latency timer 1 ms.
    FullSpeed,
}

impl UsbPreset {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Thesis,
        Self::Earliest,
        Self::LowLatency,
        Self::Default,
        Self::FullSpeed,
    ];

    /// Its name in a scenario.
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
    /// The timing of that name.
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
