//! Command `twin serve`: emulation of boards and plant in real time.

use std::path::{Path, PathBuf};

use twinrig_kernel::SimDuration;
use twinrig_runtime::real_time::{EndReason, Hold, Privileges, Serve, ServeOptions, ServedWire};
use twinrig_runtime::{Device, DeviceError};
use twinrig_scenario::BusSpec;
use twinrig_wire::{NetworkAddress, PortServer, Pty};

use super::run::ports;
use super::{FAILURE, SUCCESS, Terminal, settings};
use crate::args::ServeArgs;
use crate::error::TwinError;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::assembly::builder::{BuiltParts, Bus};
use twinrig_rig::build_key::file_of_this_code;
use twinrig_rig::error::Error;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::hardware::{check_places, place};
use twinrig_rig::run::interrupt;

pub(super) fn serve(registry: &Registry, args: &ServeArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.interactive {
        crate::interrupt::listen();
    }
    match serve_twin(registry, args, terminal) {
        Ok(code) => code,
        Err(error) => {
            terminal.print_error(&error);
            FAILURE
        }
    }
}

fn serve_twin(
    registry: &Registry,
    args: &ServeArgs,
    terminal: &mut Terminal<'_>,
) -> Result<u8, TwinError> {
    let settings = settings(&args.settings);
    let assembly = Assembly::builder(registry)
        .settings(&settings)
        .file(&args.scenario)?;
    let scenario = assembly.scenario();
    terminal.warn(&scenario.warnings);
    if scenario.buses.is_empty() {
        return Err(TwinError::NothingToServe {
            file: scenario.file.clone(),
        });
    }
    let BuiltParts { buses, plant, .. } = assembly.parts()?;
    let wires = wires(&assembly, buses, args)?;
    for note in privileges(args).prepare() {
        terminal.note(&note);
    }
    for wire in &wires {
        terminal.print(&format!("{} at {}", wire.name, wire.device.place()));
    }
    terminal.print(&format!("connect with: {}", counterpart(args, &wires)));
    let _ = terminal.out.flush();
    let options = options(args, scenario.observe.period);
    let served = Serve::new(options, plant, wires);
    let served = served.map_err(|error| assembly.rig_error(error))?;
    let (ended, report) = served.run(&mut (), interrupt::hardware_flag());
    terminal.print(&report.to_string());
    match ended {
        Ok(EndReason::Duration | EndReason::Stopped | EndReason::HungUp) => Ok(SUCCESS),
        Err(error) => Err(assembly.rig_error(error).into()),
    }
}

/// Returns the privileges required for a twin with a real-time priority.
fn privileges(args: &ServeArgs) -> Privileges {
    Privileges {
        control_priority: args.priority,
        lock_memory: args.priority.is_some(),
        ..Privileges::none()
    }
}

fn options(args: &ServeArgs, observe: SimDuration) -> ServeOptions {
    ServeOptions {
        observe,
        hold: match args.hold {
            hold if hold.is_zero() => Hold::UntilFirstByte,
            hold => Hold::AfterFirstByte(hold),
        },
        until_hang_up: !args.keep,
        priority: args.priority,
        ..ServeOptions::default()
    }
}

/// Connects the emulated wire of each bus to its server if it has an address, and otherwise to a
/// PTY, with a symbolic link if one is given for the bus.
fn wires(
    assembly: &Assembly<'_>,
    buses: Vec<Bus>,
    args: &ServeArgs,
) -> Result<Vec<ServedWire>, TwinError> {
    let scenario = assembly.scenario();
    let [links, addresses] = [&args.pty, &args.listen].map(|places| ports(places));
    check_places(scenario, &[&links[..], &addresses].concat())?;
    let served = |(spec, Bus { name, wire, .. }): (&BusSpec, Bus)| {
        let device = match place(&addresses, &name) {
            Some(address) => server(address, assembly.baud(spec)?),
            None => pty(place(&links, &name)).map(|pty| Box::new(pty) as Box<dyn Device>),
        };
        match device {
            Ok(device) => Ok(ServedWire { name, wire, device }),
            Err(source) => Err(TwinError::from(Error::Device { bus: name, source })),
        }
    };
    scenario.buses.iter().zip(buses).map(served).collect()
}

fn server(address: &Path, baud: u32) -> Result<Box<dyn Device>, DeviceError> {
    let address = NetworkAddress::parse_served(&address.to_string_lossy())?;
    Ok(Box::new(PortServer::listen(&address, baud)?))
}

fn pty(link: Option<&Path>) -> Result<Pty, DeviceError> {
    let pty = Pty::open()?;
    match link {
        Some(link) => pty.linked(link),
        None => Ok(pty),
    }
}

/// Returns the name of this program, which custom programs based on this crate choose. In the
/// Python package this crate is a library, and the program is that of the package.
fn program() -> String {
    let is_library = file_of_this_code().zip(std::env::current_exe().ok());
    if is_library.is_some_and(|(code, program)| code != program) {
        return "twin".to_owned();
    }
    let path = std::env::args_os().next().map(PathBuf::from);
    let name = path.as_deref().and_then(Path::file_stem);
    name.map_or("twin".to_owned(), |name| quoted(&name.to_string_lossy()))
}

/// Returns the command that runs the controller on the served twin.
fn counterpart(args: &ServeArgs, wires: &[ServedWire]) -> String {
    let set = &args.settings.set;
    let set = set
        .iter()
        .map(|(key, value)| ("--set", format!("{key}={value}")));
    let plant = args.settings.plant.iter();
    let plant = plant.map(|plant| ("--plant", plant.clone()));
    let port = wires
        .iter()
        .map(|wire| ("--port", format!("{}={}", wire.name, wire.device.place())));
    let scenario = args.scenario.display().to_string();
    let mut command = format!("{} run {}", program(), quoted(&scenario));
    for (option, value) in plant.chain(set).chain(port) {
        command = format!("{command} {option} {}", quoted(&value));
    }
    command
}

/// Quotes a word for a shell, if necessary.
fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "/.,:=_-+@".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_with_shell_syntax_are_quoted() {
        assert_eq!(quoted("sbcp=/dev/pts/1"), "sbcp=/dev/pts/1");
        assert_eq!(quoted(r#"duration="1 s""#), r#"'duration="1 s"'"#);
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
    }
}
