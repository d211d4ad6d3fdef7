use twinrig_kernel::SimDuration;
use twinrig_wire::{OutRule, UsbPreset, UsbTiming};

/// Adapter of which the loop is predicted.
#[derive(Clone, Debug)]
pub struct Adapter {
    /// Name in tables.
    pub name: &'static str,
    /// Timing.
    pub usb: UsbTiming,
}

/// Returns all presets, and three adapters that were not measured: `at-once` has the delays of the
/// host that were measured with an `atmega16u2`, returns bytes in the next microframe, and stands
/// for a CDC-ACM device or a high-speed chip without a latency timer; `at-once-1ms` and
/// `at-once-16ms` have the timer of an FT232H. ASSUMED.
pub fn adapters() -> Vec<Adapter> {
    let presets = UsbPreset::ALL.map(|preset| Adapter {
        name: preset.name(),
        usb: UsbTiming::preset(preset),
    });
    let delays = UsbTiming::preset(UsbPreset::Atmega16u2);
    let at_once = UsbTiming {
        out: OutRule::AtOnce,
        jitter: delays.jitter,
        write_jitter: delays.write_jitter,
        ..UsbTiming::preset(UsbPreset::Earliest)
    };
    let timers = [("at-once", 0), ("at-once-1ms", 1), ("at-once-16ms", 16)];
    let others = timers.map(|(name, timer)| Adapter {
        name,
        usb: UsbTiming {
            latency_timer: SimDuration::from_millis(timer),
            ..at_once.clone()
        },
    });
    presets.into_iter().chain(others).collect()
}
