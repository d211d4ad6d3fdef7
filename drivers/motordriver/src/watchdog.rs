use serde::{Deserialize, Serialize};

/// Periods without a command after which the firmware drops its motors (public liboncilla-hw
/// sources, 2014).
const PERIODS: u32 = 10;

/// Command watchdog of the motors.
///
/// It counts consecutive ticks without a new command and drops the motors when the count exceeds
/// ten periods. At 500 Hz a pause of up to 21 ms between commands therefore never drops them, and
/// one of 22 ms or more always does: of commands with a period of 2 ms, nine consecutive ones may
/// be lost and ten may not. A pause of exactly 20 ms, the limit, does not drop the motors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Watchdog {
    silent_ticks: u32,
    drops: u64,
}

impl Watchdog {
    /// Resets the count: at a command, at activation, and while no motor is driven.
    pub(crate) fn feed(&mut self) {
        self.silent_ticks = 0;
    }

    /// Counts a tick without a new command. Returns whether the motors are to be dropped now.
    pub(crate) fn count_silent_tick(&mut self, period_ticks: u16) -> bool {
        self.silent_ticks = self.silent_ticks.saturating_add(1);
        let drop = self.silent_ticks == PERIODS * u32::from(period_ticks) + 1;
        self.drops += u64::from(drop);
        drop
    }

    /// Counts on from this number of drops.
    pub(crate) fn continue_drops(&mut self, drops: u64) {
        self.drops = drops;
    }

    /// Returns the number of times that the motors were dropped.
    pub(crate) fn drops(&self) -> u64 {
        self.drops
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Returns whether a pause between two commands \[µs\] drops the motors; the first tick follows
    /// the first command by `phase_us`.
    fn drops(pause_us: u32, phase_us: u32) -> bool {
        let mut watchdog = Watchdog::default();
        watchdog.feed(); // tick at `phase_us`
        let mut dropped = false;
        let mut tick = phase_us + 1_000;
        while tick < pause_us {
            dropped |= watchdog.count_silent_tick(2);
            tick += 1_000;
        }
        dropped
    }

    proptest! {
        #[test]
        fn pause_drops_motors_beyond_22_ms_and_never_up_to_21_ms_at_500_hz(
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
    fn pause_of_exactly_ten_periods_does_not_drop_motors() {
        assert!((0..1_000).all(|phase| !drops(20_000, phase)));
    }

    #[test]
    fn motors_are_dropped_once_per_pause() {
        let mut watchdog = Watchdog::default();
        let dropped = (0..100).filter(|_| watchdog.count_silent_tick(2)).count();
        assert_eq!((dropped, watchdog.drops()), (1, 1));
        watchdog.feed();
        assert!((0..20).all(|_| !watchdog.count_silent_tick(2)) && watchdog.count_silent_tick(2));
    }
}
