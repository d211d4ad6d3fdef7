use std::fmt;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, Unit};

use crate::config::BoardConfig;
use crate::reply::Reply;
use crate::units::{Joint, Scale, Side, force, magnetic_angle};

/// A board as the host sees it: the leg whose signals it carries.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Leg {
    name: String,
    id: u8,
    side: Side,
    used: bool,
    scales: [Scale; 2],
    /// Last good words.
    words: Reply,
    /// Set-points that were out of range.
    pub(crate) saturated: u64,
    /// Words of magnetic encoders whose status was not good.
    pub(crate) encoder_faults: u64,
}

/// Values of a leg that the process gets: two positions, three angles, three components of force.
pub(crate) const MEASURED: usize = 8;

impl Leg {
    pub(crate) fn new(board: &BoardConfig) -> Self {
        let scale = |n: usize| Scale::new(Joint::ALL[n], board.side, board.position_limits[n]);
        Self {
            name: board.name.clone(),
            id: board.id,
            side: board.side,
            used: board.used,
            scales: [scale(0), scale(1)],
            words: Reply::default(),
            saturated: 0,
            encoder_faults: 0,
        }
    }

    pub(crate) fn is_used(&self) -> bool {
        self.used
    }

    /// Data that it brings, and commands that it takes.
    pub(crate) fn ports(&self) -> Vec<Port> {
        let name = |what: &str| format!("leg/{}/{what}", self.name);
        vec![
            Port::input(name("hip/command"), Unit::Radian, 1),
            Port::input(name("knee/command"), Unit::Radian, 1),
            Port::output(name("hip/position"), Unit::Radian, 1),
            Port::output(name("knee/position"), Unit::Radian, 1),
            Port::output(name("angles"), Unit::Radian, 3),
            Port::output(name("foot/force"), Unit::Newton, 3),
        ]
    }

    /// What the board says that the range of a motor is \[counts\].
    pub(crate) fn set_limit(&mut self, motor: usize, counts: u16) {
        self.scales[motor] = Scale::new(Joint::ALL[motor], self.side, counts);
    }

    /// The set-points for these angles \[rad\], within the range.
    pub(crate) fn goals(&mut self, angles: [f64; 2]) -> [u16; 2] {
        [0, 1].map(|motor| {
            let (word, saturated) = self.scales[motor].command(angles[motor]);
            self.saturated += u64::from(saturated);
            word
        })
    }

    /// Takes what a cycle brought; false if no board says such a thing: words of 12 bits that have more.
    pub(crate) fn take(&mut self, reply: &Reply) -> bool {
        let narrow = reply.positions.iter().chain(&reply.force);
        let plausible = narrow.clone().all(|word| *word < 1 << 12);
        if plausible {
            self.words.positions = reply.positions;
            self.words.force = reply.force;
            for n in 0..3 {
                self.take_magnetic(n, reply.magnetic[n]);
            }
        }
        plausible
    }

    /// Takes one word of a reply.
    pub(crate) fn take_word(&mut self, place: usize, word: u16) {
        match place {
            0 | 1 => self.words.positions[place] = word,
            2..=4 => self.take_magnetic(place - 2, word),
            5..=7 => self.words.force[place - 5] = word,
            _ => {}
        }
    }

    /// An encoder that is not sure is not believed.
    fn take_magnetic(&mut self, n: usize, word: u16) {
        if magnetic_angle(word).1 == 0 {
            self.words.magnetic[n] = word;
        } else {
            self.encoder_faults += 1;
        }
    }

    /// Writes what the process gets: the last good values.
    pub(crate) fn write(&self, values: &mut [f64]) {
        let Reply {
            positions,
            magnetic,
            force: counts,
        } = self.words;
        let (own, rest) = values.split_at_mut(2);
        let (angles, forces) = rest.split_at_mut(3);
        for n in 0..2 {
            own[n] = self.scales[n].position(positions[n]);
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
    fn words_that_no_board_says_are_not_believed() {
        let mut leg = Leg::new(&BoardConfig::default());
        assert!(leg.take(&GOOD));
        let before = values(&leg);
        for place in 0..2 {
            let mut reply = GOOD;
            reply.positions[place] = 4_096;
            assert!(!leg.take(&reply));
            let mut reply = GOOD;
            reply.force[place] |= 0x8000;
            assert!(!leg.take(&reply));
        }
        assert_eq!(values(&leg), before);
        assert!((before[6] - 5.0).abs() < 1e-9 && (before[7] + 5.0).abs() < 1e-9);
    }

    #[test]
    fn an_encoder_that_is_not_sure_keeps_its_last_good_angle() {
        let mut leg = Leg::new(&BoardConfig::default());
        assert!(leg.take(&GOOD));
        let before = values(&leg);
        let mut reply = GOOD;
        reply.magnetic[1] = 0x4000 + 500;
        assert!(leg.take(&reply));
        assert_eq!((values(&leg), leg.encoder_faults), (before, 1));
    }
}
