use serde::{Deserialize, Serialize};

/// Periods without a command after which the firmware drops its motors (public liboncilla-hw sources, 2014).
const PERIODS: u32 = 10;

/// Drops the motors when no command comes any longer.
///
/// It counts the ticks that saw no new command, in a row; more than ten periods of them, and the motors are dropped.
/// So at 500 Hz a pause of up to 21 ms from command to command never does, one of 22 ms or more always does: of
/// commands that come every 2 ms, nine may be lost in a row and ten may not. A silence of exactly 20 ms, the border,
/// lies on the safe side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Watchdog {
    silent_ticks: u32,
    drops: u64,
}

impl Watchdog {
    /// Starts to count anew: a command has come, or the motors are switched on.
    pub(crate) fn feed(&mut self) {
        self.silent_ticks = 0;
    }

    /// A tick without a new command; whether the motors are to be dropped now.
    pub(crate) fn starve(&mut self, period_ticks: u16) -> bool {
        self.silent_ticks = self.silent_ticks.saturating_add(1);
        let drop = self.silent_ticks == PERIODS * u32::from(period_ticks) + 1;
        self.drops += u64::from(drop);
        drop
    }

    /// How often it did.
    pub(crate) fn drops(&self) -> u64 {
        self.drops
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Whether a pause from command to command \[µs\] drops the motors; the first tick comes `phase` after the first.
    fn drops(pause_us: u32, phase_us: u32) -> bool {
        let mut watchdog = Watchdog::default();
        watchdog.feed(); // the tick at `phase`
        let mut dropped = false;
        let mut tick = phase_us + 1_000;
        while tick < pause_us {
            dropped |= watchdog.starve(2);
            tick += 1_000;
        }
        dropped
    }

    proptest! {
        #[test]
        fn at_500_hz_twenty_one_milliseconds_never_drop_and_twenty_two_always(
            pause_us in 1_000_u32..30_000,
            phase_us in 0_u32..1_000,
        ) {
            if pause_us <= 21_000 {
                prop_assert!(!drops(pause_us, phase_us));
            }
            if pause_us > 22_000 {
                prop_assert!(drops(pause_us, phase_us));
            }
        }
    }

    #[test]
    fn exactly_ten_periods_lie_on_the_safe_side() {
        assert!((0..1_000).all(|phase| !drops(20_000, phase)));
    }

    #[test]
    fn motors_are_dropped_once_a_silence() {
        let mut watchdog = Watchdog::default();
        let dropped = (0..100).filter(|_| watchdog.starve(2)).count();
        assert_eq!((dropped, watchdog.drops()), (1, 1));
        watchdog.feed();
        assert!((0..20).all(|_| !watchdog.starve(2)) && watchdog.starve(2));
    }
}
