//! Scenarios that a command reads: files, or standard input.

use std::io::{IsTerminal, Read};
use std::path::Path;
use std::sync::OnceLock;

use twinrig_document::{Document, DocumentError, Problem, STREAM_MOST};
use twinrig_scenario::Setting;

use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::Error;
use twinrig_rig::registry::Registry;

/// Word for standard input in place of a path.
const STANDARD_INPUT: &str = "-";
/// Name of standard input in messages. Names in angle brackets are of texts without a file.
const NAME: &str = "<standard input>";

/// Returns the name of the scenario at `path` in messages.
pub(super) fn name(path: &Path) -> String {
    if is_standard_input(path) {
        return NAME.to_owned();
    }
    path.display().to_string()
}

pub(super) fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == STANDARD_INPUT
}

/// Reads the scenario at `path`, or from standard input, with `settings` applied on top. Paths and
/// robots of a scenario from standard input are relative to the working directory.
pub(super) fn assembly<'r>(
    registry: &'r Registry,
    path: &Path,
    settings: &[Setting],
) -> Result<Assembly<'r>, Error> {
    if !is_standard_input(path) {
        return Assembly::builder(registry).settings(settings).file(path);
    }
    let document = standard_input()?;
    Assembly::builder(registry)
        .settings(settings)
        .text(NAME, document.text(), Path::new(""))
}

/// Returns the document of standard input, which is read once: a command may run it several times.
fn standard_input() -> Result<Document, DocumentError> {
    static READ: OnceLock<Result<Document, DocumentError>> = OnceLock::new();
    READ.get_or_init(|| {
        let mut bytes = Vec::new();
        let mut input = std::io::stdin().lock();
        if input.is_terminal() {
            eprintln!("note: reading a scenario from the terminal; end it with Ctrl-D");
        }
        let read = (&mut input).take(STREAM_MOST + 1).read_to_end(&mut bytes);
        let problem = |why: String| Err(Problem::of_file(NAME, why, "").into());
        match read {
            Err(error) => problem(format!("it cannot be read: {error}")),
            Ok(_) if bytes.len() as u64 > STREAM_MOST => {
                problem(format!("it is longer than {} MB", STREAM_MOST / 1_000_000))
            }
            Ok(_) => Document::from_bytes(NAME, bytes),
        }
    })
    .clone()
}
