//! A board at the bench, its wire, and a stage.
#![allow(dead_code, reason = "not every test uses every part")]

use twinrig_estimate::{
    ChargeAmplifier, ForceResponse, Model, Piezoresistive, Settings, StateSettings,
};
use twinrig_kernel::{
    BoardClock, HostTime, LocalDuration, Port, SimDuration, Snapshot, SnapshotError, Unit,
};
use twinrig_runtime::Rig;
use twinrig_tactile::{CHANNELS, LoadFilterConfig, Stage, Tactile, TactileSample};
use twinrig_testing::rig_harness;
use twinrig_testing::rig_harness::{RecordingPlant, rig};
use twinrig_wire::{Diagnostics, FaultKind, FaultSchedule};

/// Moving average of the reference force over four samples, times the gain that the process sets.
pub struct MovingAverage {
    name: String,
    diagnostics: [String; 2],
    window: [f64; 4],
    received: u64,
    latency: f64,
    outputs: [f64; 2],
    gain: f64,
}

impl MovingAverage {
    pub fn new(name: &str) -> Box<Self> {
        Box::new(Self {
            name: format!("bench/force/{name}"),
            diagnostics: ["received", "latency"].map(|it| format!("bench/force/{name}/{it}")),
            window: [0.0; 4],
            received: 0,
            latency: 0.0,
            outputs: [0.0; 2],
            gain: 1.0,
        })
    }
}

impl Stage for MovingAverage {
    fn ports(&self) -> Vec<Port> {
        let name = &self.name;
        vec![
            Port::output(name, Unit::Newton, 1),
            Port::input(format!("{name}/gain"), Unit::One, 1),
            Port::output(format!("{name}/time"), Unit::Second, 1),
        ]
    }

    fn handle_sample(&mut self, sample: &TactileSample) {
        self.window.rotate_left(1);
        self.window[3] = sample.reference;
        self.received += 1;
        self.latency = sample.arrived.since(sample.at).as_secs_f64();
        let mean = self.window.iter().sum::<f64>() / 4.0;
        let at = sample.at.since(HostTime::default()).as_secs_f64();
        self.outputs = [self.gain * mean, at];
    }

    fn begin_transfer(&mut self, _: HostTime, from_process: &[f64]) {
        self.gain = from_process[0];
    }

    fn outputs(&self) -> &[f64] {
        &self.outputs
    }

    fn report(&self, diagnostics: &mut Diagnostics<'_>) {
        let [received, latency] = &self.diagnostics;
        diagnostics.count(received, self.received);
        diagnostics.value(latency, Unit::Second, self.latency);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(
            self.window,
            self.received,
            self.latency,
            self.outputs,
            self.gain,
        ))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (
            self.window,
            self.received,
            self.latency,
            self.outputs,
            self.gain,
        ) = snapshot.read()?;
        Ok(())
    }
}

/// Board with an exact clock rate error, and without noise.
pub fn quiet() -> Tactile {
    Tactile {
        noise: [0.0; 3],
        clock: clock(3_210_987, 150_000),
        ..Tactile::new("tactile", "bench/force")
    }
}

pub fn clock(offset_ns: i64, rate_ppb: i64) -> BoardClock {
    BoardClock::new(LocalDuration::from_nanos(offset_ns), rate_ppb).unwrap()
}

/// 2 V/s, −12 V, 10 N/s.
pub fn signal(seconds: f64, channel: usize) -> f64 {
    [2.0 * seconds, -12.0, 10.0 * seconds][channel]
}

pub fn plant(signal: fn(f64, usize) -> f64) -> RecordingPlant {
    let units = [Unit::Volt, Unit::Volt, Unit::Newton];
    let ports = CHANNELS.iter().zip(units);
    let port = |(name, unit): (&&str, Unit)| Port::output(format!("bench/force/{name}"), unit, 1);
    RecordingPlant::new(ports.map(port).collect(), signal)
}

pub fn wired_to(config: &Tactile, faults: &FaultSchedule, signal: fn(f64, usize) -> f64) -> Rig {
    let wire = config.wire(faults).unwrap();
    rig(config.driver().unwrap(), wire, (2, |_| 0.0), plant(signal))
}

pub fn wired(config: &Tactile, faults: &FaultSchedule) -> Rig {
    wired_to(config, faults, signal)
}

pub fn staged(config: &Tactile, faults: &FaultSchedule) -> Rig {
    let driver = config.driver().unwrap();
    let driver = driver
        .with_stage(MovingAverage::new("first"))
        .with_stage(MovingAverage::new("second"));
    rig(
        driver,
        config.wire(faults).unwrap(),
        (2, |_| 3.0),
        plant(signal),
    )
}

pub fn none() -> FaultSchedule {
    FaultSchedule::default()
}

pub fn fault(kind: FaultKind, from_ms: u64, for_ms: u64) -> FaultSchedule {
    rig_harness::fault("wire/tactile", kind, from_ms, for_ms)
}

pub fn millis(millis: u64) -> SimDuration {
    SimDuration::from_millis(millis)
}

pub const STATE: StateSettings = StateSettings {
    initial: 0.0,
    variance: 1.0,
    noise: 0.0,
};

pub fn filter_of(model: Model) -> LoadFilterConfig {
    LoadFilterConfig {
        name: "estimate".to_owned(),
        signal: "bench/force".to_owned(),
        settings: Settings {
            model,
            piezoresistive: Some(Piezoresistive {
                response: ForceResponse::Linear {
                    gain: 0.2,
                    offset: 1.0,
                },
                variance: 1e-4,
            }),
            piezoelectric: Some(1e-4),
            frequency: Some(0.01),
            period_s: 1e-3,
            white: 1e8,
            recovery: None,
        },
        low_pass: None,
        ranges: [0.5..=9.9, -9.9..=9.9],
        frequency: None,
        reference: true,
    }
}

/// Filter F3.
pub fn filter() -> LoadFilterConfig {
    filter_of(Model::F3 {
        amplifier: ChargeAmplifier {
            sensitivity: -0.05,
            feedback_s: 0.1,
            lag_s: 0.005,
        },
        states: [STATE; 6],
    })
}
