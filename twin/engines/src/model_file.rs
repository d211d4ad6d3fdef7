//! Custom MJCF models: reading, binding of signals, and building of the plant.

use std::path::Path;
use std::sync::Arc;

use twinrig_document::{self as document, DocumentError, Placed, Problem, Source, suggestion};
use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_mujoco::model_file::{
    BoundModel, ElementKind, Input, Leg, ModelFile, ModelFileError, ModelSignals, Output, Place,
    SignalError, SignalMismatch,
};
use twinrig_runtime::Plant;
use twinrig_scenario::{LegFact, Options, PlantSpec};

use twinrig_rig::{BuildError, ModelContext, StandaloneModel};

use twinrig_rig::parts::engines::MJCF;
use twinrig_rig::parts::mjcf::{
    ACTUATOR, AS, FILE, INPUTS, KEYFRAME, NAME, OUTPUTS, UNIT, options,
};
use twinrig_rig::parts::plant_kind::PlantKind;

/// Attachment of a recording: text of the model, for inspection.
const TEXT: &str = "model.xml";
/// Attachment of a recording: compiled model with all included files, for replay.
const COMPILED: &str = "model.mjb";

pub(crate) fn kind() -> PlantKind {
    let kind = PlantKind::standalone(NAME, MJCF, load);
    options().into_iter().fold(kind, PlantKind::with_option)
}

/// Model named by a scenario, with its signals bound.
struct LoadedModel {
    name: String,
    text: Vec<u8>,
    bound: BoundModel,
}

impl StandaloneModel for LoadedModel {
    fn name(&self) -> &str {
        &self.name
    }

    fn legs(&self) -> Option<Vec<LegFact>> {
        let fact = |leg: &Leg| LegFact {
            name: leg.name.clone(),
            fore: leg.fore,
            left: leg.left,
        };
        Some(self.bound.legs().iter().map(fact).collect())
    }

    fn weight(&self) -> Option<f64> {
        Some(self.bound.weight())
    }

    fn ports(&self) -> Vec<Port> {
        self.bound.ports()
    }

    fn step(&self) -> Option<SimDuration> {
        self.bound.file().step().ok()
    }

    fn files(&self) -> Vec<(String, Vec<u8>)> {
        vec![
            (TEXT.to_owned(), self.text.clone()),
            (COMPILED.to_owned(), self.bound.file().binary()),
        ]
    }

    fn build(
        &self,
        plant: &PlantSpec,
        requested: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, BuildError> {
        Ok(Box::new(self.bound.plant(plant.step, requested)?))
    }
}

fn load(context: &ModelContext<'_>) -> Result<LoadedModel, DocumentError> {
    let plant = context.plant;
    let mut problems = Vec::new();
    let signals = model_signals(&plant.options, &mut problems);
    let Some(file) = plant.options.name(FILE) else {
        let message = format!("`{FILE}` is missing in `plant`");
        let help = format!("add `{FILE} = …`, the MJCF file");
        problems.push(Problem::at(&plant.place, message, help));
        return Err(DocumentError { problems });
    };
    if !problems.is_empty() {
        return Err(DocumentError { problems });
    }
    let (text, model) = match context.kept {
        Some(kept) => of_recording(kept, file)?,
        None => of_disk(&context.folder.join(&file.value), file)?,
    };
    let bound = BoundModel::new(model, &signals);
    let bound = bound.map_err(|error| DocumentError {
        problems: placed(error, &plant.options, file),
    });
    let stem = Path::new(&file.value).file_stem();
    Ok(LoadedModel {
        name: stem.map_or_else(String::new, |stem| stem.to_string_lossy().into_owned()),
        text,
        bound: bound?,
    })
}

fn of_disk(path: &Path, file: &Placed<String>) -> Result<(Vec<u8>, ModelFile), DocumentError> {
    let unread = |why| file.error(format!("cannot read {}: {why}", path.display()), "");
    let text = document::read_file(path, document::TEXT_MOST).map_err(unread)?;
    let model = ModelFile::read(path);
    let model = model.map_err(|error| refused(&error, path, &text, file))?;
    Ok((text, model))
}

/// Returns the error at its line of the model if the line is known. Lines of included files are
/// counted from the start of the included file, so models with `<include` have no known lines.
fn refused(error: &ModelFileError, path: &Path, text: &[u8], file: &Placed<String>) -> Problem {
    let text = String::from_utf8_lossy(text);
    let line = error.line().filter(|_| !text.contains("<include"));
    let mut lines = text.split_inclusive('\n');
    let starts = lines.by_ref().take(line.unwrap_or(1) - 1).map(str::len);
    let (start, found) = (starts.sum::<usize>(), lines.next());
    match (line, found) {
        (Some(_), Some(found)) => {
            let indent = found.len() - found.trim_start().len();
            let span = start + indent..start + found.trim_end().len();
            let name = path.display().to_string();
            let text = text.clone().into_owned();
            let place = document::Place::new(Arc::new(Source::new(&name, text)), span);
            Problem::at(&place, error.to_string(), "")
        }
        _ => Problem::at(&file.place, error.to_string(), ""),
    }
}

fn of_recording(
    kept: &[(String, Vec<u8>)],
    file: &Placed<String>,
) -> Result<(Vec<u8>, ModelFile), DocumentError> {
    let find = |name: &str| {
        let found = kept.iter().find(|(known, _)| known == name);
        let lacking = || file.error(format!("the recording does not contain `{name}`"), "");
        found.map(|(_, bytes)| bytes).ok_or_else(lacking)
    };
    let model = ModelFile::of_binary(find(COMPILED)?);
    let model = model.map_err(|error| file.error(error.to_string(), ""))?;
    Ok((find(TEXT)?.clone(), model))
}

/// Reads the signals that the scenario requests of the model, as far as they can be checked without
/// the model.
fn model_signals(options: &Options, problems: &mut Vec<Problem>) -> ModelSignals {
    let mut signals = ModelSignals {
        keyframe: options.name(KEYFRAME).map(|name| name.value.clone()),
        ..ModelSignals::default()
    };
    for (signal, entry) in options.tables(INPUTS) {
        let unit = unit(entry, problems);
        let Some(actuator) = entry.name(ACTUATOR) else {
            let message = format!("`{}` drives no actuator", signal.value);
            problems.push(Problem::at(&signal.place, message, "add `actuator = …`"));
            continue;
        };
        signals.inputs.push(Input {
            signal: signal.value.clone(),
            actuator: actuator.value.clone(),
            unit,
        });
    }
    for (signal, entry) in options.tables(OUTPUTS) {
        let unit = unit(entry, problems);
        let named = ElementKind::ALL.map(|kind| Some((kind, entry.name(kind.name())?)));
        let named: Vec<_> = named.into_iter().flatten().collect();
        let [(thing, name)] = named[..] else {
            let count = if named.is_empty() {
                "no element"
            } else {
                "several elements"
            };
            let message = format!("`{}` names {count} of the model", signal.value);
            let names = ElementKind::ALL.map(ElementKind::name).join(", ");
            problems.push(Problem::at(
                &signal.place,
                message,
                format!("give exactly one of {names}"),
            ));
            continue;
        };
        signals.outputs.push(Output {
            signal: signal.value.clone(),
            thing,
            name: name.value.clone(),
            word: entry.name(AS).map(|word| word.value.clone()),
            unit,
        });
    }
    signals
}

fn unit(entry: &Options, problems: &mut Vec<Problem>) -> Option<Unit> {
    let word = entry.name(UNIT)?;
    let mut units = Unit::ALL.iter();
    let found = units.find(|unit| unit.symbol() == word.value);
    if found.is_none() {
        let message = format!("`{}` is not a unit of a signal", word.value);
        let symbols = Unit::ALL.iter().map(|unit| unit.symbol());
        let help = suggestion(&word.value, "units are SI without prefixes", symbols);
        problems.push(Problem::at(&word.place, message, help));
    }
    found.copied()
}

/// Converts an error to problems at their places in the scenario.
fn placed(error: ModelFileError, options: &Options, file: &Placed<String>) -> Vec<Problem> {
    match error {
        ModelFileError::Signals(mismatches) => {
            let problem = |mismatch: &SignalMismatch| mismatched(mismatch, options, file);
            mismatches.iter().map(problem).collect()
        }
        ModelFileError::Keyframe {
            ref name,
            ref known,
        } => {
            let at = options.name(KEYFRAME).unwrap_or(file);
            let known = known.iter().map(String::as_str);
            let help = suggestion(name, "keyframes of the model", known);
            vec![Problem::at(&at.place, error.to_string(), help)]
        }
        other => vec![Problem::at(&file.place, other.to_string(), "")],
    }
}

fn mismatched(mismatch: &SignalMismatch, options: &Options, file: &Placed<String>) -> Problem {
    let table = if mismatch.input { INPUTS } else { OUTPUTS };
    let Some((signal, entry)) = options.tables(table).nth(mismatch.index) else {
        return Problem::at(&file.place, mismatch.why.to_string(), "");
    };
    let element = || {
        let named = ElementKind::ALL
            .iter()
            .find_map(|kind| entry.name(kind.name()));
        named.map_or(&signal.place, |name| &name.place)
    };
    let of = |key: &str| entry.name(key).map_or(&signal.place, |name| &name.place);
    let place = match mismatch.place {
        Place::Signal => &signal.place,
        Place::ElementKind => element(),
        Place::Word => of(AS),
        Place::Unit => of(UNIT),
    };
    Problem::at(place, mismatch.why.to_string(), help(&mismatch.why))
}

fn unknown(kind: ElementKind, name: &str, known: &[String], other: Option<ElementKind>) -> String {
    let is = other.map(|other| match other {
        ElementKind::Actuator => "it is an actuator".to_owned(),
        other => format!("it is a {other}"),
    });
    let has = match (kind, known) {
        (ElementKind::Actuator, []) => {
            "the model has no actuators; see From a URDF in plants/mujoco/README.md".to_owned()
        }
        (_, []) => format!("the model has no {kind} with a name"),
        _ => {
            let known = known.iter().map(String::as_str);
            suggestion(name, &format!("{kind}s of the model"), known)
        }
    };
    is.into_iter().chain([has]).collect::<Vec<_>>().join("; ")
}

fn help(why: &SignalError) -> String {
    match why {
        SignalError::Unknown {
            thing,
            name,
            known,
            other,
        } => unknown(*thing, name, known, *other),
        SignalError::Word { word, known, .. } => {
            let help = suggestion(word, "it has", known.iter().copied());
            match help.as_str() {
                "" => help,
                help => {
                    let end = if help.ends_with('?') { "" } else { ";" };
                    format!(
                        "{help}{end} select one with `as = …` or by the last part of the signal's name"
                    )
                }
            }
        }
        SignalError::Unit { .. } => "leave `unit` out".to_owned(),
        SignalError::Standard { .. } => "choose another name or another element".to_owned(),
        SignalError::Name { .. } => {
            "names consist of letters, digits, `_`, `-` and `.`, separated by slashes".to_owned()
        }
        SignalError::Taken { .. } => "omit it: the signal always exists".to_owned(),
        SignalError::Driven { .. } => "an actuator accepts one signal".to_owned(),
    }
}
