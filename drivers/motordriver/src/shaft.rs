use core::f64::consts::{PI, TAU};
use std::fmt;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, Port, Unit, signal};

use crate::config::{BoardConfig, SessionGains};
use crate::reply::Reply;
use crate::units::{CONTINUOUS, POSITION_MASK, TURN, speed_word, unwrapped};

/// Commands of a shaft from the process: its rate.
pub(crate) const COMMANDED: usize = 1;
/// Values of a shaft for the process: position and rate.
pub(crate) const MEASURED: usize = 2;

/// Intervals between replies over which the rate is measured.
const RATE_INTERVALS: usize = 8;

/// Angle of a count \[rad\].
const COUNT: f64 = TAU / TURN as f64;

/// Host's view of a board: the free shaft whose signals it carries.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Shaft {
    name: String,
    id: u8,
    /// Maximum speed as written into the registers of the motor \[counts/s\].
    speed_max: u16,
    /// Whether the motor is set for continuous rotation, as reported by the board.
    continuous: bool,
    /// Last commanded rate \[rad/s\].
    commanded: f64,
    /// Position \[counts\], unwrapped.
    counts: i64,
    replies: Replies,
    /// Number of set-points that were out of range.
    pub(crate) saturated: u64,
    /// Number of intervals between replies in which the shaft may have turned by half a turn or
    /// more.
    pub(crate) ambiguous: u64,
}

/// The last replies: start of their cycle and position \[counts\].
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Replies {
    ring: [(HostTime, i64); RATE_INTERVALS + 1],
    /// Place of the next reply.
    next: usize,
    len: usize,
}

impl Replies {
    fn push(&mut self, at: HostTime, counts: i64) {
        self.ring[self.next] = (at, counts);
        self.next = (self.next + 1) % self.ring.len();
        self.len = (self.len + 1).min(self.ring.len());
    }

    /// Returns the reply before the last `n` ones.
    fn back(&self, n: usize) -> (HostTime, i64) {
        let size = self.ring.len();
        self.ring[(self.next + 2 * size - 1 - n) % size]
    }

    /// Returns the mean rate between the oldest reply and the newest \[rad/s\]; 0 before the second
    /// reply.
    fn rate(&self) -> f64 {
        if self.len < 2 {
            return 0.0;
        }
        let (newest, oldest) = (self.back(0), self.back(self.len - 1));
        let seconds = seconds_between(oldest.0, newest.0);
        if seconds > 0.0 {
            (newest.1 - oldest.1) as f64 * COUNT / seconds
        } else {
            0.0
        }
    }
}

fn seconds_between(from: HostTime, to: HostTime) -> f64 {
    to.as_nanos().saturating_sub(from.as_nanos()) as f64 * 1e-9
}

impl Shaft {
    pub(crate) fn new(board: &BoardConfig, gains: &SessionGains) -> Self {
        Self {
            name: board.name.clone(),
            id: board.id,
            speed_max: gains.max_speed,
            continuous: board.position_limits[0] & CONTINUOUS != 0,
            commanded: 0.0,
            counts: 0,
            replies: Replies::default(),
            saturated: 0,
            ambiguous: 0,
        }
    }

    /// Returns the ports of its commands and measurements.
    pub(crate) fn ports(&self) -> Vec<Port> {
        let name = |what: &str| signal::of_motor(&self.name, what);
        let position = name("position");
        vec![
            Port::input(name("rate/command"), Unit::RadianPerSecond, COMMANDED),
            Port::output(position.clone(), Unit::Radian, 1),
            Port::output(name("rate"), Unit::RadianPerSecond, 1),
        ]
    }

    /// Sets the limit of the motor as reported by the board.
    pub(crate) fn set_limit(&mut self, word: u16) {
        self.continuous = word & CONTINUOUS != 0;
    }

    /// Returns the reason why the board cannot serve the shaft, if any.
    pub(crate) fn refusal(&self) -> Option<String> {
        (!self.continuous).then(|| {
            format!(
                "{self} drives a free shaft, but bit 15 of its PositionLimit is not set: its motor has a range"
            )
        })
    }

    /// Returns the set-points for the rate \[rad/s\], limited to the maximum speed.
    pub(crate) fn goals(&mut self, rate: f64) -> [u16; 2] {
        let (word, saturated) = speed_word(rate, self.speed_max);
        self.saturated += u64::from(saturated);
        self.commanded = rate;
        [word, 0]
    }

    /// Stores the reply of a cycle that began at `at`. Returns false and stores nothing if the
    /// position exceeds 12 bits, which no board sends. Sensors are not connected.
    pub(crate) fn store(&mut self, reply: &Reply, at: HostTime) -> bool {
        let word = reply.positions[0];
        let plausible = word <= POSITION_MASK;
        if plausible {
            if self.replies.len > 0 {
                let rate = self.replies.rate().abs().max(self.commanded.abs());
                let turned = rate * seconds_between(self.replies.back(0).0, at);
                self.ambiguous += u64::from(turned >= PI);
            }
            self.counts = unwrapped(word, self.counts);
            self.replies.push(at, self.counts);
        }
        plausible
    }

    /// Stores the position of the start of a session. Whole turns before it are unknown: the
    /// position is within half a turn of the last one, initially 0.
    pub(crate) fn store_word(&mut self, word: u16) {
        self.counts = unwrapped(word & POSITION_MASK, self.counts);
        self.replies = Replies::default();
    }

    /// Writes the values for the process: the last valid ones.
    pub(crate) fn write(&self, values: &mut [f64]) {
        values[0] = self.counts as f64 * COUNT;
        values[1] = self.replies.rate();
    }
}

impl fmt::Display for Shaft {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "board {} (id {})", self.name, self.id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shaft() -> Shaft {
        Shaft::new(&BoardConfig::shaft("cam", 5), &SessionGains::default())
    }

    fn reply(counts: i64) -> Reply {
        let word = u16::try_from(counts.rem_euclid(i64::from(TURN))).unwrap();
        Reply {
            positions: [word, 0],
            ..Reply::default()
        }
    }

    fn at_ms(millis: u64) -> HostTime {
        HostTime::from_nanos(millis * 1_000_000)
    }

    fn values(shaft: &Shaft) -> [f64; MEASURED] {
        let mut values = [0.0; MEASURED];
        shaft.write(&mut values);
        values
    }

    #[test]
    fn rate_is_the_mean_over_eight_intervals_and_survives_missing_replies() {
        let mut shaft = shaft();
        shaft.store_word(4_000);
        // 30 counts per reply of 10 ms; every fifth is missing.
        for n in (0..100_u64).filter(|n| n % 5 != 4) {
            assert!(shaft.store(
                &reply(4_000 + 30 * i64::try_from(n).unwrap()),
                at_ms(10 * n)
            ));
            let expected = if n == 0 { 0.0 } else { 3_000.0 * COUNT };
            // Rounding of the quotient.
            assert!((values(&shaft)[1] - expected).abs() < 1e-12 * expected.max(1.0));
        }
        // The start is at −96 counts, within half a turn of zero.
        assert!((values(&shaft)[0] - (30.0 * 98.0 - 96.0) * COUNT).abs() < 1e-12);
        assert_eq!(shaft.ambiguous, 0);
    }

    #[test]
    fn gaps_of_half_a_turn_are_counted() {
        let mut shaft = shaft();
        shaft.goals(TAU);
        shaft.store(&reply(0), at_ms(0));
        shaft.store(&reply(2_000), at_ms(499));
        assert_eq!(shaft.ambiguous, 0);
        shaft.store(&reply(4_050), at_ms(1_000));
        assert_eq!(shaft.ambiguous, 1);
    }

    #[test]
    fn implausible_position_is_rejected() {
        let mut shaft = shaft();
        let mut wrong = reply(10);
        wrong.positions[0] |= 0x1000;
        assert!(!shaft.store(&wrong, at_ms(1)));
        assert_eq!(values(&shaft), [0.0; 2]);
    }
}
