//! Cost of a sample of 70 numbers: fingerprint, recording, both.

use divan::Bencher;
use twinrig_kernel::{Direction, Layout, Port, SimTime, Unit};
use twinrig_record::{
    Cadence, Fingerprint, RecordedGroup, Recorder, RunInfo, Skeleton, SkeletonLeg,
};
use twinrig_runtime::Group;

fn main() {
    divan::main();
}

/// Observed plant signals of a trotting robot: 70 numbers.
fn ports() -> Vec<Port> {
    let mut ports = vec![
        Port::output("body/position", Unit::Meter, 3),
        Port::output("body/orientation", Unit::One, 4),
        Port::output("body/velocity", Unit::MeterPerSecond, 3),
    ];
    for leg in ["LF", "RF", "LH", "RH"] {
        ports.push(Port::output(format!("leg/{leg}/angles"), Unit::Radian, 3));
        ports.push(Port::output(
            format!("leg/{leg}/foot/position"),
            Unit::Meter,
            3,
        ));
        ports.push(Port::output(
            format!("leg/{leg}/foot/velocity"),
            Unit::MeterPerSecond,
            3,
        ));
        ports.push(Port::output(
            format!("leg/{leg}/foot/force"),
            Unit::Newton,
            3,
        ));
        for name in ["hip/position", "hip/torque", "foot/load"] {
            ports.push(Port::output(format!("leg/{leg}/{name}"), Unit::One, 1));
        }
    }
    ports
}

fn skeleton() -> Skeleton {
    let leg = |name: &str| SkeletonLeg {
        name: name.to_owned(),
        hip: [0.1, 0.05, 0.0],
        segments: [0.044, 0.071, 0.039],
        reference: [0.0; 3],
        abduction: None,
    };
    Skeleton {
        legs: ["LF", "RF", "LH", "RH"].map(leg).to_vec(),
    }
}

/// One simulated second with a sample every 2 ms.
const SAMPLES: u64 = 500;

fn samples(width: usize) -> Vec<Vec<f64>> {
    (0..SAMPLES)
        .map(|step| {
            (0..width)
                .map(|n| libm::sin((step * 7) as f64 * 1e-3 + n as f64))
                .collect()
        })
        .collect()
}

#[divan::bench(args = [64, 70, 140])]
fn fingerprint_500_samples(bencher: Bencher, width: usize) {
    let samples = samples(width);
    let mut fingerprint = Fingerprint::new();
    bencher.bench_local(|| {
        for (step, values) in samples.iter().enumerate() {
            fingerprint.sample(step as u64 * 2_000_000, 0, divan::black_box(values));
        }
    });
    divan::black_box(fingerprint.digest());
}

#[divan::bench(args = [false, true])]
fn record_500_samples(bencher: Bencher, frames: bool) {
    record(bencher, frames, false);
}

#[divan::bench]
fn record_and_fingerprint_500_samples(bencher: Bencher) {
    record(bencher, true, true);
}

fn record(bencher: Bencher, frames: bool, hash: bool) {
    let layout = Layout::of(&ports(), Direction::Output);
    let samples = samples(layout.len());
    let cadence = Cadence {
        frames: Cadence::default().frames.filter(|_| frames),
        ..Cadence::default()
    };
    let group = RecordedGroup {
        group: Group::Plant,
        layout: &layout,
        keep: &|_| true,
    };
    let file = std::env::temp_dir().join("twinrig-record-bench.mcap");
    let mut recorder = Recorder::create(&file, &RunInfo::default(), &[group], &skeleton(), cadence)
        .expect("temp file");
    let mut fingerprint = Fingerprint::new();
    let mut now = 0;
    bencher.bench_local(|| {
        for values in &samples {
            now += 2_000_000;
            if hash {
                fingerprint.sample(now, 0, divan::black_box(values));
            }
            recorder.sample(
                SimTime::from_nanos(now),
                Group::Plant,
                divan::black_box(values),
            );
        }
    });
    recorder
        .finish(fingerprint.digest(), SimTime::from_nanos(now))
        .expect("temp file");
}
