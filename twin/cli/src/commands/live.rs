//! Command `twin live`: a run that visitors watch and steer.

use twinrig_rig::registry::Registry;

use super::{FAILURE, Terminal};
use crate::args::LiveArgs;

pub(super) fn live(registry: &Registry, args: &LiveArgs, terminal: &mut Terminal<'_>) -> u8 {
    serve(registry, args, terminal).unwrap_or_else(|error| {
        terminal.report_error(&error, args.json);
        FAILURE
    })
}

#[cfg(not(feature = "live"))]
fn serve(_: &Registry, _: &LiveArgs, _: &mut Terminal<'_>) -> Result<u8, crate::error::TwinError> {
    Err(crate::error::TwinError::MissingFeature {
        what: "serve visitors of a run",
        feature: "live",
    })
}

#[cfg(feature = "live")]
use served::serve;

#[cfg(feature = "live")]
mod served {
    use serde_json::json;
    use twinrig_live::server::{HardwareServer, Options, Places, Server};
    use twinrig_rig::Execution;
    use twinrig_rig::assembly::Assembly;
    use twinrig_rig::registry::Registry;

    use crate::args::LiveArgs;
    use crate::commands::run::ports;
    use crate::commands::{SUCCESS, Terminal, settings};
    use crate::error::TwinError;
    use crate::report::table;

    pub(super) fn serve(
        registry: &Registry,
        args: &LiveArgs,
        terminal: &mut Terminal<'_>,
    ) -> Result<u8, TwinError> {
        crate::interrupt::listen();
        let settings = settings(&args.settings);
        let assembly = Assembly::builder(registry)
            .settings(&settings)
            .file(&args.scenario)?;
        terminal.warn(&assembly.scenario().warnings);
        let options = Options {
            host: args.listen.clone(),
            ports: [args.socket, args.page],
            folder: args.out.clone(),
            memory: usize::from(args.memory) << 20,
            speed: args.speed,
            paused: args.paused,
        };
        if args.port.is_empty() {
            simulated(&assembly, &options, args, terminal)
        } else {
            on_hardware(&assembly, &options, args, terminal)
        }
    }

    fn simulated(
        assembly: &Assembly<'_>,
        options: &Options,
        args: &LiveArgs,
        terminal: &mut Terminal<'_>,
    ) -> Result<u8, TwinError> {
        let mut server = Server::new(assembly, options)?;
        print_places(server.places(), args, terminal);
        server.run(&mut |text| terminal.note(text));
        let control = server.control();
        for (number, branch) in control.session().branches().iter().enumerate() {
            if !branch.acts.is_empty() {
                terminal.print(&format!("twin run {}", control.path(number).display()));
            }
        }
        Ok(SUCCESS)
    }

    fn on_hardware(
        assembly: &Assembly<'_>,
        options: &Options,
        args: &LiveArgs,
        terminal: &mut Terminal<'_>,
    ) -> Result<u8, TwinError> {
        let execution = Execution {
            ports: ports(&args.port),
            ..Execution::default()
        };
        let server = HardwareServer::new(assembly, execution, options)?;
        print_places(server.places(), args, terminal);
        let report = server.run(&mut |text| terminal.note(text))?;
        if args.json {
            terminal.print_json(&report);
        } else {
            terminal.print(&table::report(&report));
        }
        Ok(report.verdict.exit_code())
    }

    fn print_places(places: Places, args: &LiveArgs, terminal: &mut Terminal<'_>) {
        let (socket, page) = (places.socket, places.page);
        if args.json {
            terminal.print_json(&json!({
                "socket": format!("ws://{socket}"),
                "page": format!("http://{page}/"),
            }));
        } else {
            terminal.print(&format!("page     http://{page}/\nFoxglove ws://{socket}"));
            if !socket.ip().is_loopback() {
                terminal.note("anyone who reaches this address can steer the run");
            }
            terminal.note("Ctrl-C ends it");
        }
        let _ = terminal.out.flush();
    }
}
