//! Command `twin examples`: the scenarios in the program.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use toml_edit::DocumentMut;
use twinrig_document::{parse_duration, suggestion};
use twinrig_robot::RobotFile;

use super::{FAILURE, SUCCESS, Terminal, schema};
use crate::args::{ExamplesArgs, ExamplesCommand, ExamplesCopyArgs};
use crate::error::TwinError;
use crate::examples::{EXAMPLES, Example};
use twinrig_report::text::grid::{Grid, Left, Right};
use twinrig_rig::error::Error;
use twinrig_rig::registry::Registry;
use twinrig_rig::report::seconds;

/// Schema file that the first line of an example names.
const SCHEMA: &str = "scenario.schema.json";

pub(super) fn examples(
    registry: &Registry,
    args: &ExamplesArgs,
    terminal: &mut Terminal<'_>,
) -> u8 {
    match &args.command {
        None | Some(ExamplesCommand::List) => {
            list(args.json, terminal);
            SUCCESS
        }
        Some(ExamplesCommand::Copy(copied)) => match copy(registry, copied) {
            Ok(done) => {
                done.report(args.json, terminal);
                SUCCESS
            }
            Err(error) => {
                terminal.report_error(&error, args.json);
                FAILURE
            }
        },
    }
}

/// Row of a list of examples.
#[derive(Debug, Serialize)]
struct Entry {
    name: &'static str,
    /// Null for a bench.
    robot: Option<String>,
    plant: String,
    simulated_s: f64,
    about: String,
}

impl Entry {
    fn of(example: &Example) -> Self {
        // The examples are valid, which tests assert.
        let document: DocumentMut = example.text.parse().unwrap_or_default();
        let text = |item: Option<&toml_edit::Item>| Some(item?.as_str()?.to_owned());
        let plant = document.get("plant").and_then(|plant| plant.get("model"));
        let duration = text(document.get("duration")).unwrap_or_default();
        Self {
            name: example.name,
            robot: text(document.get("robot")),
            plant: text(plant).unwrap_or_default(),
            simulated_s: parse_duration(&duration).map_or(0.0, |it| seconds(it.as_nanos())),
            about: first_sentence(example.text),
        }
    }
}

/// Returns the first sentence of the comment at the start of a scenario.
fn first_sentence(text: &str) -> String {
    let lines = text.lines().filter(|line| !line.starts_with("#:"));
    let comment = lines.map_while(|line| line.strip_prefix("# "));
    let comment = comment.collect::<Vec<_>>().join(" ");
    let end = comment.find(". ").map_or(comment.len(), |at| at + 1);
    comment[..end].to_owned()
}

fn list(json: bool, terminal: &mut Terminal<'_>) {
    #[derive(Serialize)]
    struct Listing {
        examples: Vec<Entry>,
    }
    let examples: Vec<_> = EXAMPLES.iter().map(Entry::of).collect();
    if json {
        terminal.print_json(&Listing { examples });
        return;
    }
    let mut grid = Grid::new(&[Left, Left, Left, Right, Left]);
    grid.header("name|robot|plant|time|");
    for entry in examples {
        grid.row([
            entry.name.into(),
            entry.robot.unwrap_or_default().into(),
            entry.plant.into(),
            format!("{} s", entry.simulated_s).into(),
            entry.about.into(),
        ]);
    }
    terminal.print(&grid.lines(0).join("\n"));
}

/// Files of a copy.
#[derive(Debug, Default, Serialize)]
struct Copied {
    written: Vec<PathBuf>,
    /// Files with the same contents, which were there.
    present: Vec<PathBuf>,
    /// Robots and schema with other contents, which were there and are in use.
    kept: Vec<PathBuf>,
}

impl Copied {
    fn report(&self, json: bool, terminal: &mut Terminal<'_>) {
        if json {
            terminal.print_json(self);
            return;
        }
        for path in &self.written {
            terminal.print_plain(&path.display().to_string());
        }
        for path in &self.kept {
            terminal.note(&format!(
                "{} has other contents than that of this program, and is kept",
                path.display()
            ));
        }
    }
}

/// A file to write.
struct Output {
    path: PathBuf,
    text: String,
    /// Whether other contents in its place are an error.
    example: bool,
}

fn copy(registry: &Registry, args: &ExamplesCopyArgs) -> Result<Copied, TwinError> {
    let mut done = Copied::default();
    let mut new = Vec::new();
    for output in outputs(registry, &chosen(args)?, &args.to)? {
        match fs::read(&output.path) {
            Ok(present) if present == output.text.as_bytes() => done.present.push(output.path),
            Ok(_) if output.example => {
                return Err(TwinError::ExampleInTheWay { path: output.path });
            }
            Ok(_) => done.kept.push(output.path),
            Err(error) if error.kind() == ErrorKind::NotFound => new.push(output),
            Err(source) => return Err(failed(&output.path, source)),
        }
    }
    for output in new {
        if let Some(folder) = output.path.parent() {
            fs::create_dir_all(folder).map_err(|source| failed(folder, source))?;
        }
        // A file that appeared in between is not overwritten either.
        fs::File::create_new(&output.path)
            .and_then(|mut file| file.write_all(output.text.as_bytes()))
            .map_err(|source| failed(&output.path, source))?;
        done.written.push(output.path);
    }
    Ok(done)
}

fn failed(path: &Path, source: std::io::Error) -> TwinError {
    let path = path.to_owned();
    TwinError::from(Error::Write { path, source })
}

/// Returns the examples of a command line, each once.
fn chosen(args: &ExamplesCopyArgs) -> Result<Vec<&'static Example>, TwinError> {
    let names = EXAMPLES.iter().map(|example| example.name);
    for name in &args.names {
        if !names.clone().any(|known| known == name) {
            return Err(TwinError::NoExample {
                name: name.clone(),
                help: suggestion(name, "examples", names),
            });
        }
    }
    let named = |example: &&Example| args.all || args.names.iter().any(|name| name == example.name);
    Ok(EXAMPLES.iter().filter(named).collect())
}

/// Returns the examples, their robots, and the schema of this build.
fn outputs(
    registry: &Registry,
    examples: &[&Example],
    folder: &Path,
) -> Result<Vec<Output>, TwinError> {
    let example = |example: &&Example| Output {
        path: folder.join(format!("{}.toml", example.name)),
        text: example.text.to_owned(),
        example: true,
    };
    let mut outputs: Vec<_> = examples.iter().map(example).collect();
    let needed = examples
        .iter()
        .filter_map(|example| Entry::of(example).robot);
    let needed: Vec<_> = needed.collect();
    // The schema has the variables of all robots, so that every copy writes the same.
    let mut robots = Vec::new();
    for (name, text) in RobotFile::embedded() {
        let path = folder.join("robots").join(format!("{name}.toml"));
        robots.push(RobotFile::parse(&path.display().to_string(), text)?.robot()?);
        if needed.iter().any(|needed| needed == name) {
            outputs.push(Output {
                path,
                text: (*text).to_owned(),
                example: false,
            });
        }
    }
    outputs.push(Output {
        path: folder.join(SCHEMA),
        text: schema::text(registry, &robots),
        example: false,
    });
    Ok(outputs)
}
