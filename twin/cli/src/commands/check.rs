//! Command `twin check`: validation of scenarios.

use serde::Serialize;
use twinrig_document::{DocumentError, Problem, Warning, escaped};
use twinrig_experiment::check_ensemble;

use super::{FAILURE, SUCCESS, Terminal, settings, source};
use crate::args::CheckArgs;
use crate::error::TwinError;
use twinrig_report::text::style::{DIM, GREEN, styled};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::guarded;
use twinrig_rig::registry::Registry;
use twinrig_rig::report::WarningEntry;

#[derive(Serialize)]
struct Checked {
    file: String,
    scenario: Option<String>,
    valid: bool,
    error: Option<String>,
    warnings: Vec<WarningEntry>,
}

pub(super) fn check(registry: &Registry, args: &CheckArgs, terminal: &mut Terminal<'_>) -> u8 {
    let settings = settings(&args.settings);
    let mut code = SUCCESS;
    for path in &args.scenarios {
        let file = source::name(path);
        let checked = guarded(&file, || {
            let assembly = source::assembly(registry, path, &settings)?;
            check_ensemble(&assembly)?;
            build(&assembly)
        });
        let (checked, warnings) = match checked {
            Ok((name, warnings)) if args.strict && !warnings.is_empty() => {
                (Err((Some(name), as_error(&warnings))), warnings)
            }
            Ok((name, warnings)) => (Ok(name), warnings),
            Err(error) => (Err((None, error)), Vec::new()),
        };
        if checked.is_err() {
            code = FAILURE;
        }
        if args.json {
            terminal.print_json(&Checked {
                file,
                valid: checked.is_ok(),
                error: checked.as_ref().err().map(|(_, error)| error.to_string()),
                scenario: checked.map_or_else(|(name, _)| name, Some),
                warnings: WarningEntry::all(&warnings),
            });
            continue;
        }
        match checked {
            Ok(name) => {
                terminal.warn(&warnings);
                let mark = styled(GREEN, "✓");
                let name = styled(DIM, &name);
                terminal.print(&format!("{mark} {}  {name}", escaped(&file)));
            }
            Err((_, error)) => terminal.print_error(&error),
        }
    }
    code
}

/// Builds the rig of a scenario; returns the name and the warnings of the scenario.
fn build(assembly: &Assembly<'_>) -> Result<(String, Vec<Warning>), TwinError> {
    assembly.rig()?;
    let scenario = assembly.scenario();
    Ok((scenario.name.clone(), scenario.warnings.clone()))
}

/// Converts warnings to an error, for `--strict`.
fn as_error(warnings: &[Warning]) -> TwinError {
    let problem = |Warning { code, problem }: &Warning| Problem {
        message: format!("{} [{code}]", problem.message),
        ..problem.clone()
    };
    let problems = warnings.iter().map(problem).collect();
    DocumentError { problems }.into()
}
