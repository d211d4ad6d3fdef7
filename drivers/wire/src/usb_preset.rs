use std::str::FromStr;

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;
use twinrig_runtime::Timing;

use crate::{CompletionRule, InRule, OutRule, UsbTiming, WireError};

/// Time from the host controller's interrupt to the host's program. ASSUMED; up to 100 µs are
/// absorbed by the microframes.
pub const TURNAROUND: SimDuration = SimDuration::from_micros(20);
/// Maximum number of packets of 512 bytes in a microframe (USB 2.0, table 5-10).
const HIGH_SPEED_PACKETS: usize = 13;
/// Maximum number of packets of 64 bytes in a full-speed frame (USB 2.0, table 5-9).
const FULL_SPEED_PACKETS: usize = 19;
/// Period of the flush timer of an Arduino's `ATmega16U2`: 2^16 cycles at 16 MHz
/// (arduino-usbserial: timer 0 overflows, prescaler 256).
const FLUSH_TIMER: SimDuration = SimDuration::from_micros(4_096);

/// Named timings of hosts and adapters. Measure a host to find the preset that fits.
///
/// Those from `ft232r` on are adapters that were measured (github.com/seeraven/arduinoLatency at
/// 92ab2bf: one byte at 115 200 bit/s to an Arduino and back, every 50 ms). `docs/timing.md` has
/// the source of each figure, and how well it agrees.
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
    /// timer 1 ms. The rules are those of `thesis`; measured adapters are faster.
    FullSpeed,
    /// `ft232r`: FT232R, latency timer 1 ms, at an Odroid XU4.
    Ft232r,
    /// `ft232r-pi3`: the same at a Raspberry Pi 3B+, whose host controller is slower in a way that
    /// is not understood.
    Ft232rPi3,
    /// `ch340`: CH340G at an Odroid XU4. It holds bytes back in a way that is not understood.
    Ch340,
    /// `atmega16u2`: the USB chip of an Arduino Uno, a CDC-ACM device, at an Odroid XU4. Its
    /// firmware returns bytes when a timer of 4.096 ms expires.
    Atmega16u2,
    /// `uart`: UART of a Raspberry Pi 3B+, without USB.
    Uart,
}

impl UsbPreset {
    /// All presets.
    pub const ALL: [Self; 10] = [
        Self::Thesis,
        Self::Earliest,
        Self::LowLatency,
        Self::Default,
        Self::FullSpeed,
        Self::Ft232r,
        Self::Ft232rPi3,
        Self::Ch340,
        Self::Atmega16u2,
        Self::Uart,
    ];

    /// Returns the name in a scenario.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Thesis => "thesis",
            Self::Earliest => "earliest",
            Self::LowLatency => "low-latency",
            Self::Default => "default",
            Self::FullSpeed => "full-speed",
            Self::Ft232r => "ft232r",
            Self::Ft232rPi3 => "ft232r-pi3",
            Self::Ch340 => "ch340",
            Self::Atmega16u2 => "atmega16u2",
            Self::Uart => "uart",
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
        let (millis, micros) = (SimDuration::from_millis, SimDuration::from_micros);
        match preset {
            UsbPreset::Thesis => Self::thesis(),
            UsbPreset::Earliest => Self::earliest(),
            UsbPreset::LowLatency => Self {
                latency_timer: millis(1),
                ..Self::thesis()
            },
            UsbPreset::Default => Self {
                latency_timer: millis(16),
                ..Self::thesis()
            },
            UsbPreset::FullSpeed => Self {
                microframe: millis(1),
                latency_timer: millis(1),
                payload: 62,
                packets_per_microframe: FULL_SPEED_PACKETS,
                ..Self::thesis()
            },
            UsbPreset::Ft232r => Self {
                microframe: millis(1),
                latency_timer: millis(1),
                payload: 62,
                packets_per_microframe: FULL_SPEED_PACKETS,
                write_jitter: uniform(53, 105),
                ..Self::measured()
            },
            UsbPreset::Ft232rPi3 => Self {
                inn: InRule::After(micros(1_790)),
                payload: 62,
                write_jitter: uniform(53, 105),
                ..Self::measured()
            },
            UsbPreset::Ch340 => Self {
                inn: InRule::After(micros(1_820)),
                payload: 32,
                ..Self::measured()
            },
            UsbPreset::Atmega16u2 => Self {
                inn: InRule::ByTimer(FLUSH_TIMER),
                ..Self::measured()
            },
            UsbPreset::Uart => Self {
                microframe: micros(1),
                turnaround: SimDuration::ZERO,
                jitter: above(0, 10),
                write_jitter: above(5, 7),
                ..Self::measured()
            },
        }
    }

    fn thesis() -> Self {
        Self {
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
        }
    }

    fn earliest() -> Self {
        Self {
            out: OutRule::StartOfNext,
            inn: InRule::ByThisFrame,
            completion: CompletionRule::AtOnce,
            ..Self::thesis()
        }
    }

    /// Returns the common timing of measured adapters.
    fn measured() -> Self {
        // Full-speed packets pass through the hub's translator, in microframes.
        Self {
            out: OutRule::AtOnce,
            payload: 64,
            packets_per_microframe: FULL_SPEED_PACKETS.div_ceil(8),
            jitter: uniform(0, 90),
            write_jitter: above(35, 20),
            ..Self::earliest()
        }
    }
}

/// Evenly between two times \[µs\].
fn uniform(min: u64, max: u64) -> Timing {
    let [min, max] = [min, max].map(SimDuration::from_micros);
    Timing::Uniform { min, max }
}

/// The upper half of a normal distribution \[µs\].
fn above(mean: u64, deviation: u64) -> Timing {
    let mean = SimDuration::from_micros(mean);
    let deviation = SimDuration::from_micros(deviation);
    Timing::Normal {
        mean,
        deviation,
        min: mean,
        max: mean + deviation * 4,
    }
}

impl Default for UsbTiming {
    fn default() -> Self {
        Self::preset(UsbPreset::default())
    }
}
