//! From a scenario to a report with hardware in place of boards and plant.

use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use twinrig_kernel::SimTime;
use twinrig_runtime::real_time::{Ended, RealTimeRig};
use twinrig_runtime::{Device, Driver, Group, Observer, RunEvent};
use twinrig_scenario::BusSpec;
use twinrig_wire::SerialPort;

use crate::assembly::Assembly;
use crate::error::TwinError;
use crate::execute::{Course, Execution, judge, recorder, report};
use crate::interrupt;
use crate::progress::Progress;
use crate::report::{RealTime, Report};
use crate::watch::Watch;

/// Runs the controller of `assembly` and the drivers of its buses at the devices that `execution` names, in real time.
///
/// # Errors
/// [`TwinError`] if the run cannot begin: a bus without a device, a device that cannot be opened, a signal that no bus
/// carries. A run that begins and does not end is a report, too.
pub(crate) fn execute(assembly: &Assembly<'_>, execution: &Execution) -> Result<Report, TwinError> {
    let rig = rig(assembly, &execution.ports)?;
    for line in rig.options.privileges.prepare() {
        eprintln!("note: {line}");
    }
    let recorder = recorder(assembly, &rig, execution)?;
    let watch = Watch::new(judge(assembly, &rig), recorder);
    let (scenario, end) = (assembly.scenario(), assembly.end());
    let progress = Progress::new(&scenario.name, end.as_secs_f64(), execution.progress);
    let mut looker = Looker {
        watch,
        progress,
        reached: SimTime::ZERO,
    };
    #[expect(
        clippy::disallowed_methods,
        reason = "the report says how long it took"
    )]
    let started = Instant::now();
    let (ended, times) = rig.run(Some(scenario.duration), &mut looker, interrupt::flag());
    let wall_s = started.elapsed().as_secs_f64();
    let Looker { watch, reached, .. } = looker;
    let (reached, error) = match ended {
        Ok(Ended::Duration) if times.lost > 0 => {
            let lost = format!(
                "{} records were lost: this machine is too slow to look on",
                times.lost
            );
            (end, Some(lost))
        }
        Ok(Ended::Duration) => (end, None),
        Ok(Ended::Stopped | Ended::HungUp) => (reached, Some(format!("interrupted at {reached}"))),
        Err(error) => (reached, Some(assembly.rig_error(error).to_string())),
    };
    let course = Course {
        reached,
        wall_s,
        error,
        plant: None,
    };
    let mut report = report(assembly, execution, watch, course, None);
    report.real_time = Some(RealTime(times));
    Ok(report)
}

/// Process and drivers, each at its device.
fn rig(assembly: &Assembly<'_>, ports: &[(String, PathBuf)]) -> Result<RealTimeRig, TwinError> {
    let buses = &assembly.scenario().buses;
    for (name, _) in ports {
        if assembly.scenario().bus(name).is_none() {
            let known = buses.iter().map(|bus| bus.name.value.as_str());
            return Err(TwinError::no_such_bus(name, known));
        }
    }
    let process = assembly.process()?;
    let process_ports = process.ports();
    let mut parts: Vec<(Box<dyn Driver>, Box<dyn Device>)> = Vec::new();
    for bus in buses {
        let driver = assembly.driver(bus, &process_ports)?;
        parts.push((driver, device(assembly, bus, ports)?));
    }
    let rig = RealTimeRig::new(&assembly.schedule(), process, parts);
    let mut rig = rig.map_err(|error| assembly.rig_error(error))?;
    for (at, variable, change) in assembly.changes() {
        rig.schedule(at, variable, change)
            .map_err(|error| assembly.rig_error(error))?;
    }
    Ok(rig)
}

/// The device that a bus was given.
fn device(
    assembly: &Assembly<'_>,
    bus: &BusSpec,
    ports: &[(String, PathBuf)],
) -> Result<Box<dyn Device>, TwinError> {
    let name = &bus.name.value;
    let Some((_, path)) = ports.iter().find(|(bus, _)| bus == name) else {
        return Err(TwinError::NoPort { bus: name.clone() });
    };
    let opened = SerialPort::open(path, assembly.bus_kind(bus)?.baud());
    let port = opened.map_err(|source| TwinError::Device {
        bus: name.clone(),
        source,
    })?;
    if let Some(advice) = port.advice() {
        eprintln!("note: {advice}");
    }
    Ok(Box::new(port))
}

/// Hands everything on, and keeps the time.
struct Looker<W: Write> {
    watch: Watch<W>,
    progress: Progress,
    reached: SimTime,
}

impl<W: Write> Looker<W> {
    fn at(&mut self, now: SimTime) {
        self.reached = now;
        self.progress.at(now.as_secs_f64());
    }
}

impl<W: Write> Observer for Looker<W> {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        self.at(now);
        self.watch.samples(now, group, values);
    }
    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.at(now);
        self.watch.event(now, event);
    }
    fn bytes(&mut self, now: SimTime, lane: usize, bytes: &[u8]) {
        self.watch.bytes(now, lane, bytes);
    }
}
