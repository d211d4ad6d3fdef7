//! `twin check`

use serde::Serialize;
use twinrig_document::{DocumentError, Problem, Warning};

use super::{FINE, Terminal, WRONG, settings};
use crate::args::CheckArgs;
use crate::assembly::Assembly;
use crate::assembly::registry::Registry;
use crate::error::{TwinError, guarded};
use crate::report::Warned;

#[derive(Serialize)]
struct Checked {
    file: String,
    scenario: Option<String>,
    valid: bool,
    error: Option<String>,
    warnings: Vec<Warned>,
}

pub(super) fn check(registry: &Registry, args: &CheckArgs, terminal: &mut Terminal<'_>) -> u8 {
    let settings = settings(&args.settings);
    let mut code = FINE;
    for path in &args.scenarios {
        let file = path.display().to_string();
        let checked = guarded(&file, || {
            sound(&Assembly::of_file(registry, path, &settings)?)
        });
        let (checked, warnings) = match checked {
            Ok((name, warnings)) if args.strict && !warnings.is_empty() => {
                (Err((Some(name), as_error(&warnings))), warnings)
            }
            Ok((name, warnings)) => (Ok(name), warnings),
            Err(error) => (Err((None, error)), Vec::new()),
        };
        if checked.is_err() {
            code = WRONG;
        }
        if args.json {
            terminal.print_json(&Checked {
                file,
                valid: checked.is_ok(),
                error: checked.as_ref().err().map(|(_, error)| error.to_string()),
                scenario: checked.map_or_else(|(name, _)| name, Some),
                warnings: Warned::all(&warnings),
            });
            continue;
        }
        match checked {
            Ok(name) => {
                terminal.warn(&warnings);
                let mark = terminal.paint.green("✓");
                let name = terminal.paint.dim(&name);
                terminal.print(&format!("{mark} {file}  {name}"));
            }
            Err((_, error)) => terminal.complain(&error),
        }
    }
    code
}

/// The name of a scenario whose rig can be built, and its warnings.
fn sound(assembly: &Assembly<'_>) -> Result<(String, Vec<Warning>), TwinError> {
    assembly.rig()?;
    let scenario = assembly.scenario();
    Ok((scenario.name.clone(), scenario.warnings.clone()))
}

/// The error that warnings are under `--strict`.
fn as_error(warnings: &[Warning]) -> TwinError {
    let problem = |Warning { code, problem }: &Warning| Problem {
        message: format!("{} [{code}]", problem.message),
        ..problem.clone()
    };
    let problems = warnings.iter().map(problem).collect();
    DocumentError { problems }.into()
}
