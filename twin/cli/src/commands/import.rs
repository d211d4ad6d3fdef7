//! Command `twin import`: robot files of the robots of other programs, recordings of their logs.

mod log;
mod log_summary;
mod mappings;
mod refusal;

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use twinrig_description::{Imported, Language, import as read};
use twinrig_document::{DocumentError, Problem, TEXT_MOST, read_file};

use super::{FAILURE, SUCCESS, Terminal};
use crate::args::{ImportArgs, ImportCommand, ImportFileArgs};
use crate::error::TwinError;
use refusal::not_written;

pub(super) fn import(args: &ImportArgs, terminal: &mut Terminal<'_>) -> u8 {
    let done = match &args.language {
        ImportCommand::Urdf(args) => imported(Language::Urdf, args, terminal),
        ImportCommand::Mjcf(args) => imported(Language::Mjcf, args, terminal),
        ImportCommand::Log(args) => return log::import(args, terminal),
    };
    match done {
        Ok(()) => SUCCESS,
        Err(error) => {
            terminal.print_error(&error);
            FAILURE
        }
    }
}

fn imported(
    language: Language,
    args: &ImportFileArgs,
    terminal: &mut Terminal<'_>,
) -> Result<(), TwinError> {
    let file = args.file.display().to_string();
    let text = text(&file, &args.file)?;
    let made = read(language, &file, &text, args.name.as_deref())?;
    for note in &made.notes {
        terminal.note(note);
    }
    let path = place(args);
    if path.as_os_str() == "-" {
        terminal.print_plain(&made.text);
        return Ok(());
    }
    write_new(&path, &made)?;
    let path = path.display();
    terminal.print(&format!(
        "written {path}: {} entries from {file}, {} ASSUMED\n\n  twin list {path}\n  twin draw {path}",
        made.read, made.assumed
    ));
    Ok(())
}

/// Returns the path of the robot file. Scenarios find a robot by the name of its file.
fn place(args: &ImportFileArgs) -> PathBuf {
    if let Some(out) = &args.out {
        return out.clone();
    }
    let name = args.name.as_deref().filter(|name| !name.contains('/'));
    let stem = args.file.file_stem().unwrap_or(args.file.as_os_str());
    let mut name = name.map_or_else(|| stem.to_owned(), Into::into);
    name.push(".toml");
    Path::new("robots").join(name)
}

fn text(file: &str, path: &Path) -> Result<String, DocumentError> {
    let bytes = read_file(path, TEXT_MOST).map_err(|error| {
        let message = format!("cannot read the file: {error}");
        Problem::of_file(file, message, "")
    })?;
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let message = format!("the file is not UTF-8 from byte {at} on");
        Problem::of_file(file, message, "save it as UTF-8").into()
    })
}

/// Writes a file that must not exist.
fn write_new(path: &PathBuf, made: &Imported) -> Result<(), TwinError> {
    let written = || {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
        file.write_all(made.text.as_bytes())
    };
    written().map_err(|source| not_written(path, source))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_has_the_name_of_the_robot() {
        let of = |name: Option<&str>, out: Option<&str>| {
            place(&ImportFileArgs {
                file: "models/cub.urdf".into(),
                name: name.map(str::to_owned),
                out: out.map(Into::into),
            })
        };
        assert_eq!(of(None, None), Path::new("robots/cub.toml"));
        assert_eq!(of(Some("hound"), None), Path::new("robots/hound.toml"));
        assert_eq!(of(Some("a/b"), None), Path::new("robots/cub.toml"));
        assert_eq!(of(Some("hound"), Some("x.toml")), Path::new("x.toml"));
    }
}
