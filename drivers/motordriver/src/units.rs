//! Conversion between the counts of the boards and angles and forces in SI units.

use core::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use crate::assumed::{FORCE_PER_COUNT, FORCE_ZERO, SPEED_UNIT};

/// Counts of a motor's encoder per turn of its joint (public liboncilla-hw sources, 2014).
pub(crate) const TURN: i32 = 4_096;
/// Counts of a magnetic encoder per turn: 14 bits.
const MAGNETIC_TURN: i32 = 1 << 14;
/// Bits of the register `PositionLimit` that hold the limit; the bit above is a flag (same source).
pub(crate) const LIMIT_MASK: u16 = 0x7FFF;
/// ASSUMED: that flag permits continuous rotation, and with it velocity mode.
pub(crate) const CONTINUOUS: u16 = !LIMIT_MASK;
/// Bits of a position word.
pub(crate) const POSITION_MASK: u16 = 0x0FFF;
/// Maximum count of the force sensor: 12 bits.
const FORCE_COUNT_MAX: i32 = 0x0FFF;

/// Side of the robot. The boards of the left legs are mounted mirrored, so that their motors count
/// in the opposite direction (as in liboncilla-hw; another user of the robot mirrored the right
/// ones).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Side {
    /// Counts decrease with increasing angle.
    Left,
    /// Counts increase with the angle.
    Right,
}

/// Motor of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Joint {
    /// First motor. Zero: middle of its range.
    Hip,
    /// Second motor. Zero: extended leg, an end of its range.
    Knee,
}

impl Joint {
    /// All joints in the order of the motors.
    pub const ALL: [Self; 2] = [Self::Hip, Self::Knee];

    /// Returns the name used in signals.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hip => "hip",
            Self::Knee => "knee",
        }
    }
}

/// Conversion between the counts of a motor and the angle of its joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Scale {
    /// Counts in the zero pose.
    zero: i32,
    /// Whether counts decrease with increasing angle.
    mirrored: bool,
    /// Upper end of the range \[counts\]; the lower end is 0.
    limit: i32,
    /// Whether the angle has no bounds.
    free: bool,
}

impl Scale {
    /// Creates the conversion for a motor with the range \[counts\].
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
            free: false,
        }
    }

    /// Creates the conversion for a shaft that rotates without limit.
    pub(crate) fn free() -> Self {
        Self {
            zero: 0,
            mirrored: false,
            limit: i32::from(POSITION_MASK),
            free: true,
        }
    }

    /// Returns the count nearest to an angle \[rad\]: saturated far outside the range to fit 16
    /// bits, or of a free shaft modulo 2³².
    pub(crate) fn counts(&self, angle: f64) -> i32 {
        if self.free {
            return free_counts(angle);
        }
        let counts = nearest(angle * (f64::from(TURN) / TAU), 30_000);
        self.zero + if self.mirrored { -counts } else { counts }
    }

    /// Returns the angle of a count \[rad\].
    pub(crate) fn angle(&self, counts: i32) -> f64 {
        let counts = counts - self.zero;
        let counts = if self.mirrored { -counts } else { counts };
        f64::from(counts) * (TAU / f64::from(TURN))
    }

    /// Converts voltages or rates between motor and joint, in either direction.
    pub(crate) fn signed(&self, value: f64) -> f64 {
        if self.mirrored { -value } else { value }
    }

    /// Returns the word of a set-point, and whether the angle was saturated at an end of the range.
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

    /// Returns the word of a position: 12 bits, modulo one turn.
    pub(crate) fn position_word(counts: i32) -> u16 {
        #[expect(clippy::cast_possible_truncation, reason = "between 0 and 4095")]
        let word = counts.rem_euclid(TURN) as u16;
        word
    }

    /// Returns the angle of a position word \[rad\], within half a turn of the middle of the range.
    pub(crate) fn position(&self, word: u16) -> f64 {
        let lowest = self.limit / 2 - TURN / 2;
        let counts = (i32::from(word) - lowest).rem_euclid(TURN) + lowest;
        self.angle(counts)
    }
}

/// Returns the nearest whole number, ties to even, as `rint` does but inline: eight of them are a
/// third of a board's tick.
fn round(value: f64) -> f64 {
    /// Beyond 2⁵¹ the sum with it has no digit behind the point.
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    if value.abs() < 2_251_799_813_685_248.0 {
        (value + SHIFT) - SHIFT
    } else {
        libm::rint(value)
    }
}

/// Returns the nearest integer within ± `most`; 0 for NaN.
fn nearest(value: f64, most: i32) -> i32 {
    let most = f64::from(most);
    #[expect(
        clippy::cast_possible_truncation,
        reason = "within the clamp; NaN becomes 0"
    )]
    let nearest = round(value.clamp(-most, most)) as i32;
    nearest
}

/// Returns the count nearest to an angle without bounds \[rad\], modulo 2³², like an encoder
/// counter of 32 bits; 0 for NaN.
fn free_counts(angle: f64) -> i32 {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "exact to 10¹² turns; the counter overflows as in hardware"
    )]
    let counts = round(angle * (f64::from(TURN) / TAU)) as i64 as i32;
    counts
}

/// Returns the count nearest to `near` that has a position word: unwraps it, provided that the
/// shaft has turned by less than half a turn since `near`.
pub(crate) fn unwrapped(word: u16, near: i64) -> i64 {
    let (turn, half) = (i64::from(TURN), i64::from(TURN) / 2);
    near + (i64::from(word) - near + half).rem_euclid(turn) - half
}

/// Returns the word of a speed in velocity mode nearest to a rate \[rad/s\], and whether it was
/// saturated, at `most` \[counts/s\] or at the end of the word's range.
pub(crate) fn speed_word(rate: f64, most: u16) -> (u16, bool) {
    let most = (i32::from(most) / SPEED_UNIT).min(i32::from(i16::MAX));
    let units = nearest(
        rate * (f64::from(TURN) / TAU / f64::from(SPEED_UNIT)),
        100_000,
    );
    let within = units.clamp(-most, most);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within 16 bits, two's complement"
    )]
    let word = within as i16 as u16;
    (word, within != units)
}

/// Returns the speed of a word in velocity mode \[counts/s\].
pub(crate) fn speed(word: u16) -> i32 {
    i32::from(word.cast_signed()) * SPEED_UNIT
}

/// Returns a magnetic encoder's word: the angle in the low 14 bits, the status above, 0 for no
/// fault.
pub(crate) fn magnetic_word(angle: f64) -> u16 {
    let turns = angle * (1.0 / TAU);
    let part = turns - round(turns);
    let counts = nearest(part * f64::from(MAGNETIC_TURN), MAGNETIC_TURN);
    #[expect(clippy::cast_possible_truncation, reason = "14 bits, not negative")]
    let word = counts.rem_euclid(MAGNETIC_TURN) as u16;
    word
}

/// Returns the angle \[rad\] within half a turn of zero and the status of a magnetic encoder's
/// word.
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

/// Returns the count of the force sensor nearest to a force \[N\], and whether it was saturated.
pub(crate) fn force_word(newtons: f64) -> (u16, bool) {
    let counts = i32::from(FORCE_ZERO) + nearest(newtons / FORCE_PER_COUNT, 30_000);
    let within = counts.clamp(0, FORCE_COUNT_MAX);
    #[expect(clippy::cast_sign_loss, reason = "between 0 and 4095")]
    let word = within as u16;
    (word, within != counts)
}

/// Returns the force of a count of the sensor \[N\]. Only the low 12 bits of the word are used.
pub(crate) fn force(word: u16) -> f64 {
    f64::from(i32::from(word & 0x0FFF) - i32::from(FORCE_ZERO)) * FORCE_PER_COUNT
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn rounding_equals_rint(value in any::<f64>(), halves in -9_000_000_i64..9_000_000, power in -3..50_i32) {
            let scaled = halves as f64 * libm::exp2(f64::from(power));
            for value in [value, 0.5 * halves as f64, scaled, -scaled + 0.5, f64::INFINITY] {
                prop_assert_eq!(round(value), libm::rint(value), "{}", value);
            }
        }
    }

    fn any_scale() -> impl Strategy<Value = Scale> {
        let joint = prop_oneof![Just((Joint::Hip, 1_200)), Just((Joint::Knee, 1_350))];
        let side = prop_oneof![Just(Side::Left), Just(Side::Right)];
        (joint, side).prop_map(|((joint, limit), side)| Scale::new(joint, side, limit))
    }

    const HALF_COUNT: f64 = 0.5 * TAU / 4_096.0 + 1e-12;

    proptest! {
        #[test]
        fn command_is_exact_to_half_a_count_or_saturated(
            scale in any_scale(),
            angle in -3.0..3.0_f64,
        ) {
            let (word, saturated) = scale.command(angle);
            prop_assert!(i32::from(word) <= scale.limit);
            let decoded = scale.angle(i32::from(word));
            prop_assert_eq!((decoded - angle).abs() > HALF_COUNT, saturated);
        }

        #[test]
        fn position_round_trips_within_and_slightly_beyond_the_range(
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
        fn magnetic_word_is_exact_to_half_a_count(angle in -3.0..3.0_f64) {
            let (decoded, status) = magnetic_angle(magnetic_word(angle));
            prop_assert!((decoded - angle).abs() <= 0.5 * TAU / 16_384.0 + 1e-12);
            prop_assert_eq!(status, 0);
        }

        #[test]
        fn force_word_is_exact_to_half_a_count_or_saturated(newtons in -200.0..200.0_f64) {
            let (word, saturated) = force_word(newtons);
            prop_assert_eq!((force(word) - newtons).abs() > 0.5 * FORCE_PER_COUNT + 1e-9, saturated);
        }

        #[test]
        fn words_stay_in_range_for_any_float(bits in any::<u64>()) {
            let value = f64::from_bits(bits);
            let scale = Scale::new(Joint::Knee, Side::Left, 1_350);
            prop_assert!(scale.command(value).0 <= 1_350);
            prop_assert!(magnetic_word(value) < 1 << 14);
            prop_assert!(force_word(value).0 < 1 << 12);
        }
    }

    proptest! {
        /// Both directions, across any number of wraps of the word and of the 32-bit counter.
        #[test]
        fn positions_are_unwrapped_over_steps_of_less_than_half_a_turn(
            start in -2_047..2_048_i64,
            steps in prop::collection::vec(-2_047..2_048_i64, 1..200),
            turns_before in -3_000_000..3_000_000_i64,
        ) {
            let scale = Scale::free();
            let (mut exact, mut found) = (start, start);
            for step in steps {
                exact += step;
                let true_counts = exact + turns_before * i64::from(TURN);
                let angle = true_counts as f64 * (TAU / f64::from(TURN));
                found = unwrapped(Scale::position_word(scale.counts(angle)), found);
                prop_assert_eq!(found, exact);
            }
        }

        #[test]
        fn speed_word_is_exact_to_half_a_unit_or_saturated(
            rate in -150.0..150.0_f64,
            most in any::<u16>(),
        ) {
            let (word, saturated) = speed_word(rate, most);
            let decoded = f64::from(speed(word));
            let exact = rate * f64::from(TURN) / TAU;
            prop_assert!(decoded.abs() <= f64::from(most));
            let unit = f64::from(SPEED_UNIT);
            prop_assert_eq!((decoded - exact).abs() > 0.5 * unit + 1e-9, saturated);
        }
    }

    #[test]
    fn speeds_of_the_tactile_bench_fit_the_word() {
        // 8 Hz, and a step of at most 0.1 % of 0.5 Hz.
        let (word, saturated) = speed_word(-8.0 * TAU, u16::MAX);
        assert_eq!((speed(word), saturated), (-8 * TURN, false));
        assert!(f64::from(SPEED_UNIT) <= 1e-3 * 0.5 * f64::from(TURN));
        assert_eq!(speed_word(f64::NAN, u16::MAX), (0, false));
    }

    #[test]
    fn joint_ranges_match_the_robot() {
        let degrees = 180.0 / core::f64::consts::PI;
        let hip = Scale::new(Joint::Hip, Side::Right, 1_200);
        assert!((hip.angle(1_200) * degrees - 52.7).abs() < 0.05);
        assert!((hip.angle(0) * degrees + 52.7).abs() < 0.05);
        let knee = Scale::new(Joint::Knee, Side::Right, 1_350);
        assert!((knee.angle(1_350) * degrees - 118.7).abs() < 0.05);
        assert_eq!(knee.command(0.0), (0, false));
    }

    #[test]
    fn left_legs_count_in_the_opposite_direction() {
        let hip = Scale::new(Joint::Hip, Side::Left, 1_200);
        assert!(hip.command(0.1).0 < 600);
        let knee = Scale::new(Joint::Knee, Side::Left, 1_350);
        assert_eq!(knee.command(0.0), (1_350, false));
        assert!(knee.command(0.1).0 < 1_350);
    }

    #[test]
    fn limit_flag_is_masked() {
        let flagged = Scale::new(Joint::Hip, Side::Right, 1_200 + 0x8000);
        assert_eq!(flagged, Scale::new(Joint::Hip, Side::Right, 1_200));
    }
}
