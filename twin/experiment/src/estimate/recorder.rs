//! Runs of a bench for a study of load filters.

use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, channel};

use twinrig_kernel::{
    Direction, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit, signal,
};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::BuildError;
use twinrig_rig::parts::bus_kind::BusContext;
use twinrig_rig::parts::tactile;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;
use twinrig_runtime::{Change, Group, Observer, ProcessVariable, Rig, RunEvent};
use twinrig_scenario::{Scenario, Setting};
use twinrig_tactile::{Stage, TactileSample};

use crate::error::{Error, first_line};
use crate::{EstimateInput, LoadRecorder, LoadRun, LoadSample, SteadyPart};

/// Process variable whose changes divide a run into parts.
const FREQUENCY: &str = "frequency";
/// Time after a change that belongs to no part: the motor accelerates and the filters settle.
const SETTLING: SimDuration = SimDuration::from_secs(1);
/// Simulated time between two checks for an interrupt.
const SLICE: SimDuration = SimDuration::from_secs(1);

/// Runs a scenario with a tactile bus and collects every sample of its driver.
pub struct BenchRecorder<'r> {
    registry: &'r Registry,
    path: &'r Path,
    settings: Vec<Setting>,
    bus: String,
    cell: Option<u64>,
    input: EstimateInput,
}

impl<'r> BenchRecorder<'r> {
    /// Reads the scenario at `path` with `settings`.
    ///
    /// # Errors
    /// Errors of the scenario; [`Error::NotEstimable`] without a tactile bus, changes of the
    /// frequency, or a motor.
    pub fn new(
        registry: &'r Registry,
        path: &'r Path,
        settings: &[Setting],
    ) -> Result<Self, Error> {
        let assembly = Assembly::builder(registry).settings(settings).file(path)?;
        let scenario = assembly.scenario();
        let missing = |why: &str, help: &str| Error::NotEstimable {
            file: scenario.file.clone(),
            why: why.to_owned(),
            help: help.to_owned(),
        };
        let mut buses = scenario.buses.iter();
        let bus = buses.find(|bus| bus.kind == tactile::NAME).ok_or_else(|| {
            missing(
                "the scenario has no tactile bus, whose samples they filter",
                "add `[[bus]]` with `kind = \"tactile\"`, on a bench as in scenarios/bench.toml",
            )
        })?;
        let mut changes = scenario.changes.iter();
        if !changes.any(|change| change.variable == FREQUENCY) {
            return Err(missing(
                "the frequency does not change, so nothing depends on it",
                "add tables `[[change]]` with `set = \"frequency\"`, as in \
                 scenarios/thesis/fig-4-11.toml",
            ));
        }
        let rate = rate_signal(assembly.process_ports());
        let (rate, _) = rate.ok_or_else(|| {
            missing(
                "the controller turns no motor, whose frequency is that of the load",
                "take `kind = \"turn\"` in [controller]",
            )
        })?;
        let motor = signal::parse_motor(&rate).map(|(motor, _)| motor.to_owned());
        let motor = motor.unwrap_or_default();
        let input = EstimateInput {
            name: scenario.name.clone(),
            file: scenario.file.clone(),
            duration_s: scenario.duration.as_secs_f64(),
            seed: scenario.seed,
            frequency_signal: signal::of_motor(&motor, FREQUENCY),
        };
        Ok(Self {
            registry,
            path,
            settings: settings.to_vec(),
            bus: bus.name.value.clone(),
            cell: scenario.plant.options.natural("cell"),
            input,
        })
    }

    /// Number of the drawn cell of the bench, if the scenario has one.
    pub fn cell(&self) -> Option<u64> {
        self.cell
    }

    /// Runs the bench with a seed and returns every sample of the driver, with the measured
    /// frequency. `build` is called with the context of the bus, for parts that take its options.
    ///
    /// # Errors
    /// Errors of the scenario and of the run; what `build` returns.
    pub fn samples(
        &self,
        seed: u64,
        build: impl FnOnce(&BusContext<'_>) -> Result<(), BuildError>,
    ) -> Result<BenchRun, Error> {
        let mut settings = self.settings.clone();
        settings.push(Setting {
            origin: "study".to_owned(),
            key: "seed".to_owned(),
            value: seed.to_string(),
        });
        let assembly = Assembly::builder(self.registry)
            .settings(&settings)
            .file(self.path)?;
        let mut scenario = assembly.scenario().without_expectations();
        scenario.record.signals = Some(Vec::new());
        scenario.record.frames = None;
        let assembly = assembly.with_scenario(&scenario, &[])?;
        let (sender, samples) = channel();
        let mut rig = assembly.rig_with_driver(&self.bus, |context| {
            build(context)?;
            let driver = tactile::driver(context)?;
            Ok(Box::new(driver.with_stage(Box::new(Collector(sender)))))
        })?;
        let variables = rig.process().variables().iter();
        let mut frequency = variables.filter(|variable| variable.name() == FREQUENCY);
        let first = frequency.next().map_or(0.0, ProcessVariable::value);
        let mut frequencies = FrequencyObserver::of(&rig);
        let mut now = rig.now();
        while now < assembly.end() && !interrupt::is_requested() {
            now = (now + SLICE).min(assembly.end());
            rig.run_until(now, &mut frequencies)
                .map_err(|error| assembly.rig_error(error))?;
        }
        Ok(BenchRun {
            samples: frequencies.beside(&samples),
            steady: steady(&scenario, first),
        })
    }

    /// Runs the bench with a seed.
    ///
    /// # Errors
    /// Errors of the scenario and of the run.
    pub fn recorded(&self, seed: u64) -> Result<LoadRun, Error> {
        let run = self.samples(seed, |_| Ok(()))?;
        let sample = |(sample, frequency): &(TactileSample, Option<f64>)| LoadSample {
            at_ns: sample.at.as_nanos(),
            volts: sample.volts,
            reference: sample.reference,
            saturated: sample.saturated,
            frequency: *frequency,
        };
        Ok(LoadRun {
            samples: run.samples.iter().map(sample).collect(),
            steady: run.steady,
        })
    }
}

/// Samples of a run, each with the frequency measured since the one before \[Hz\].
pub struct BenchRun {
    /// Samples of the driver, with the frequency of the load.
    pub samples: Vec<(TactileSample, Option<f64>)>,
    /// Parts of constant frequency.
    pub steady: Vec<SteadyPart>,
}

impl LoadRecorder for BenchRecorder<'_> {
    fn input(&self) -> &EstimateInput {
        &self.input
    }

    fn record(&self, seed: u64) -> Result<LoadRun, String> {
        self.recorded(seed)
            .map_err(|error| first_line(&error.to_string()))
    }
}

/// Returns the parts between changes of the frequency, which is `hz` at first.
fn steady(scenario: &Scenario, mut hz: f64) -> Vec<SteadyPart> {
    let (mut parts, mut from) = (Vec::new(), SimTime::ZERO);
    let changes = scenario.changes.iter();
    let changes = changes.filter(|change| change.variable == FREQUENCY);
    let mut part = |from: SimTime, to: SimTime, hz: f64| {
        let from = from + SETTLING;
        if from < to && hz > 0.0 {
            parts.push(SteadyPart {
                hz,
                from_ns: from.as_nanos(),
                to_ns: to.as_nanos(),
            });
        }
    };
    for change in changes {
        part(from, change.at.min(scenario.end()), hz);
        from = change.at;
        hz = match change.change {
            Change::To(value) => value,
            Change::By(difference) => hz + difference,
        };
    }
    part(from, scenario.end(), hz);
    parts
}

/// Stage that passes every sample on.
struct Collector(Sender<TactileSample>);

impl Stage for Collector {
    fn ports(&self) -> Vec<Port> {
        Vec::new()
    }

    fn handle_sample(&mut self, sample: &TactileSample) {
        // A dropped receiver ends the collection; the run continues.
        let _ = self.0.send(*sample);
    }

    fn outputs(&self) -> &[f64] {
        &[]
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&())
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        snapshot.read()
    }
}

/// Returns the output that has the frequency of a motor, with its factor to Hz: the measured one,
/// otherwise the commanded rate.
fn rate_signal(ports: &[Port]) -> Option<(String, f64)> {
    let outputs = || {
        let outputs = ports.iter();
        outputs.filter(|port| port.direction == Direction::Output && port.size == 1)
    };
    let is = |port: &&Port, name: &str, unit| {
        let of_motor = signal::parse_motor(&port.name);
        of_motor.is_some_and(|(_, what)| what == name) && port.unit == unit
    };
    let measured = outputs().find(|port| is(port, FREQUENCY, Unit::Hertz));
    let commanded = || outputs().find(|port| is(port, "rate/command", Unit::RadianPerSecond));
    measured
        .map(|port| (port.name.clone(), 1.0))
        .or_else(|| commanded().map(|port| (port.name.clone(), 1.0 / std::f64::consts::TAU)))
}

/// Records the frequency of the motor at every step of the controller.
struct FrequencyObserver {
    /// Index in the outputs of the process, and factor to Hz.
    place: Option<(usize, f64)>,
    found: Vec<(SimTime, f64)>,
}

impl FrequencyObserver {
    fn of(rig: &Rig) -> Self {
        let layout: &Layout = rig.layout(Group::ProcessOutputs);
        let ports: Vec<Port> = rig.process().ports();
        let place = rate_signal(&ports).and_then(|(name, factor)| {
            let range = layout.find(&name)?;
            Some((range.start, factor))
        });
        Self {
            place,
            found: Vec::new(),
        }
    }

    /// Returns the samples, each with the frequency measured since the one before.
    fn beside(self, samples: &Receiver<TactileSample>) -> Vec<(TactileSample, Option<f64>)> {
        let mut frequencies = self.found.into_iter().peekable();
        let sample = |sample: TactileSample| {
            let at_ns = sample.at.as_nanos();
            let mut frequency = None;
            while let Some((_, hz)) = frequencies.next_if(|(at, _)| at.as_nanos() <= at_ns) {
                frequency = Some(hz);
            }
            (sample, frequency)
        };
        samples.try_iter().map(sample).collect()
    }
}

impl Observer for FrequencyObserver {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if let (Group::ProcessOutputs, Some((index, factor))) = (group, self.place) {
            let value = values.get(index).copied().unwrap_or_default();
            self.found.push((now, factor * value));
        }
    }

    fn event(&mut self, _: SimTime, _: RunEvent) {}
}
