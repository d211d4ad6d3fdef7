//! `twin check`

use serde::Serialize;

use super::{FINE, Terminal, WRONG, settings};
use crate::args::CheckArgs;
use crate::assembly::Assembly;
use crate::error::guarded;
use crate::registry::Registry;

#[derive(Serialize)]
struct Checked {
    file: String,
    scenario: Option<String>,
    valid: bool,
    error: Option<String>,
}

pub(super) fn check(registry: &Registry, args: &CheckArgs, terminal: &mut Terminal<'_>) -> u8 {
    let settings = settings(&args.settings);
    let mut code = FINE;
    for path in &args.scenarios {
        let file = path.display().to_string();
        let checked = guarded(&file, || {
            let assembly = Assembly::of_file(registry, path, &settings)?;
            assembly.rig()?;
            Ok(assembly.scenario().name.clone())
        });
        let error = checked.as_ref().err();
        if error.is_some() {
            code = WRONG;
        }
        if args.json {
            terminal.print_json(&Checked {
                file,
                valid: error.is_none(),
                error: error.map(ToString::to_string),
                scenario: checked.ok(),
            });
            continue;
        }
        match checked {
            Ok(name) => {
                let mark = terminal.paint.green("✓");
                let name = terminal.paint.dim(&name);
                terminal.print(&format!("{mark} {file}  {name}"));
            }
            Err(error) => terminal.complain(&error),
        }
    }
    code
}
