//! Probe plant: records all voltages applied by the boards, and provides measurements that encode
//! leg and time.

use core::f64::consts::TAU;
use std::sync::{Arc, Mutex, MutexGuard};

use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Plant, PlantFault};

pub const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];
/// Angle per count of a motor encoder \[rad\].
pub const COUNT: f64 = TAU / 4_096.0;
/// Angle per count of a magnetic encoder \[rad\].
const MAGNETIC: f64 = TAU / 16_384.0;
/// Force per count of a force sensor \[N\], and its count without load.
const FORCE: (f64, f64) = (0.05, 2_048.0);
/// Voltage per unit of duty \[V\]. With a proportional gain of 4 and motors at count 0, the duty
/// equals the set-point \[counts\].
const DUTY: f64 = 24.0 / 32_768.0;
/// Interval at which the measurements change \[ns\].
const STAMP_NS: u64 = 250_000;
/// Number of values per leg in the process inputs.
pub const MEASURED: usize = 8;

/// Set-points \[counts\] that a board applies to its two motors from a given time; `None` while the
/// bridge is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AppliedSetPoints {
    pub from: SimTime,
    pub set_points: [Option<i64>; 2],
}

/// Applied set-points by leg.
pub type SetPointLog = Arc<Mutex<[Vec<AppliedSetPoints>; 4]>>;

pub fn lock_log(log: &SetPointLog) -> MutexGuard<'_, [Vec<AppliedSetPoints>; 4]> {
    log.lock().unwrap()
}

pub struct ProbePlant {
    now: SimTime,
    log: SetPointLog,
}

impl ProbePlant {
    pub fn new(log: SetPointLog) -> Self {
        let now = SimTime::ZERO;
        Self { now, log }
    }
}

/// Returns a hash of three numbers.
pub fn hash(a: u64, b: u64, c: u64) -> u64 {
    let mut x = a
        ^ b.wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ c.wrapping_mul(0xC2B2_AE3D_27D4_EB4F).rotate_left(31);
    for _ in 0..2 {
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    }
    x ^ (x >> 31)
}

/// Converts counts to an angle: left legs count in the opposite direction; the zero of a hip is the
/// middle of its range, that of a knee the extended leg.
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

/// Measurements of a board at a time stamp, in the order of the process inputs.
fn measure(leg: usize, stamp: u64) -> [f64; MEASURED] {
    let words = [
        stamp & 0xFFF,
        stamp >> 12,
        hash(stamp, leg as u64, 7) & 0xFFF,
    ];
    let force = words.map(|word| (word as f64 - FORCE.1) * FORCE.0);
    let angles = [0, 1, 2].map(|n| (hash(stamp, leg as u64, n) % 16_001) as f64 - 8_000.0);
    let angles = angles.map(|counts| counts * MAGNETIC);
    let mut values = [0.0; MEASURED];
    values[..2].copy_from_slice(&[0, 1].map(|joint| angle(leg, joint, 0)));
    values[2..5].copy_from_slice(&angles);
    values[5..].copy_from_slice(&force);
    values
}

/// Decodes the time at which the board of a leg took `measurements`, rounded down to a
/// quarter of a millisecond; `None` if it never took them.
pub fn stamp_of(leg: usize, measurements: &[f64]) -> Option<SimTime> {
    let word = |newtons: f64| (newtons / FORCE.0 + FORCE.1).round();
    let (low, high) = (word(measurements[5]), word(measurements[6]));
    if !(0.0..4_096.0).contains(&low) || !(0.0..4_096.0).contains(&high) {
        return None;
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "whole and within 12 bits"
    )]
    let stamp = low as u64 + ((high as u64) << 12);
    let expected = measure(leg, stamp);
    let matches = measurements
        .iter()
        .zip(expected)
        .all(|(a, b)| (a - b).abs() < 1e-7);
    matches.then(|| SimTime::from_nanos(stamp * STAMP_NS))
}

impl Plant for ProbePlant {
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
        let mut log = lock_log(&self.log);
        for (leg, (applied, inputs_of_leg)) in
            log.iter_mut().zip(inputs.chunks_exact(4)).enumerate()
        {
            let sign = if leg.is_multiple_of(2) { -1.0 } else { 1.0 };
            #[expect(clippy::cast_possible_truncation, reason = "a few thousand at most")]
            let counts = |volts: f64| (sign * volts / DUTY).round() as i64;
            let set_points = [0, 1]
                .map(|n| (inputs_of_leg[2 * n + 1] != 0.0).then(|| counts(inputs_of_leg[2 * n])));
            if applied
                .last()
                .is_none_or(|last| last.set_points != set_points)
            {
                applied.push(AppliedSetPoints {
                    from: self.now,
                    set_points,
                });
            }
        }
        self.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let stamp = self.now.as_nanos() / STAMP_NS;
        for (leg, values) in outputs.chunks_exact_mut(MEASURED).enumerate() {
            values.copy_from_slice(&measure(leg, stamp));
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.now)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.now = snapshot.read()?;
        Ok(())
    }
}
