//! `twin serve`

use std::path::PathBuf;

use twinrig_runtime::real_time::{Ended, Hold, Serve, ServeOptions, ServedWire};
use twinrig_wire::Pty;

use super::run::ports;
use super::{FINE, Terminal, WRONG, settings};
use crate::args::ServeArgs;
use crate::assembly::Assembly;
use crate::error::TwinError;
use crate::interrupt;
use crate::registry::Registry;

pub(super) fn serve(registry: &Registry, args: &ServeArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.watched {
        interrupt::listen();
    }
    match serve_twin(registry, args, terminal) {
        Ok(code) => code,
        Err(error) => {
            terminal.complain(&error);
            WRONG
        }
    }
}

fn serve_twin(
    registry: &Registry,
    args: &ServeArgs,
    terminal: &mut Terminal<'_>,
) -> Result<u8, TwinError> {
    let settings = settings(&args.settings);
    let assembly = Assembly::of_file(registry, &args.scenario, &settings)?;
    let scenario = assembly.scenario();
    let links = ports(&args.pty);
    for (name, _) in &links {
        if scenario.bus(name).is_none() {
            let known = scenario.buses.iter().map(|bus| bus.name.value.as_str());
            return Err(TwinError::no_such_bus(name, known));
        }
    }
    if scenario.buses.is_empty() {
        return Err(TwinError::NothingToServe {
            file: scenario.file.clone(),
        });
    }
    let mut wires = Vec::new();
    let mut command = format!("twin run {}", args.scenario.display());
    for (bus, wire) in assembly.wires()? {
        let pty = pty(&links, &bus)?;
        command = format!("{command} --port {bus}={}", pty.path().display());
        terminal.print(&format!("{bus} at {}", pty.path().display()));
        wires.push(ServedWire {
            name: bus,
            wire,
            device: Box::new(pty),
        });
    }
    terminal.print(&format!("now, elsewhere: {command}"));
    let _ = terminal.out.flush();
    let options = ServeOptions {
        observe: scenario.observe.period,
        hold: match args.hold {
            hold if hold.is_zero() => Hold::UntilFirstByte,
            hold => Hold::AfterFirstByte(hold),
        },
        until_hang_up: !args.keep,
        ..ServeOptions::default()
    };
    let served = Serve::new(options, assembly.wanted_plant()?, wires);
    let served = served.map_err(|error| assembly.rig_error(error))?;
    let (ended, report) = served.run(&mut (), interrupt::flag());
    terminal.print(&report.to_string());
    match ended {
        Ok(Ended::Duration | Ended::Stopped | Ended::HungUp) => Ok(FINE),
        Err(error) => Err(assembly.rig_error(error)),
    }
}

/// A PTY for a bus, at the place that was asked for.
fn pty(links: &[(String, PathBuf)], bus: &str) -> Result<Pty, TwinError> {
    let link = links.iter().find(|(name, _)| name == bus);
    let opened = Pty::open().and_then(|pty| match link {
        Some((_, path)) => pty.linked(path),
        None => Ok(pty),
    });
    opened.map_err(|source| TwinError::Device {
        bus: bus.to_owned(),
        source,
    })
}
