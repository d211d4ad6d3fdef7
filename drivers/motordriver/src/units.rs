//! Counts of the boards, and angles and forces of everybody else.

use core::f64::consts::TAU;

use libm::rint;
use serde::{Deserialize, Serialize};

use crate::assumed::{FORCE_PER_COUNT, FORCE_ZERO};

/// Counts of a motor's encoder in a turn of its joint (public liboncilla-hw sources, 2014).
pub(crate) const TURN: i32 = 4_096;
/// Counts of a magnetic encoder in a turn: 14 bits.
const MAGNETIC_TURN: i32 = 1 << 14;
/// What of the register `PositionLimit` is the limit; the bit above is a flag (same source).
pub(crate) const LIMIT_MASK: u16 = 0x7FFF;
/// Greatest count of the force sensor: 12 bits.
const FORCE_COUNT_MAX: i32 = 0x0FFF;

/// On which side of the robot a leg is. The boards of the left legs are mounted mirrored, so that their motors count
/// the other way (as in liboncilla-hw; another user of the robot mirrored the right ones).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Side {
    /// Counts fall where angles grow.
    Left,
    /// Counts grow with the angles.
    Right,
}

/// Which of a board's two motors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Joint {
    /// The first: its zero is in the middle of its range.
    Hip,
    /// The second: its zero, the leg extended, is an end of its range.
    Knee,
}

impl Joint {
    /// In the order of the motors.
    pub const ALL: [Self; 2] = [Self::Hip, Self::Knee];

    /// As in the names of signals.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hip => "hip",
            Self::Knee => "knee",
        }
    }
}

/// How the counts of a motor and the angle of its joint belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Scale {
    /// Counts of the zero pose.
    zero: i32,
    /// Counts the other way.
    mirrored: bool,
    /// Greatest count of the range, which begins at 0.
    limit: i32,
}

impl Scale {
    /// Of a motor with that range \[counts\].
    pub(crate) fn new(joint: Joint, side: Side, limit: u16) -> Self {
        let limit = i32::from(limit & LIMIT_MASK);
        let mirrored = side == Side::Left;
        let zero = match (joint, side) {
            (Joint::Hip, _) => limit / 2,
            (Joint::Knee, Side::Right) => 0,
            (Joint::Knee, Side::Left) => limit,
        };
        Self {
            zero,
            mirrored,
            limit,
        }
    }

    /// The nearest count to an angle \[rad\]; far outside of the range, the end of what 16 bits hold.
    pub(crate) fn counts(&self, angle: f64) -> i32 {
        let counts = nearest(angle * (f64::from(TURN) / TAU), 30_000);
        self.zero + if self.mirrored { -counts } else { counts }
    }

    /// The angle of a count \[rad\].
    pub(crate) fn angle(&self, counts: i32) -> f64 {
        let counts = counts - self.zero;
        let counts = if self.mirrored { -counts } else { counts };
        f64::from(counts) * (TAU / f64::from(TURN))
    }

    /// The volts or rates of the joint that belong to those of the motor, and the other way round.
    pub(crate) fn signed(&self, value: f64) -> f64 {
        if self.mirrored { -value } else { value }
    }

    /// The word of a set-point, and whether the angle was out of the range and the nearest end was taken instead.
    pub(crate) fn command(&self, angle: f64) -> (u16, bool) {
        let counts = self.counts(angle);
        let within = counts.clamp(0, self.limit);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 0 and 0x7FFF"
        )]
        let word = within as u16;
        (word, within != counts)
    }

    /// The word of a position: 12 bits of the turn.
    pub(crate) fn position_word(counts: i32) -> u16 {
        #[expect(clippy::cast_possible_truncation, reason = "between 0 and 4095")]
        let word = counts.rem_euclid(TURN) as u16;
        word
    }

    /// The angle that a position word says \[rad\]: that within half a turn of the middle of the range.
    pub(crate) fn position(&self, word: u16) -> f64 {
        let lowest = self.limit / 2 - TURN / 2;
        let counts = (i32::from(word) - lowest).rem_euclid(TURN) + lowest;
        self.angle(counts)
    }
}

/// The nearest integer within ± `most`; 0 for what is no number.
fn nearest(value: f64, most: i32) -> i32 {
    let most = f64::from(most);
    #[expect(
        clippy::cast_possible_truncation,
        reason = "within the clamp; what is no number becomes 0"
    )]
    let nearest = rint(value.clamp(-most, most)) as i32;
    nearest
}

/// A magnetic encoder's word: the angle in the low 14 bits, the status above them, 0 where all is well.
pub(crate) fn magnetic_word(angle: f64) -> u16 {
    let turns = angle * (1.0 / TAU);
    let part = turns - rint(turns);
    let counts = nearest(part * f64::from(MAGNETIC_TURN), MAGNETIC_TURN);
    #[expect(clippy::cast_possible_truncation, reason = "14 bits, not negative")]
    let word = counts.rem_euclid(MAGNETIC_TURN) as u16;
    word
}

/// The angle within half a turn of zero \[rad\] and the status of a magnetic encoder's word.
pub(crate) fn magnetic_angle(word: u16) -> (f64, u8) {
    let counts = i32::from(word & 0x3FFF);
    let signed = if counts >= MAGNETIC_TURN / 2 {
        counts - MAGNETIC_TURN
    } else {
        counts
    };
    let status = (word >> 14) as u8;
    (f64::from(signed) * (TAU / f64::from(MAGNETIC_TURN)), status)
}

/// The nearest count of the force sensor to a force \[N\], and whether it was out of its range.
pub(crate) fn force_word(newtons: f64) -> (u16, bool) {
    let counts = i32::from(FORCE_ZERO) + nearest(newtons / FORCE_PER_COUNT, 30_000);
    let within = counts.clamp(0, FORCE_COUNT_MAX);
    #[expect(clippy::cast_sign_loss, reason = "between 0 and 4095")]
    let word = within as u16;
    (word, within != counts)
}

/// The force that a count of the sensor says \[N\]. Of the word, 12 bits count.
pub(crate) fn force(word: u16) -> f64 {
    f64::from(i32::from(word & 0x0FFF) - i32::from(FORCE_ZERO)) * FORCE_PER_COUNT
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_scale() -> impl Strategy<Value = Scale> {
        let joint = prop_oneof![Just((Joint::Hip, 1_200)), Just((Joint::Knee, 1_350))];
        let side = prop_oneof![Just(Side::Left), Just(Side::Right)];
        (joint, side).prop_map(|((joint, limit), side)| Scale::new(joint, side, limit))
    }

    const HALF_COUNT: f64 = 0.5 * TAU / 4_096.0 + 1e-12;

    proptest! {
        #[test]
        fn a_command_says_the_angle_within_half_a_count_or_that_it_was_out_of_range(
            scale in any_scale(),
            angle in -3.0..3.0_f64,
        ) {
            let (word, saturated) = scale.command(angle);
            prop_assert!(i32::from(word) <= scale.limit);
            let said = scale.angle(i32::from(word));
            prop_assert_eq!((said - angle).abs() > HALF_COUNT, saturated);
        }

        #[test]
        fn a_position_comes_back_within_half_a_count_even_a_little_out_of_range(
            scale in any_scale(),
            excess in -300..300_i32,
        ) {
            for counts in [excess, scale.limit + excess] {
                let angle = scale.angle(counts);
                prop_assert_eq!(scale.counts(angle), counts);
                let word = Scale::position_word(counts);
                prop_assert!(word < 4_096);
                prop_assert!((scale.position(word) - angle).abs() < 1e-12);
            }
        }

        #[test]
        fn magnetic_words_hold_angles_within_half_a_count(angle in -3.0..3.0_f64) {
            let (said, status) = magnetic_angle(magnetic_word(angle));
            prop_assert!((said - angle).abs() <= 0.5 * TAU / 16_384.0 + 1e-12);
            prop_assert_eq!(status, 0);
        }

        #[test]
        fn forces_come_back_within_half_a_count_or_saturate(newtons in -200.0..200.0_f64) {
            let (word, saturated) = force_word(newtons);
            prop_assert_eq!((force(word) - newtons).abs() > 0.5 * FORCE_PER_COUNT + 1e-9, saturated);
        }

        #[test]
        fn no_number_at_all_breaks_a_word(bits in any::<u64>()) {
            let value = f64::from_bits(bits);
            let scale = Scale::new(Joint::Knee, Side::Left, 1_350);
            prop_assert!(scale.command(value).0 <= 1_350);
            prop_assert!(magnetic_word(value) < 1 << 14);
            prop_assert!(force_word(value).0 < 1 << 12);
        }
    }

    #[test]
    fn the_ranges_are_those_of_the_robot() {
        let degrees = 180.0 / core::f64::consts::PI;
        let hip = Scale::new(Joint::Hip, Side::Right, 1_200);
        assert!((hip.angle(1_200) * degrees - 52.7).abs() < 0.05);
        assert!((hip.angle(0) * degrees + 52.7).abs() < 0.05);
        let knee = Scale::new(Joint::Knee, Side::Right, 1_350);
        assert!((knee.angle(1_350) * degrees - 118.7).abs() < 0.05);
        assert_eq!(knee.command(0.0), (0, false));
    }

    #[test]
    fn left_legs_count_the_other_way() {
        let hip = Scale::new(Joint::Hip, Side::Left, 1_200);
        assert!(hip.command(0.1).0 < 600);
        let knee = Scale::new(Joint::Knee, Side::Left, 1_350);
        assert_eq!(knee.command(0.0), (1_350, false));
        assert!(knee.command(0.1).0 < 1_350);
    }

    #[test]
    fn the_flag_above_a_limit_is_not_part_of_it() {
        let flagged = Scale::new(Joint::Hip, Side::Right, 1_200 + 0x8000);
        assert_eq!(flagged, Scale::new(Joint::Hip, Side::Right, 1_200));
    }
}
