//! Presets of adapters against their measurement: github.com/seeraven/arduinoLatency at 92ab2bf. A
//! host writes one byte at 115 200 bit/s every 50 ms; an Arduino sets a pin and returns the byte.
//!
//! Times are from the host's write until the pin and until the host has the byte.

use std::fmt::Write;
use std::path::Path;
use std::sync::{Arc, Mutex};

use crate::support::*;
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{Part, PlantAccess, TaskError, Wire};
use twinrig_testing::keys::check_passage;
use twinrig_wire::{FaultSchedule, Node, Piece, UsbPreset, UsbTiming, usb_device_wire};

/// 10 bits at 115 200 bit/s.
const BYTE_TIME: SimDuration = SimDuration::from_nanos(86_806);
/// Time from the end of a byte until the Arduino has set its pin and transmits. ASSUMED: interrupt,
/// main loop and `digitalWrite` at 16 MHz.
const REACTION: SimDuration = SimDuration::from_micros(7);
/// Sleep of the host's program between a read and the next write (main.cpp, "Write/read at 20 Hz").
const SLEEP: SimDuration = SimDuration::from_millis(50);
/// Timer slack of Linux, by which an idle host oversleeps (prctl(2), `PR_SET_TIMERSLACK`).
const SLACK: SimDuration = SimDuration::from_micros(50);
const ROUND_TRIPS: usize = 4_000;

/// Percentiles 1, 50 and 99 of a time \[ms\].
type Percentiles = [f64; 3];

/// Measured times until the pin, and until the byte is back.
const MEASURED: [(UsbPreset, Percentiles, Percentiles); 5] = [
    (
        UsbPreset::Uart,
        [0.099, 0.102, 0.120],
        [0.194, 0.197, 0.227],
    ),
    (
        UsbPreset::Ft232r,
        [0.147, 0.174, 0.199],
        [0.846, 0.924, 1.000],
    ),
    (
        UsbPreset::Ft232rPi3,
        [0.138, 0.166, 0.203],
        [2.060, 2.178, 2.241],
    ),
    (
        UsbPreset::Ch340,
        [0.129, 0.137, 0.189],
        [2.101, 2.179, 2.255],
    ),
    (
        UsbPreset::Atmega16u2,
        [0.131, 0.139, 0.192],
        [3.096, 3.180, 3.260],
    ),
];

/// Returns every byte, and notes when it has set its pin.
struct Arduino {
    pins: Arc<Mutex<Vec<SimTime>>>,
    tx: Vec<(SimTime, u8)>,
}

impl Part for Arduino {
    fn save(&self) -> Snapshot {
        Snapshot::of(&self.tx)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.tx = snapshot.read()?;
        Ok(())
    }
}

impl Node for Arduino {
    fn name(&self) -> &'static str {
        "arduino"
    }

    fn receive(&mut self, piece: Piece<'_>) {
        let pin = piece.last() + REACTION;
        self.pins.lock().unwrap().push(pin);
        self.tx.push((pin, piece.bytes[0]));
    }

    fn next_wake(&self) -> Option<SimTime> {
        None
    }

    fn advance(&mut self, _: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let (start, byte) = self.tx.pop()?;
        bytes.push(byte);
        Some(start)
    }
}

/// Simulates the measurement; returns both times, without the first 100 of each.
fn measure(preset: UsbPreset) -> [Percentiles; 2] {
    let pins = Arc::new(Mutex::new(Vec::new()));
    let node = Arduino {
        pins: Arc::clone(&pins),
        tx: Vec::new(),
    };
    let faults = FaultSchedule {
        seed: 1,
        ..FaultSchedule::default()
    };
    let timing = UsbTiming::preset(preset);
    let mut wire = usb_device_wire(timing, BYTE_TIME, &faults, node).unwrap();
    let (mut writes, mut reads) = (Vec::new(), Vec::new());
    let (mut now, mut bytes) = (SimTime::ZERO, Vec::new());
    for byte in (0..=u8::MAX).cycle().take(ROUND_TRIPS) {
        now = now + SLEEP + SLACK;
        wire.advance(now, &mut NoPlant).unwrap();
        wire.send(now, &[byte]);
        writes.push(now);
        while bytes.is_empty() {
            now = wire.next_wake().unwrap();
            wire.advance(now, &mut NoPlant).unwrap();
            wire.receive(&mut bytes);
        }
        assert_eq!(bytes, [byte]);
        bytes.clear();
        reads.push(now);
    }
    let pins = pins.lock().unwrap();
    [&pins[..], &reads[..]].map(|ends| {
        let times = ends.iter().zip(&writes).skip(100);
        percentiles(times.map(|(end, start)| (*end - *start).as_secs_f64() * 1e3))
    })
}

fn percentiles(times: impl Iterator<Item = f64>) -> Percentiles {
    let mut times: Vec<f64> = times.collect();
    times.sort_by(f64::total_cmp);
    [1, 50, 99].map(|percent| times[(times.len() - 1) * percent / 100])
}

#[test]
fn presets_of_adapters_agree_with_their_measurement() {
    let mut rows = String::from(
        "| preset | time | measured: p1, p50, p99 \\[ms\\] | simulated | median | spread |\n\
         |---|---|---|---|---|---|",
    );
    for (preset, pin, back) in MEASURED {
        let simulated = measure(preset);
        for (end, simulated, measured) in [("pin", simulated[0], pin), ("back", simulated[1], back)]
        {
            let spread = |of: Percentiles| of[2] - of[0];
            let median = simulated[1] / measured[1] - 1.0;
            let width = spread(simulated) / spread(measured) - 1.0;
            let list = |of: Percentiles| of.map(|time| format!("{time:.3}")).join(", ");
            let _ = write!(
                rows,
                "\n| `{}` | {end} | {} | {} | {:+.1} % | {:+.0} % |",
                preset.name(),
                list(measured),
                list(simulated),
                median * 100.0,
                width * 100.0
            );
            assert!(median.abs() < 0.05, "{preset:?} {end}: {simulated:?}");
            assert!(width.abs() < 0.25, "{preset:?} {end}: {simulated:?}");
        }
    }
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/timing.md");
    check_passage(&page, "adapters", &rows);
}
