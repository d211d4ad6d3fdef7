//! A plant that is an oscilloscope and a signal generator: it keeps every voltage that the boards put on, and what it lets them
//! measure says which leg and when.

use core::f64::consts::TAU;
use std::sync::{Arc, Mutex, MutexGuard};

use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{EnergyBalance, Plant, PlantFault, WorkCounts};

pub const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];
/// Radians of a count of a motor's encoder.
pub const COUNT: f64 = TAU / 4_096.0;
/// Radians of a count of a magnetic encoder.
const MAGNETIC: f64 = TAU / 16_384.0;
/// Newtons of a count of a force sensor, and its count without load.
const FORCE: (f64, f64) = (0.05, 2_048.0);
/// Volts of a unit of duty. With a proportional gain of 4 and motors that stand at count 0, the duty is the set-point \[counts\].
const DUTY: f64 = 24.0 / 32_768.0;
/// How often what the boards measure changes \[ns\].
const STAMP_NS: u64 = 250_000;
/// Values of a leg that the process gets.
pub const MEASURED: usize = 8;

/// What a board puts on its two motors from an instant on: set-points in counts, none while the bridge is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    pub from: SimTime,
    pub goals: [Option<i64>; 2],
}

/// What is seen on the scope, leg by leg.
pub type Screen = Arc<Mutex<[Vec<Shown>; 4]>>;

pub fn look(screen: &Screen) -> MutexGuard<'_, [Vec<Shown>; 4]> {
    screen.lock().unwrap()
}

pub struct Scope {
    now: SimTime,
    screen: Screen,
}

impl Scope {
    pub fn new(screen: Screen) -> Self {
        let now = SimTime::ZERO;
        Self { now, screen }
    }
}

/// A number that has nothing to do with those next to it.
pub fn scramble(a: u64, b: u64, c: u64) -> u64 {
    let mut x = a
        ^ b.wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ c.wrapping_mul(0xC2B2_AE3D_27D4_EB4F).rotate_left(31);
    for _ in 0..2 {
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    }
    x ^ (x >> 31)
}

/// Left legs count the other way; hips are at 0 in the middle of their range, knees where the leg is extended.
pub fn angle(leg: usize, joint: usize, count: i64) -> f64 {
    let left = leg.is_multiple_of(2);
    let zero = match (joint, left) {
        (0, _) => 600,
        (_, true) => 1_350,
        (_, false) => 0,
    };
    let counts = (count - zero) as f64;
    COUNT * if left { -counts } else { counts }
}

/// What a board measures at a stamp, in the order in which the process gets it.
fn measured(leg: usize, stamp: u64) -> [f64; MEASURED] {
    let words = [
        stamp & 0xFFF,
        stamp >> 12,
        scramble(stamp, leg as u64, 7) & 0xFFF,
    ];
    let force = words.map(|word| (word as f64 - FORCE.1) * FORCE.0);
    let turned = [0, 1, 2].map(|n| (scramble(stamp, leg as u64, n) % 16_001) as f64 - 8_000.0);
    let turned = turned.map(|counts| counts * MAGNETIC);
    let mut values = [0.0; MEASURED];
    values[..2].copy_from_slice(&[0, 1].map(|joint| angle(leg, joint, 0)));
    values[2..5].copy_from_slice(&turned);
    values[5..].copy_from_slice(&force);
    values
}

/// When the board of that leg measured what the process got: the beginning of the quarter of a millisecond. None if it never did.
pub fn stamp_of(leg: usize, got: &[f64]) -> Option<SimTime> {
    let word = |newtons: f64| (newtons / FORCE.0 + FORCE.1).round();
    let (low, high) = (word(got[5]), word(got[6]));
    if !(0.0..4_096.0).contains(&low) || !(0.0..4_096.0).contains(&high) {
        return None;
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "whole and within 12 bits"
    )]
    let stamp = low as u64 + ((high as u64) << 12);
    let told = measured(leg, stamp);
    let alike = got.iter().zip(told).all(|(a, b)| (a - b).abs() < 1e-7);
    alike.then(|| SimTime::from_nanos(stamp * STAMP_NS))
}

impl Plant for Scope {
    fn name(&self) -> &'static str {
        "scope"
    }

    fn ports(&self) -> Vec<Port> {
        let mut ports = Vec::new();
        for leg in LEGS {
            for joint in ["hip", "knee"] {
                let name = |what: &str| format!("leg/{leg}/{joint}/{what}");
                ports.push(Port::input(name("voltage"), Unit::Volt, 1));
                ports.push(Port::input(name("bridge"), Unit::One, 1));
                ports.push(Port::output(name("position"), Unit::Radian, 1));
            }
            ports.push(Port::output(format!("leg/{leg}/angles"), Unit::Radian, 3));
            ports.push(Port::output(
                format!("leg/{leg}/foot/force"),
                Unit::Newton,
                3,
            ));
        }
        ports
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        let mut screen = look(&self.screen);
        for (leg, (shown, held)) in screen.iter_mut().zip(inputs.chunks_exact(4)).enumerate() {
            let sign = if leg.is_multiple_of(2) { -1.0 } else { 1.0 };
            #[expect(clippy::cast_possible_truncation, reason = "a few thousand at most")]
            let counts = |volts: f64| (sign * volts / DUTY).round() as i64;
            let goals = [0, 1].map(|n| (held[2 * n + 1] != 0.0).then(|| counts(held[2 * n])));
            if shown.last().is_none_or(|last| last.goals != goals) {
                shown.push(Shown {
                    from: self.now,
                    goals,
                });
            }
        }
        self.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let stamp = self.now.as_nanos() / STAMP_NS;
        for (leg, values) in outputs.chunks_exact_mut(MEASURED).enumerate() {
            values.copy_from_slice(&measured(leg, stamp));
        }
    }

    fn energy(&self) -> EnergyBalance {
        EnergyBalance::default()
    }

    fn work(&self) -> WorkCounts {
        WorkCounts::default()
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.now)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.now = snapshot.read()?;
        Ok(())
    }
}
