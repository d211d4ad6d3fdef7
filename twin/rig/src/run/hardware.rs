//! Runs on hardware: real boards and a real robot replace the emulated boards and the plant.

use std::io::Write;
use std::path::{Path, PathBuf};

use twinrig_kernel::{Port, SimTime};
use twinrig_runtime::real_time::{EndReason, RealTimeReport, RealTimeRig, Steering};
use twinrig_runtime::{Device, DeviceError, Driver, Group, Observer, RigError, RunEvent};
use twinrig_scenario::{BusSpec, Scenario};
use twinrig_wire::{NetworkAddress, RemotePort, SerialPort};

use crate::assembly::Assembly;
use crate::assembly::builder::{BuiltParts, Bus};
use crate::error::Error;
use crate::parts::output_filter::OutputFilter;
use crate::report::{RealTime, Report, Status};
use crate::run::course::Course;
use crate::run::execution::Execution;
use crate::run::interrupt;
use crate::run::judging::{judge, report, tracking};
use crate::run::observers::{RunObserver, RunObservers, RunProgress};
use crate::run::recording::recorder;
use crate::run::stopwatch::Stopwatch;
use twinrig_kernel::signal::folded;

/// A run on hardware that can begin: its devices are open.
pub struct HardwareRun<'a> {
    assembly: &'a Assembly<'a>,
    execution: Execution,
    rig: RealTimeRig,
    /// Impairments of the timing, with remedies.
    notes: Vec<String>,
}

impl<'a> HardwareRun<'a> {
    /// Builds the controller of `assembly` and the drivers of its buses, on the devices given in
    /// `execution`.
    ///
    /// # Errors
    /// [`Error`]: a bus without a device, a device that cannot be opened, a signal that no bus
    /// carries.
    pub fn new(assembly: &'a Assembly<'a>, execution: Execution) -> Result<Self, Error> {
        if assembly.scenario().ensemble.is_some() {
            return Err(Error::InvalidOptions {
                why: "an `ensemble` has no runs on hardware".to_owned(),
                help: "remove `ensemble` from the scenario, or run without --port".to_owned(),
            });
        }
        let (rig, notes) = prepare(assembly, &execution.ports)?;
        Ok(Self {
            assembly,
            execution,
            rig,
            notes,
        })
    }

    /// Returns the rig, for its layouts, names and variables.
    pub fn rig(&self) -> &RealTimeRig {
        &self.rig
    }

    /// Returns the sending end of changes made while the run goes on, in place of an earlier one.
    pub fn steering(&mut self) -> Steering {
        self.rig.steering()
    }

    /// Runs in real time.
    ///
    /// # Errors
    /// [`Error`] if the recording cannot be created. A run that starts and fails is reported in the
    /// [`Report`].
    pub fn run(self, caller: &mut dyn RunObserver) -> Result<Report, Error> {
        let Self {
            assembly,
            execution,
            rig,
            mut notes,
        } = self;
        let recorder = recorder(assembly, &rig, &execution)?;
        let scenario = assembly.scenario();
        for note in &notes {
            caller.note(note);
        }
        let mut observer = TimingObserver {
            observers: RunObservers::new(judge(assembly, &rig), recorder)
                .with_tracking(tracking(assembly, &rig))
                .with_tasks(&rig)
                .with_caller(Some(caller), &rig),
            progress: RunProgress {
                title: &scenario.name,
                now: SimTime::ZERO,
                end: assembly.end(),
            },
        };
        let stopwatch = Stopwatch::start();
        let (ended, times) = rig.run(
            Some(scenario.duration),
            &mut observer,
            interrupt::hardware_flag(),
        );
        let wall_s = stopwatch.elapsed_s();
        let TimingObserver {
            observers,
            progress: RunProgress { now: reached, .. },
        } = observer;
        let (reached, error) = match ended {
            Ok(EndReason::Duration) => (assembly.end(), too_slow(&times)),
            Ok(EndReason::Stopped | EndReason::HungUp) => {
                (reached, Some(interrupt::message(reached)))
            }
            Err(error) => (reached, Some(failure(assembly, &execution.ports, error))),
        };
        let course = Course {
            reached,
            wall_s,
            error,
            simulated: false,
            plant: None,
            buses: times.buses.clone(),
            limits: Vec::new(),
        };
        let mut report = report(assembly, &execution, observers, course);
        if report.verdict != Status::Pass {
            notes.extend(lateness(&times));
        }
        report.real_time = Some(RealTime { times, notes });
        Ok(report)
    }
}

/// Returns the error of a completed run with lost records, which makes its results invalid.
fn too_slow(times: &RealTimeReport) -> Option<String> {
    let lost = times.lost;
    (lost > 0)
        .then(|| format!("{lost} records were lost: this machine is too slow to observe the run"))
}

/// Returns a note for a failed run in which the machine may be at fault: control steps were missed,
/// or transfers lasted beyond a control step.
fn lateness(times: &RealTimeReport) -> Option<String> {
    let missed = times.overruns + times.overslept;
    let mut late: Vec<String> = (missed > 0)
        .then(|| format!("{missed} control steps were missed"))
        .into_iter()
        .collect();
    late.extend(
        times
            .tasks
            .iter()
            .filter(|task| task.skipped > 0)
            .map(|task| {
                let (name, skipped) = (&task.name, task.skipped);
                let longest = task.took.longest();
                format!("`{name}` was busy at {skipped} control steps, for up to {longest:.1?}")
            }),
    );
    (!late.is_empty()).then(|| {
        format!(
            "this machine or its port was late: {}; {DOCTOR}, and a longer controller.period \
             tolerates more",
            late.join(", ")
        )
    })
}

/// Remedy for a machine that is too late for a run on hardware.
const DOCTOR: &str =
    "`twin doctor` checks real-time priority, latency timers and permissions of ports";

/// Returns the message of the error that ended a run, with the device.
fn failure(assembly: &Assembly<'_>, ports: &[(String, PathBuf)], error: RigError) -> String {
    let bus = match &error {
        RigError::Task { task, .. } => Some(task.clone()),
        _ => None,
    };
    let mut text = assembly.rig_error(error).to_string();
    if let Some(bus) = bus
        && let Some(device) = place(ports, &bus)
    {
        let device = device.display().to_string();
        if !text.contains(&device) {
            text = format!("{text}\n  = note: `{bus}` is at {device}");
        }
        text = format!("{text}\n  = help: {DOCTOR}");
    }
    text
}

/// Number of control periods that a transfer may last, if they are longer than the default limit: a
/// slow controller is in no hurry.
const TRANSFER_PERIODS_MAX: u64 = 100;

/// Builds the process and the drivers and opens their devices; also returns the impairments of the
/// timing, with remedies.
fn prepare(
    assembly: &Assembly<'_>,
    ports: &[(String, PathBuf)],
) -> Result<(RealTimeRig, Vec<String>), Error> {
    check_places(assembly.scenario(), ports)?;
    let BuiltParts { process, buses, .. } = assembly.parts()?;
    let mut notes = Vec::new();
    let mut parts: Vec<(Box<dyn Driver>, Box<dyn Device>)> = Vec::new();
    for (bus, Bus { driver, .. }) in assembly.scenario().buses.iter().zip(buses) {
        let (device, advice) = open(assembly, bus, ports)?;
        notes.extend(advice);
        parts.push((driver, device));
    }
    notes.extend(unapplied_sensors(assembly));
    let carried: Vec<Port> = parts
        .iter()
        .flat_map(|(driver, _)| driver.ports())
        .collect();
    let (process, removed) =
        OutputFilter::new(process, |port| carried.iter().any(|it| it.connects(port)));
    if !removed.is_empty() {
        let removed = folded_list(assembly, &removed);
        notes.push(format!(
            "no bus carries {removed}: the commands are discarded"
        ));
    }
    let rig = RealTimeRig::new(&assembly.schedule(), Box::new(process), parts);
    let mut rig = rig.map_err(|error| assembly.rig_error(error))?;
    for (at, variable, change) in assembly.changes() {
        rig.schedule(at, variable, change)
            .map_err(|error| assembly.rig_error(error))?;
    }
    let transfer_max = rig.period() * TRANSFER_PERIODS_MAX;
    let limits = &mut rig.options.limits;
    limits.transfer = limits.transfer.max(transfer_max);
    notes.extend(rig.options.privileges.prepare());
    Ok((rig, notes))
}

/// Returns a note on the modelled sensors, in whose place the robot has real ones: their readings
/// have errors of their own.
fn unapplied_sensors(assembly: &Assembly<'_>) -> Option<String> {
    let signals: Vec<&str> = assembly.sensors().map(|(_, signal, _)| signal).collect();
    let list = folded_list(assembly, &signals);
    (!signals.is_empty())
        .then(|| format!("[[sensor]] of {list} is not applied: the robot has real sensors"))
}

/// Returns a list of signals, with those merged that differ in the leg only.
fn folded_list(assembly: &Assembly<'_>, signals: &[impl AsRef<str>]) -> String {
    let legs = assembly.leg_names();
    let signals = signals.iter();
    let mut names: Vec<String> = signals.map(|name| folded(name.as_ref(), &legs)).collect();
    names.sort();
    names.dedup();
    names.join(", ")
}

/// Opens the device of a bus; also returns an impairment of its timing, with a remedy.
fn open(
    assembly: &Assembly<'_>,
    bus: &BusSpec,
    ports: &[(String, PathBuf)],
) -> Result<(Box<dyn Device>, Option<String>), Error> {
    let name = &bus.name.value;
    let path = place(ports, name).ok_or_else(|| Error::NoPort { bus: name.clone() })?;
    let opened = open_at(path, assembly.baud(bus)?);
    opened.map_err(|source| Error::Device {
        bus: name.clone(),
        source,
    })
}

/// Opens a port of this machine by its path, or one over a network by its address.
fn open_at(path: &Path, baud: u32) -> Result<(Box<dyn Device>, Option<String>), DeviceError> {
    if let Some(address) = path.to_str().and_then(NetworkAddress::parse) {
        return Ok((Box::new(RemotePort::open(&address?, baud)?), None));
    }
    let port = SerialPort::open(path, baud)?;
    let advice = port.advice();
    Ok((Box::new(port), advice))
}

/// Returns the place assigned to a bus: the path of a device or of a link to a PTY, or an address
/// of a network.
pub fn place<'g>(places: &'g [(String, PathBuf)], bus: &str) -> Option<&'g Path> {
    let mut places = places.iter();
    places
        .find(|(name, _)| name == bus)
        .map(|(_, place)| place.as_path())
}

/// Checks that places are assigned to existing buses only, and to each at most once.
///
/// # Errors
/// The first bus without that.
pub fn check_places(scenario: &Scenario, places: &[(String, PathBuf)]) -> Result<(), Error> {
    for (n, (bus, second)) in places.iter().enumerate() {
        if scenario.bus(bus).is_none() {
            let known = scenario.buses.iter().map(|bus| bus.name.value.as_str());
            return Err(Error::no_such_bus(bus, known));
        }
        if let Some(first) = place(&places[..n], bus) {
            let source = DeviceError::Other {
                place: second.display().to_string(),
                why: format!("the bus is assigned to {} already", first.display()),
            };
            let bus = bus.clone();
            return Err(Error::Device { bus, source });
        }
    }
    Ok(())
}

/// Forwards observations and stores the time of the last one.
struct TimingObserver<'a, W: Write> {
    observers: RunObservers<'a, W>,
    progress: RunProgress<'a>,
}

impl<W: Write> TimingObserver<'_, W> {
    fn at(&mut self, now: SimTime) {
        self.progress.now = now;
        self.observers.poll(&self.progress);
    }
}

impl<W: Write> Observer for TimingObserver<'_, W> {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        self.at(now);
        self.observers.samples(now, group, values);
    }
    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.at(now);
        self.observers.event(now, event);
    }
    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        self.observers.bytes(now, trace, bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::Registry;

    #[test]
    fn modelled_sensors_are_noted() {
        let registry = Registry::standard();
        let note = |file: &str| {
            let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
            let assembly = Assembly::builder(&registry).file(&scenarios.join(file));
            unapplied_sensors(&assembly.unwrap_or_else(|error| panic!("{error}")))
        };
        let noisy = note("tegotae-noisy.toml").unwrap();
        assert!(noisy.contains("[[sensor]] of leg/*/foot/load"), "{noisy}");
        assert_eq!(note("tegotae.toml"), None);
    }
}
