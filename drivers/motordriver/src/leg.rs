use std::fmt;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, Unit, signal};

use crate::config::BoardConfig;
use crate::reply::Reply;
use crate::units::{Joint, Scale, Side, force, magnetic_angle};

/// Host's view of a board: the leg whose signals it carries.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Leg {
    name: String,
    id: u8,
    side: Side,
    scales: [Scale; 2],
    /// Last valid words.
    words: Reply,
    /// Number of set-points that were out of range.
    pub(crate) saturated: u64,
    /// Number of words of magnetic encoders with a fault status.
    pub(crate) encoder_faults: u64,
}

/// Commands of a leg from the process: two angles.
pub(crate) const COMMANDED: usize = 2;
/// Values of a leg for the process: two positions, three angles, three force components.
pub(crate) const MEASURED: usize = 8;

impl Leg {
    pub(crate) fn new(board: &BoardConfig, side: Side) -> Self {
        let scale = |n: usize| Scale::new(Joint::ALL[n], side, board.position_limits[n]);
        Self {
            name: board.name.clone(),
            id: board.id,
            side,
            scales: [scale(0), scale(1)],
            words: Reply::default(),
            saturated: 0,
            encoder_faults: 0,
        }
    }

    /// Returns the ports of its commands and measurements.
    pub(crate) fn ports(&self) -> Vec<Port> {
        let name = |what: &str| signal::of_leg(&self.name, what);
        vec![
            Port::input(signal::command(&self.name, "hip"), Unit::Radian, 1),
            Port::input(signal::command(&self.name, "knee"), Unit::Radian, 1),
            Port::output(name(signal::HIP_POSITION), Unit::Radian, 1),
            Port::output(name(signal::KNEE_POSITION), Unit::Radian, 1),
            Port::output(name(signal::ANGLES), Unit::Radian, 3),
            Port::output(name(signal::FOOT_FORCE), Unit::Newton, 3),
        ]
    }

    /// Sets the range of a motor as reported by the board \[counts\].
    pub(crate) fn set_limit(&mut self, motor: usize, counts: u16) {
        self.scales[motor] = Scale::new(Joint::ALL[motor], self.side, counts);
    }

    /// Returns the set-points for the angles \[rad\], limited to the range.
    pub(crate) fn goals(&mut self, angles: &[f64]) -> [u16; 2] {
        [0, 1].map(|motor| {
            let (word, saturated) = self.scales[motor].command(angles[motor]);
            self.saturated += u64::from(saturated);
            word
        })
    }

    /// Stores the reply of a cycle. Returns false and stores nothing if a 12-bit word exceeds 12
    /// bits, which no board sends.
    pub(crate) fn store(&mut self, reply: &Reply) -> bool {
        let narrow = reply.positions.iter().chain(&reply.force);
        let plausible = narrow.clone().all(|word| *word < 1 << 12);
        if plausible {
            self.words.positions = reply.positions;
            self.words.force = reply.force;
            for n in 0..3 {
                self.store_magnetic(n, reply.magnetic[n]);
            }
        }
        plausible
    }

    /// Stores one word of a reply.
    pub(crate) fn store_word(&mut self, place: usize, word: u16) {
        match place {
            0 | 1 => self.words.positions[place] = word,
            2..=4 => self.store_magnetic(place - 2, word),
            5..=7 => self.words.force[place - 5] = word,
            _ => {}
        }
    }

    /// Stores the word of an encoder unless its status reports a fault.
    fn store_magnetic(&mut self, n: usize, word: u16) {
        if magnetic_angle(word).1 == 0 {
            self.words.magnetic[n] = word;
        } else {
            self.encoder_faults += 1;
        }
    }

    /// Writes the values for the process: the last valid ones.
    pub(crate) fn write(&self, values: &mut [f64]) {
        let Reply {
            positions,
            magnetic,
            force: counts,
        } = self.words;
        let (joints, rest) = values.split_at_mut(2);
        let (angles, forces) = rest.split_at_mut(3);
        for n in 0..2 {
            joints[n] = self.scales[n].position(positions[n]);
        }
        for n in 0..3 {
            angles[n] = magnetic_angle(magnetic[n]).0;
            forces[n] = force(counts[n]);
        }
    }
}

impl fmt::Display for Leg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "board {} (id {})", self.name, self.id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(leg: &Leg) -> [f64; MEASURED] {
        let mut values = [0.0; MEASURED];
        leg.write(&mut values);
        values
    }

    const GOOD: Reply = Reply {
        positions: [700, 100],
        magnetic: [10, 20, 30],
        force: [2_048, 2_148, 1_948],
    };

    #[test]
    fn implausible_words_are_rejected() {
        let mut leg = Leg::new(&BoardConfig::default(), Side::Left);
        assert!(leg.store(&GOOD));
        let before = values(&leg);
        for place in 0..2 {
            let mut reply = GOOD;
            reply.positions[place] = 4_096;
            assert!(!leg.store(&reply));
            let mut reply = GOOD;
            reply.force[place] |= 0x8000;
            assert!(!leg.store(&reply));
        }
        assert_eq!(values(&leg), before);
        assert!((before[6] - 5.0).abs() < 1e-9 && (before[7] + 5.0).abs() < 1e-9);
    }

    #[test]
    fn faulty_encoder_status_retains_last_good_angle() {
        let mut leg = Leg::new(&BoardConfig::default(), Side::Left);
        assert!(leg.store(&GOOD));
        let before = values(&leg);
        let mut reply = GOOD;
        reply.magnetic[1] = 0x4000 + 500;
        assert!(leg.store(&reply));
        assert_eq!((values(&leg), leg.encoder_faults), (before, 1));
    }
}
