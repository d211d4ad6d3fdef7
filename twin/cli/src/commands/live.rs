//! Command `twin live`: a run that visitors watch and steer.

use twinrig_rig::registry::Registry;

use super::{FAILURE, SUCCESS, Terminal};
use crate::args::LiveArgs;
use crate::error::TwinError;

pub(super) fn live(registry: &Registry, args: &LiveArgs, terminal: &mut Terminal<'_>) -> u8 {
    match serve(registry, args, terminal) {
        Ok(()) => SUCCESS,
        Err(error) => {
            terminal.report_error(&error, args.json);
            FAILURE
        }
    }
}

#[cfg(not(feature = "live"))]
fn serve(_: &Registry, _: &LiveArgs, _: &mut Terminal<'_>) -> Result<(), TwinError> {
    Err(TwinError::MissingFeature {
        what: "serve visitors of a run",
        feature: "live",
    })
}

#[cfg(feature = "live")]
fn serve(
    registry: &Registry,
    args: &LiveArgs,
    terminal: &mut Terminal<'_>,
) -> Result<(), TwinError> {
    use twinrig_live::server::{Options, Server};
    use twinrig_rig::assembly::Assembly;

    crate::interrupt::listen();
    let settings = super::settings(&args.settings);
    let assembly = Assembly::builder(registry)
        .settings(&settings)
        .file(&args.scenario)?;
    terminal.warn(&assembly.scenario().warnings);
    let options = Options {
        host: args.listen.clone(),
        ports: [args.port, args.page],
        folder: args.out.clone(),
        memory: usize::from(args.memory) << 20,
        speed: args.speed,
        paused: args.paused,
    };
    let mut server = Server::new(&assembly, &options)?;
    let places = server.places();
    if args.json {
        terminal.print_json(&serde_json::json!({
            "socket": format!("ws://{}", places.socket),
            "page": format!("http://{}/", places.page),
        }));
    } else {
        terminal.print(&format!(
            "page     http://{}/\nFoxglove ws://{}",
            places.page, places.socket
        ));
        if !places.socket.ip().is_loopback() {
            terminal.note("anyone who reaches this address can steer the run");
        }
        terminal.note("Ctrl-C ends it");
    }
    let _ = terminal.out.flush();
    server.run(&mut |text| {
        terminal.note(text);
    });
    let control = server.control();
    for (number, branch) in control.session().branches().iter().enumerate() {
        if !branch.acts.is_empty() {
            terminal.print(&format!("twin run {}", control.path(number).display()));
        }
    }
    Ok(())
}
