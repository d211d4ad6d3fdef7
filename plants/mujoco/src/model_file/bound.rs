//! A model bound to the signals of a scenario.

use std::ops::Range;

use twinrig_kernel::signal::{self, Standard};
use twinrig_kernel::{Port, SignalKind, SimDuration, Unit};

use crate::engine::{Engine, EngineError};
use crate::model_file::error::{ModelFileError, Place, SignalError, SignalMismatch};
use crate::model_file::file::ModelFile;
use crate::model_file::legs::{Leg, legs, weight};
use crate::model_file::plant::Mjcf;
use crate::model_file::signals::{ElementKind, ModelSignals, Output};
use crate::model_file::source::{OutputSource, SignalSource, Source, find_element, range};
use crate::model_file::unit::{self, Control};

/// A model with its signals, checked against each other.
pub struct BoundModel {
    file: ModelFile,
    keyframe: Option<usize>,
    inputs: Vec<(Port, Range<usize>)>,
    outputs: Vec<(Port, OutputSource)>,
    legs: Vec<Leg>,
    weight: f64,
}

impl BoundModel {
    /// Binds the elements that `signals` names in the model.
    ///
    /// # Errors
    /// [`ModelFileError`] with all mismatches of the signals.
    pub fn new(file: ModelFile, signals: &ModelSignals) -> Result<Self, ModelFileError> {
        let (inputs, mut mismatches) = inputs(&file, signals);
        let (mut outputs, others) = outputs(&file, signals);
        mismatches.extend(others);
        if !mismatches.is_empty() {
            return Err(ModelFileError::Signals(mismatches));
        }
        let energies = signal::ENERGY.iter().enumerate();
        let energies =
            energies.map(|(index, standard)| (standard.output(), OutputSource::Energy(index)));
        outputs.extend(energies);
        let keyframe = signals.keyframe.as_deref();
        let keyframe = keyframe.map(|name| keyframe_of(&file, name)).transpose()?;
        let mut bound = Self {
            file,
            keyframe,
            inputs,
            outputs,
            legs: Vec::new(),
            weight: 0.0,
        };
        let engine = bound.engine()?;
        let found = legs(&engine, signals).map_err(|leg| ModelFileError::Nowhere { leg })?;
        bound.weight = weight(engine.model(), &found.1);
        bound.legs = found.0;
        Ok(bound)
    }

    /// Returns the model.
    pub fn file(&self) -> &ModelFile {
        &self.file
    }

    /// Returns the input ports, then all output ports.
    pub fn ports(&self) -> Vec<Port> {
        let inputs = self.inputs.iter().map(|(port, _)| port);
        let outputs = self.outputs.iter().map(|(port, _)| port);
        inputs.chain(outputs).cloned().collect()
    }

    /// Returns the legs in the order of their first occurrence in outputs and then inputs.
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// Returns the weight of the trees that contain the legs, of all bodies if there are none
    /// \[N\].
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Builds the plant with steps of at most `step`, by default the model's own, and with the
    /// outputs for which `selected` returns true.
    ///
    /// # Errors
    /// [`ModelFileError`] if the model has no valid step, or MuJoCo cannot initialise it.
    pub fn plant(
        &self,
        step: Option<SimDuration>,
        selected: &dyn Fn(&str) -> bool,
    ) -> Result<Mjcf, ModelFileError> {
        let step = match step {
            Some(step) => step,
            None => self.file.step()?,
        };
        let outputs = self.outputs.iter().filter(|(port, _)| selected(&port.name));
        let engine = self.engine()?;
        let plant = Mjcf::new(
            engine,
            step,
            self.inputs.clone(),
            outputs.cloned().collect(),
        );
        Ok(plant)
    }

    /// Returns an engine in the initial state; without a keyframe position servos hold it there.
    fn engine(&self) -> Result<Engine, ModelFileError> {
        let mut engine = Engine::of_model(self.file.model().clone())?;
        if let Some(keyframe) = self.keyframe {
            // The index is that of an existing keyframe.
            let _ = engine.data_mut().reset_keyframe(keyframe);
        }
        let refused = |why: crate::engine::EngineFault| EngineError::Model(why.to_string());
        engine.forward().map_err(refused)?;
        if self.keyframe.is_none() {
            hold_position_servos(&mut engine);
            engine.forward().map_err(refused)?;
        }
        Ok(engine)
    }
}

/// Sets the controls of position servos to their present positions.
fn hold_position_servos(engine: &mut Engine) {
    for actuator in 0..engine.model().actuator_trntype().len() {
        let model = engine.model();
        let one = model.actuator_ctrlnum()[actuator] == 1 && model.actuator_outnum()[actuator] == 1;
        if !one || unit::control(model, actuator) != Control::Position {
            continue;
        }
        let control = range(model.actuator_ctrladr()[actuator], 1).start;
        let out = range(model.actuator_outadr()[actuator], 1).start;
        let [min, max] = if model.actuator_ctrllimited()[control] {
            model.actuator_ctrlrange()[control]
        } else {
            [f64::NEG_INFINITY, f64::INFINITY]
        };
        let position = engine.data().actuator_length()[out].max(min).min(max);
        engine.data_mut().ctrl_mut()[control] = position;
    }
}

fn keyframe_of(file: &ModelFile, name: &str) -> Result<usize, ModelFileError> {
    let model = file.model();
    let key = mujoco_rs::prelude::MjtObjBase::mjOBJ_KEY;
    let names = (0..model.key_time().len()).filter_map(|id| Some((id, model.id_to_name(key, id)?)));
    let names: Vec<(usize, &str)> = names.collect();
    let found = names.iter().find(|(_, known)| *known == name);
    found.map(|(id, _)| *id).ok_or_else(|| {
        let known = names.iter().filter(|(_, name)| !name.is_empty());
        ModelFileError::Keyframe {
            name: name.to_owned(),
            known: known.map(|(_, name)| (*name).to_owned()).collect(),
        }
    })
}

/// Returns the inputs with their controls, and the mismatches.
fn inputs(
    file: &ModelFile,
    signals: &ModelSignals,
) -> (Vec<(Port, Range<usize>)>, Vec<SignalMismatch>) {
    let model = file.model();
    let mut inputs: Vec<(Port, Range<usize>)> = Vec::new();
    let mut mismatches = Vec::new();
    for (index, declaration) in signals.inputs.iter().enumerate() {
        let input = || {
            check_name(&declaration.signal)?;
            let id = find_element(model, ElementKind::Actuator, &declaration.actuator)?;
            let size = usize::try_from(model.actuator_ctrlnum()[id]).unwrap_or(0);
            let control = range(model.actuator_ctrladr()[id], size);
            if let Some((port, _)) = inputs.iter().find(|(_, taken)| *taken == control) {
                let driven = SignalError::Driven {
                    actuator: declaration.actuator.clone(),
                    other: port.name.clone(),
                };
                return Err((Place::ElementKind, driven));
            }
            let unit = resolve_unit(unit::of_control(model, id), declaration.unit)?;
            Ok((Port::input(&declaration.signal, unit, size), control))
        };
        match input() {
            Ok(input) => inputs.push(input),
            Err((place, why)) => mismatches.push(SignalMismatch {
                index,
                input: true,
                place,
                why,
            }),
        }
    }
    (inputs, mismatches)
}

/// Returns the outputs with their sources, and the mismatches.
fn outputs(
    file: &ModelFile,
    signals: &ModelSignals,
) -> (Vec<(Port, OutputSource)>, Vec<SignalMismatch>) {
    let output = |declaration: &Output| {
        check_name(&declaration.signal)?;
        let signal_source = SignalSource::of(file.model(), declaration)?;
        let unit = resolve_unit(signal_source.unit, declaration.unit)?;
        let port = Port::output(&declaration.signal, unit, signal_source.size);
        check_standard(&port)?;
        Ok((port, OutputSource::Model(signal_source.source)))
    };
    let (mut outputs, mut mismatches) = (Vec::new(), Vec::new());
    for (index, declaration) in signals.outputs.iter().enumerate() {
        match output(declaration) {
            Ok(output) => outputs.push(output),
            Err((place, why)) => mismatches.push(SignalMismatch {
                index,
                input: false,
                place,
                why,
            }),
        }
    }
    if mismatches.is_empty() {
        declare_kinds(&mut outputs, &signals.outputs);
    }
    (outputs, mismatches)
}

/// Declares rotations, and the rates of positions of the same element.
fn declare_kinds(outputs: &mut [(Port, OutputSource)], declarations: &[Output]) {
    use OutputSource::Model;
    let is_rate = |rate: &OutputSource, position: &OutputSource| {
        matches!(
            (rate, position),
            (Model(Source::Qvel(_)), Model(Source::Qpos(_)))
                | (Model(Source::Velocity(_)), Model(Source::Length(_)))
                | (
                    Model(Source::LinearVelocity(..)),
                    Model(Source::Position(..))
                )
        )
    };
    let position_of = |index: usize| {
        let element = |other: usize| (declarations[other].thing, &declarations[other].name);
        let mut others = 0..outputs.len();
        others.find(|&other| {
            element(other) == element(index) && is_rate(&outputs[index].1, &outputs[other].1)
        })
    };
    let kind = |index: usize| match &outputs[index].1 {
        Model(Source::Orientation(_)) => Some(SignalKind::Rotation),
        _ => Some(SignalKind::RateOf(
            outputs[position_of(index)?].0.name.clone(),
        )),
    };
    let kinds: Vec<Option<SignalKind>> = (0..outputs.len()).map(kind).collect();
    for ((port, _), kind) in outputs.iter_mut().zip(kinds) {
        port.kind = kind.unwrap_or(port.kind.clone());
    }
}

/// Returns the unit of the model or of the scenario, which must not contradict each other.
fn resolve_unit(known: Option<Unit>, declared: Option<Unit>) -> Result<Unit, (Place, SignalError)> {
    match (known, declared) {
        (Some(known), Some(declared)) if known != declared => Err((
            Place::Unit,
            SignalError::Unit {
                known,
                wanted: declared,
            },
        )),
        (known, declared) => Ok(known.or(declared).unwrap_or(Unit::One)),
    }
}

/// Checks the name of a signal: words between slashes, and no built-in signal of the plant.
fn check_name(signal: &str) -> Result<(), (Place, SignalError)> {
    let valid_char = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    let valid_word = |word: &str| !word.is_empty() && word.chars().all(valid_char);
    let signal = signal.to_owned();
    if !signal.split('/').all(valid_word) {
        return Err((Place::Signal, SignalError::Name { signal }));
    }
    if signal.starts_with(signal::ENERGY_PREFIX) {
        return Err((Place::Signal, SignalError::Taken { signal }));
    }
    Ok(())
}

/// Checks unit and size of a standard signal.
fn check_standard(port: &Port) -> Result<(), (Place, SignalError)> {
    let known = match signal::parse_leg(&port.name) {
        Some((_, rest)) => signal::LEG
            .iter()
            .find(|known| known.name == rest && rest.starts_with("foot/")),
        None => signal::BODY.iter().find(|known| known.name == port.name),
    };
    match known {
        Some(&Standard { unit, size, .. }) if (unit, size) != (port.unit, port.size) => {
            let describe = |unit: Unit, size: usize| match size {
                1 => format!("one number in {unit}"),
                size => format!("{size} numbers in {unit}"),
            };
            let standard = SignalError::Standard {
                signal: port.name.clone(),
                expected: describe(unit, size),
                found: describe(port.unit, port.size),
            };
            Err((Place::Signal, standard))
        }
        _ => Ok(()),
    }
}
