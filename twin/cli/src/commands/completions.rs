//! Commands `twin completions` and `twin man`, which follow from the definition of the command
//! line.

use std::path::Path;

use clap::CommandFactory;
use clap_complete::generate;
use clap_mangen::Man;

use super::{FAILURE, SUCCESS, Terminal};
use crate::args::{Cli, CompletionsArgs, ManArgs};
use crate::error::TwinError;
use twinrig_rig::error::Error;

/// Name of the program in scripts and pages.
const PROGRAM: &str = "twin";

pub(super) fn completions(args: &CompletionsArgs, terminal: &mut Terminal<'_>) -> u8 {
    let mut script = Vec::new();
    generate(args.shell, &mut Cli::command(), PROGRAM, &mut script);
    let written = terminal.out.write_all(&script);
    terminal.keep_error(written);
    SUCCESS
}

pub(super) fn man(args: &ManArgs, terminal: &mut Terminal<'_>) -> u8 {
    let Some(folder) = &args.out else {
        let written = Man::new(Cli::command()).render(&mut terminal.out);
        terminal.keep_error(written);
        return SUCCESS;
    };
    match pages(folder) {
        Ok(count) => {
            let folder = folder.display();
            terminal.print(&format!(
                "written {count} pages to {folder}: man -l {folder}/twin.1"
            ));
            SUCCESS
        }
        Err(source) => {
            let path = folder.clone();
            terminal.print_error(&TwinError::from(Error::Write { path, source }));
            FAILURE
        }
    }
}

/// Writes a page for each command and subcommand, and returns their number.
fn pages(folder: &Path) -> std::io::Result<usize> {
    std::fs::create_dir_all(folder)?;
    let mut root = Cli::command();
    root.build();
    let mut commands = vec![root];
    let mut count = 0;
    while let Some(command) = commands.pop() {
        // The built command of a subcommand has the names of its parents: twin-study-precision.
        let name = command.get_display_name().unwrap_or(PROGRAM).to_owned();
        commands.extend(command.get_subcommands().cloned());
        let file = std::fs::File::create(folder.join(format!("{name}.1")))?;
        Man::new(command).render(&mut std::io::BufWriter::new(file))?;
        count += 1;
    }
    Ok(count)
}
