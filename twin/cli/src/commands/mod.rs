//! Commands of the program and their common parts.

mod accept;
mod baseline;
mod cell;
mod check;
mod compare;
mod completions;
mod devices;
mod diff;
mod doctor;
mod draw;
mod examples;
mod export;
mod fit;
mod import;
mod list;
mod live;
mod new;
mod optimize;
mod outputs;
mod plan;
mod plant_comparison;
mod replay;
mod report;
mod reproduction;
mod run;
mod schema;
mod serve;
mod settings;
mod source;
mod study;
mod sweep;
mod terminal;
mod thesis;

pub use plan::plan_json;
pub use run::recording_path;

use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::process::ExitCode;

use anstream::{AutoStream, ColorChoice};
use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, FromArgMatches};
use twinrig_document::nearest;
use twinrig_runtime::catch_panic;

use crate::args::{Cli, Command};
use crate::error::TwinError;
use crate::version::PROFILE;
use settings::{PLANT_KEY, settings};
use terminal::{FAILURE, NEGATIVE, SUCCESS, Terminal};
use twinrig_report::text::width::{columns, error_columns, fit};
use twinrig_rig::error::Error;
use twinrig_rig::registry::Registry;

/// Notice of a debug build. Measured, in processor time of release builds: bench 44, oncilla-trot
/// 69, trot 79.
const DEBUG_BUILD: &str = "this is a debug build, in which runs take 40 to 80 times as long as \
                           with --release";

/// Runs the program: parses the command line, executes the command and returns the exit code: 0 all
/// expectations hold, 1 an expectation fails, 2 error.
#[expect(
    clippy::needless_pass_by_value,
    reason = "`main` does not use the registry afterwards"
)]
pub fn run(registry: Registry) -> ExitCode {
    run_args(&registry, std::env::args_os().skip(1)).into()
}

/// Runs the program as [`run`] does with the given command-line arguments, without the program's
/// name, and returns the exit code: for programs whose command line begins elsewhere.
pub fn run_args(
    registry: &Registry,
    arguments: impl IntoIterator<Item = impl Into<OsString>>,
) -> u8 {
    let words: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let mut terminal = Terminal {
        out: &mut std::io::stdout(),
        err: &mut std::io::stderr(),
        styles: AutoStream::choice(&std::io::stdout()) != ColorChoice::Never,
        columns: columns(),
        err_columns: error_columns(),
        interactive: true,
        write_error: None,
        command: reproduction::command(&words),
    };
    match parse(words, terminal.columns) {
        Ok(cli) => dispatch(registry, cli, &mut terminal),
        Err(error) => {
            let text = error.render().ansi().to_string();
            let fitted = |columns: Option<usize>| match columns {
                Some(columns) => fit(&text, columns),
                None => text.clone(),
            };
            let printed = if error.use_stderr() {
                write!(anstream::stderr(), "{}", fitted(terminal.err_columns))
            } else {
                write!(anstream::stdout(), "{}", fitted(terminal.columns))
            };
            no_command(&error, printed, &mut terminal)
        }
    }
}

/// Parses command-line arguments. Help, which fits `columns`, and messages call the program `twin`.
fn parse(arguments: Vec<OsString>, columns: Option<usize>) -> Result<Cli, clap::Error> {
    let name = std::iter::once(OsString::from("twin"));
    let words = name.chain(arguments);
    // 0: no limit.
    let command = Cli::command().term_width(columns.unwrap_or(0));
    let matches = command.try_get_matches_from(words);
    let parsed = matches.and_then(|matches| Cli::from_arg_matches(&matches));
    parsed.map_err(with_suggestion)
}

/// Sets the nearest command in the error of an unknown one: clap's measure of likeness has none for
/// short words with transposed letters, and several for others.
fn with_suggestion(mut error: clap::Error) -> clap::Error {
    let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidSubcommand) else {
        return error;
    };
    let commands = Cli::command();
    let names = commands.get_subcommands().map(clap::Command::get_name);
    if let Some(near) = nearest(word, names) {
        let near = ContextValue::Strings(vec![near.to_owned()]);
        error.insert(ContextKind::SuggestedSubcommand, near);
    }
    error
}

/// Runs the program with the given command-line arguments and output streams, for tests: without
/// colours, progress line and interrupt handler.
pub fn run_with(
    registry: &Registry,
    words: impl IntoIterator<Item = impl Into<OsString>>,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> u8 {
    let words: Vec<OsString> = words.into_iter().map(Into::into).collect();
    let mut terminal = Terminal {
        out,
        err,
        styles: false,
        columns: None,
        err_columns: None,
        interactive: false,
        write_error: None,
        command: reproduction::command(&words),
    };
    match parse(words, None) {
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

/// Returns the exit code of a command line without a command. Help and version are not errors,
/// unless they cannot be written.
fn no_command(
    error: &clap::Error,
    printed: std::io::Result<()>,
    terminal: &mut Terminal<'_>,
) -> u8 {
    if error.use_stderr() {
        return FAILURE;
    }
    terminal.keep_error(printed);
    terminal.finish(SUCCESS)
}

/// Executes a command. A panic outside the run of a scenario or the row of a study is an error of
/// the command.
fn dispatch(registry: &Registry, cli: Cli, terminal: &mut Terminal<'_>) -> u8 {
    let json = cli.command.json();
    terminal.styles = cli.color.styles(terminal.styles);
    let is_attended = terminal.interactive && std::io::stderr().is_terminal();
    if PROFILE == "debug" && is_attended && cli.command.simulates() {
        terminal.note(DEBUG_BUILD);
    }
    let done = catch_panic(|| command(registry, cli.command, terminal));
    let code = done.unwrap_or_else(|source| {
        let file = String::new();
        terminal.report_error(&TwinError::from(Error::Panic { file, source }), json);
        FAILURE
    });
    terminal.finish(code)
}

fn command(registry: &Registry, command: Command, terminal: &mut Terminal<'_>) -> u8 {
    match command {
        Command::Run(args) => run::run(registry, &args, terminal),
        Command::Plan(args) => plan::plan(registry, &args, terminal),
        Command::Check(args) => check::check(registry, &args, terminal),
        Command::New(args) => new::new(&args, registry, terminal),
        Command::List(args) => list::list(registry, &args, terminal),
        Command::Diff(args) => diff::diff(&args, terminal),
        Command::Replay(args) => replay::replay(registry, &args, terminal),
        Command::Accept(args) => accept::accept(&args, terminal),
        Command::Report(args) => report::report(registry, &args, terminal),
        Command::Live(args) => live::live(registry, &args, terminal),
        Command::Serve(args) => serve::serve(registry, &args, terminal),
        Command::Devices(args) => devices::devices(&args, terminal),
        Command::Study(args) => study::study(registry, &args, terminal),
        Command::Sweep(args) => sweep::sweep(registry, &args, terminal),
        Command::Optimize(args) => optimize::optimize(registry, &args, terminal),
        Command::Fit(args) => fit::fit(registry, &args, terminal),
        Command::Cell(args) => cell::cell(registry, &args, terminal),
        Command::Thesis(args) => thesis::thesis(registry, &args, terminal),
        Command::Export(args) => export::export(registry, &args, terminal),
        Command::Import(args) => import::import(&args, terminal),
        Command::Examples(args) => examples::examples(registry, &args, terminal),
        Command::Schema(args) => schema::schema(registry, &args, terminal),
        Command::Doctor(args) => doctor::doctor(registry, &args, terminal),
        Command::Draw(args) => draw::draw(&args, terminal),
        Command::Completions(args) => completions::completions(&args, terminal),
        Command::Man(args) => completions::man(&args, terminal),
    }
}
