//! The commands.

mod check;
mod compare;
mod devices;
mod diff;
mod export;
mod list;
mod outputs;
mod plan;
mod replay;
mod run;
mod schema;
mod serve;
mod study;
mod together;

use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

use clap::Parser;
use serde::Serialize;
use twinrig_document::Warning;
use twinrig_runtime::caught;
use twinrig_scenario::Setting;

use crate::args::{Cli, Command, Settings};
use crate::assembly::registry::Registry;
use crate::error::TwinError;
use crate::report::paint::Paint;

/// All went well.
const FINE: u8 = 0;
/// What was asked for is not so: an expectation fails, two recordings differ.
const NOT_SO: u8 = 1;
/// It could not be found out.
const WRONG: u8 = 2;

/// Where a command talks to.
struct Terminal<'a> {
    out: &'a mut dyn Write,
    err: &'a mut dyn Write,
    paint: Paint,
    /// Whether a person is looking on, who likes to see progress.
    watched: bool,
    /// The first error of writing the answer.
    unwritten: Option<std::io::Error>,
}

impl Terminal<'_> {
    /// Prints lines that end as they should.
    fn print(&mut self, text: &str) {
        let written = writeln!(self.out, "{}", text.trim_end());
        self.note(written);
    }

    fn note(&mut self, written: std::io::Result<()>) {
        if let Err(error) = written {
            self.unwritten.get_or_insert(error);
        }
    }

    /// The exit code of a command that came to `code`, once all it printed is written. An answer that could not be written is an
    /// error; a reader that closed the pipe has seen enough.
    fn finish(&mut self, code: u8) -> u8 {
        let flushed = self.out.flush();
        self.note(flushed);
        match self.unwritten.take() {
            Some(error) if error.kind() != ErrorKind::BrokenPipe => {
                let _ = writeln!(self.err, "error: cannot write to standard output: {error}");
                WRONG
            }
            _ => code,
        }
    }

    fn print_json(&mut self, value: &impl Serialize) {
        // Nothing that is printed has keys that are no texts.
        let text = serde_json::to_string(value).unwrap_or_default();
        self.print(&text);
    }

    /// Says why there is no answer: where the answer would be, for a program, and otherwise to the person.
    fn fail(&mut self, error: &TwinError, json: bool) {
        #[derive(Serialize)]
        struct Failure {
            error: String,
        }
        if json {
            let error = error.to_string();
            self.print_json(&Failure { error });
        } else {
            self.complain(error);
        }
    }

    fn complain(&mut self, error: &TwinError) {
        let _ = writeln!(self.err, "{error}");
    }

    /// Shows warnings to the person; programs find them in the report.
    fn warn<'w>(&mut self, warnings: impl IntoIterator<Item = &'w Warning>) {
        for warning in warnings {
            let _ = writeln!(self.err, "{warning}\n");
        }
    }

    /// Says beside the answer what it does not cover.
    fn remark(&mut self, text: &str) {
        let _ = writeln!(self.err, "note: {text}");
    }
}

/// The program: reads the command line, does what it says, and gives the exit code: 0 all expectations hold, 1 one fails,
/// 2 something is wrong.
#[expect(
    clippy::needless_pass_by_value,
    reason = "a `main` has no further use for it"
)]
pub fn run(registry: Registry) -> ExitCode {
    let mut terminal = Terminal {
        out: &mut std::io::stdout(),
        err: &mut std::io::stderr(),
        paint: Paint::of(&std::io::stdout()),
        watched: true,
        unwritten: None,
    };
    match Cli::try_parse() {
        Ok(cli) => dispatch(&registry, cli, &mut terminal).into(),
        Err(error) => {
            let printed = error.print();
            no_command(&error, printed, &mut terminal).into()
        }
    }
}

/// The same for tests: with the words of a command line behind the name of the program, and without colour, progress and
/// Ctrl-C.
pub fn run_with(
    registry: &Registry,
    words: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> u8 {
    let mut terminal = Terminal {
        out,
        err,
        paint: Paint::PLAIN,
        watched: false,
        unwritten: None,
    };
    let name = std::iter::once(OsString::from("twin"));
    match Cli::try_parse_from(name.chain(words.into_iter().map(Into::into))) {
        Ok(cli) => dispatch(registry, cli, &mut terminal),
        Err(error) => {
            let text = error.render().to_string();
            let stream = if error.use_stderr() {
                &mut terminal.err
            } else {
                &mut terminal.out
            };
            let printed = write!(stream, "{text}");
            no_command(&error, printed, &mut terminal)
        }
    }
}

/// The exit code if there is no command to do. Help and version are no errors, unless they are not written.
fn no_command(
    error: &clap::Error,
    printed: std::io::Result<()>,
    terminal: &mut Terminal<'_>,
) -> u8 {
    if error.use_stderr() {
        return WRONG;
    }
    terminal.note(printed);
    terminal.finish(FINE)
}

/// Does what the command line says. A panic that no run of a scenario and no row of a study was there to catch is an error of
/// the whole command.
fn dispatch(registry: &Registry, cli: Cli, terminal: &mut Terminal<'_>) -> u8 {
    let json = cli.command.json();
    let done = caught(|| command(registry, cli.command, terminal));
    let code = done.unwrap_or_else(|source| {
        let file = String::new();
        terminal.fail(&TwinError::Panic { file, source }, json);
        WRONG
    });
    terminal.finish(code)
}

fn command(registry: &Registry, command: Command, terminal: &mut Terminal<'_>) -> u8 {
    match command {
        Command::Run(args) => run::run(registry, &args, terminal),
        Command::Plan(args) => plan::plan(registry, &args, terminal),
        Command::Check(args) => check::check(registry, &args, terminal),
        Command::List(args) => list::list(registry, &args, terminal),
        Command::Diff(args) => diff::diff(&args, terminal),
        Command::Replay(args) => replay::replay(registry, &args, terminal),
        Command::Serve(args) => serve::serve(registry, &args, terminal),
        Command::Devices(args) => devices::devices(&args, terminal),
        Command::Study(args) => study::study(registry, &args, terminal),
        Command::Export(args) => export::export(&args, terminal),
        Command::Schema(args) => schema::schema(registry, &args, terminal),
    }
}

/// Where the setting of a plant comes from.
const PLANT: &str = "--plant";

/// What the command line sets on top of a scenario.
fn settings(args: &Settings) -> Vec<Setting> {
    let plant = args.plant.iter().map(|model| Setting {
        origin: PLANT.to_owned(),
        key: "plant.model".to_owned(),
        value: format!("{model:?}"),
    });
    let set = args.set.iter().map(|(key, value)| Setting {
        origin: "--set".to_owned(),
        key: key.clone(),
        value: value.clone(),
    });
    plant.chain(set).collect()
}
