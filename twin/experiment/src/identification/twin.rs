//! The twin that plays the commands of recordings.

use std::path::PathBuf;

use twinrig_campaign::identification::FitSpace;
use twinrig_document::Document;
use twinrig_kernel::{Direction, SimTime};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::registry::Registry;
use twinrig_runtime::{Plant, PlantState};
use twinrig_scenario::Setting;

use super::data::{Commands, FitData};
use super::error::FitError;
use crate::error::Error;

/// Table of the values of the file of robot or bench that a scenario replaces.
const OVERRIDE: &str = "override";

/// A scenario whose plant plays commands.
pub(super) struct Twin<'r> {
    registry: &'r Registry,
    file: String,
    text: String,
    folder: PathBuf,
    settings: Vec<Setting>,
    /// Outputs that are compared.
    outputs: Vec<String>,
    origin: String,
}

impl<'r> Twin<'r> {
    pub(super) fn new(
        registry: &'r Registry,
        space: &FitSpace,
        settings: &[Setting],
    ) -> Result<Self, Error> {
        let path = PathBuf::from(&space.file);
        let beside = path.parent().unwrap_or(&path);
        let path = beside.join(&space.scenario.value);
        let document = Document::read(&path)?;
        let own = space.set.iter().map(|(key, value)| Setting {
            origin: space.file.clone(),
            key: key.clone(),
            value: value.clone(),
        });
        Ok(Self {
            registry,
            file: document.file().to_owned(),
            text: document.text().to_owned(),
            folder: path.parent().map(PathBuf::from).unwrap_or_default(),
            settings: own.chain(settings.iter().cloned()).collect(),
            outputs: space
                .residuals
                .iter()
                .map(|it| it.twin.value.clone())
                .collect(),
            origin: space.file.clone(),
        })
    }

    /// Returns the scenario file.
    pub(super) fn scenario(&self) -> &str {
        &self.file
    }

    /// Builds the plant with the settings of a recording and those of a point.
    pub(super) fn plant(
        &self,
        recorded: &[(String, String)],
        point: &[(&str, &str)],
    ) -> Result<Box<dyn Plant>, Error> {
        let mut settings = self.settings.clone();
        let mut set = |key: String, value: &str| {
            settings.push(Setting {
                origin: self.origin.clone(),
                key,
                value: value.to_owned(),
            });
        };
        for (key, value) in recorded {
            set(format!("{OVERRIDE}.{key}"), value);
        }
        for (key, value) in point {
            set((*key).to_owned(), value);
        }
        let builder = Assembly::builder(self.registry).settings(&settings);
        let assembly = builder.text(&self.file, &self.text, &self.folder)?;
        Ok(assembly.bare_plant(&self.outputs)?)
    }

    /// Returns the names of the inputs of a plant, in order.
    pub(super) fn inputs(plant: &dyn Plant) -> Vec<String> {
        let ports = plant.ports().into_iter();
        let inputs = ports.filter(|port| port.direction == Direction::Input);
        inputs
            .flat_map(|port| std::iter::repeat_n(port.name, port.size))
            .collect()
    }

    /// Returns the places of the compared outputs in those of a plant.
    fn places(&self, plant: &dyn Plant) -> Result<(Vec<usize>, usize), FitError> {
        let mut start = 0;
        let mut found = vec![None; self.outputs.len()];
        for port in plant.ports() {
            if port.direction != Direction::Output {
                continue;
            }
            for (place, name) in found.iter_mut().zip(&self.outputs) {
                if *name == port.name && port.size == 1 {
                    *place = Some(start);
                }
            }
            start += port.size;
        }
        let places = found.into_iter().zip(&self.outputs);
        let places =
            places.map(|(place, name)| place.ok_or_else(|| FitError::NoOutput(name.clone())));
        Ok((places.collect::<Result<_, _>>()?, start))
    }

    /// Plays the commands of a recording on a plant; returns the outputs at the times of each
    /// compared signal, none where the plant has failed.
    pub(super) fn play(
        &self,
        data: &FitData,
        plant: &mut dyn Plant,
    ) -> Result<Option<Vec<Vec<f64>>>, FitError> {
        let (places, width) = self.places(plant)?;
        let mut inputs = vec![0.0; Self::inputs(plant).len()];
        plant.initial_inputs(&mut inputs);
        start(data, plant)?;
        let mut outputs = vec![0.0; width];
        let names = Self::inputs(plant);
        let mut commands: Vec<Cursor<'_>> = data
            .commands
            .iter()
            .filter_map(|(name, commands)| {
                let input = names.iter().position(|known| known == name)?;
                Some(Cursor {
                    commands,
                    input,
                    next: 0,
                })
            })
            .collect();
        let mut read = vec![0; data.compared.len()];
        let mut played: Vec<Vec<f64>> = data
            .compared
            .iter()
            .map(|signal| Vec::with_capacity(signal.times.len()))
            .collect();
        let mut now = SimTime::ZERO;
        for command in &mut commands {
            command.take(now, &mut inputs);
        }
        loop {
            let due = commands.iter().filter_map(Cursor::due);
            let sampled = data.compared.iter().zip(&read);
            let sampled = sampled.filter_map(|(signal, read)| signal.times.get(*read).copied());
            let Some(next) = due.chain(sampled).min().filter(|next| *next <= data.end) else {
                return Ok(Some(played));
            };
            if next > now {
                if plant.advance(next, &inputs).is_err() {
                    return Ok(None);
                }
                now = next;
            }
            let mut observed = false;
            for ((signal, read), (values, place)) in data
                .compared
                .iter()
                .zip(&mut read)
                .zip(played.iter_mut().zip(&places))
            {
                while signal.times.get(*read) == Some(&now) {
                    if !observed {
                        plant.observe(&mut outputs);
                        observed = true;
                    }
                    values.push(outputs[*place]);
                    *read += 1;
                }
            }
            for command in &mut commands {
                command.take(now, &mut inputs);
            }
        }
    }
}

/// A command and its next value.
struct Cursor<'d> {
    commands: &'d Commands,
    input: usize,
    next: usize,
}

impl Cursor<'_> {
    fn due(&self) -> Option<SimTime> {
        self.commands.times.get(self.next).copied()
    }

    /// Puts the values that are due into the inputs.
    fn take(&mut self, now: SimTime, inputs: &mut [f64]) {
        while self.due().is_some_and(|due| due <= now) {
            inputs[self.input] = self.commands.values[self.next];
            self.next += 1;
        }
    }
}

/// Starts the plant in the state of a recording.
fn start(data: &FitData, plant: &mut dyn Plant) -> Result<(), FitError> {
    if data.start.is_empty() {
        return Ok(());
    }
    let refused = |why: String| FitError::Start {
        recording: data.file.clone(),
        why,
    };
    let none = || refused("the plant has no named state".to_owned());
    let mut state: PlantState = plant.state().ok_or_else(none)?;
    for (name, value) in &data.start {
        if state.get(name).is_none_or(|known| known.len() != 1) {
            return Err(refused(format!("the plant has no state `{name}`")));
        }
        state = state.with(name.clone(), &[*value]);
    }
    let lines = plant.resume_from(&state);
    let lines = lines.map_err(|fault| refused(fault.why))?;
    match lines.first() {
        None => Ok(()),
        Some(line) => Err(refused(line.clone())),
    }
}
