//! A model and what is wanted of it, checked against each other.

use std::ops::Range;

use twinrig_kernel::{Port, SimDuration, Unit};

use crate::engine::{Engine, EngineError};
use crate::model_file::error::{ModelFileError, Place, SignalError, SignalMismatch};
use crate::model_file::file::ModelFile;
use crate::model_file::legs::{Leg, legs, weight};
use crate::model_file::plant::Mjcf;
use crate::model_file::signals::{ElementKind, ModelSignals, Output};
use crate::model_file::source::{SignalSource, Source, found, range};
use crate::model_file::unit::{self, Control};

/// Energies that every such plant has, as [`twinrig_runtime::EnergyBalance`] has them.
pub(crate) const ENERGIES: [&str; 8] = [
    "energy/kinetic",
    "energy/spring",
    "energy/gravity",
    "energy/dissipated",
    "energy/actuator",
    "energy/impact",
    "energy/exchanged",
    "energy/residual",
];

/// Signals that expectations and recordings know by name: of the body, then of a leg.
const OF_BODY: [(&str, Unit, usize); 5] = [
    ("body/position", Unit::Meter, 3),
    ("body/orientation", Unit::One, 4),
    ("body/rpy", Unit::Radian, 3),
    ("body/velocity", Unit::MeterPerSecond, 3),
    ("body/angular_velocity", Unit::RadianPerSecond, 3),
];
const OF_LEG: [(&str, Unit, usize); 5] = [
    ("foot/position", Unit::Meter, 3),
    ("foot/velocity", Unit::MeterPerSecond, 3),
    ("foot/load", Unit::Newton, 1),
    ("foot/force", Unit::Newton, 3),
    ("foot/clearance", Unit::Meter, 1),
];

/// What a plant writes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Written {
    Of(Source),
    /// One of [`ENERGIES`].
    Energy(usize),
}

/// A model whose signals are known.
pub struct BoundModel {
    file: ModelFile,
    keyframe: Option<usize>,
    inputs: Vec<(Port, Range<usize>)>,
    outputs: Vec<(Port, Written)>,
    legs: Vec<Leg>,
    weight: f64,
}

impl BoundModel {
    /// Finds everything that `signals` names in the model.
    ///
    /// # Errors
    /// [`ModelFileError`] with everything that is not as it is wanted.
    pub fn new(file: ModelFile, signals: &ModelSignals) -> Result<Self, ModelFileError> {
        let (inputs, mut misfits) = inputs(&file, signals);
        let (mut outputs, others) = outputs(&file, signals);
        misfits.extend(others);
        if !misfits.is_empty() {
            return Err(ModelFileError::Signals(misfits));
        }
        let energies = ENERGIES.iter().enumerate().map(|(i, name)| {
            let port = Port::output(*name, Unit::Joule, 1);
            (port, Written::Energy(i))
        });
        outputs.extend(energies);
        let keyframe = signals.keyframe.as_deref();
        let keyframe = keyframe.map(|name| keyframe_of(&file, name)).transpose()?;
        let mut wired = Self {
            file,
            keyframe,
            inputs,
            outputs,
            legs: Vec::new(),
            weight: 0.0,
        };
        let engine = wired.engine()?;
        let found = legs(&engine, signals).map_err(|leg| ModelFileError::Nowhere { leg })?;
        wired.weight = weight(engine.model(), &found.1);
        wired.legs = found.0;
        Ok(wired)
    }

    /// The model.
    pub fn file(&self) -> &ModelFile {
        &self.file
    }

    /// Its inputs, then all its outputs.
    pub fn ports(&self) -> Vec<Port> {
        let inputs = self.inputs.iter().map(|(port, _)| port);
        let outputs = self.outputs.iter().map(|(port, _)| port);
        inputs.chain(outputs).cloned().collect()
    }

    /// Its legs, in the order in which outputs and then inputs name them.
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// Weight of what the legs carry, of everything if there are none \[N\].
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// The plant, in steps of `step` at most, the model's own if there is none, with those outputs that are wanted.
    ///
    /// # Errors
    /// [`ModelFileError`] if the model has no step, or MuJoCo no start for it.
    pub fn plant(
        &self,
        step: Option<SimDuration>,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Mjcf, ModelFileError> {
        let step = match step {
            Some(step) => step,
            None => self.file.step()?,
        };
        let outputs = self.outputs.iter().filter(|(port, _)| wanted(&port.name));
        let engine = self.engine()?;
        let plant = Mjcf::new(
            engine,
            step,
            self.inputs.clone(),
            outputs.cloned().collect(),
        );
        Ok(plant)
    }

    /// An engine at the start, with servos that hold it there where no keyframe says otherwise.
    fn engine(&self) -> Result<Engine, ModelFileError> {
        let mut engine = Engine::of_model(self.file.model().clone())?;
        if let Some(keyframe) = self.keyframe {
            // Its number is that of one of the model's keyframes.
            let _ = engine.data_mut().reset_keyframe(keyframe);
        }
        let refused = |why: crate::engine::EngineFault| EngineError::Model(why.to_string());
        engine.forward().map_err(refused)?;
        if self.keyframe.is_none() {
            hold(&mut engine);
            engine.forward().map_err(refused)?;
        }
        Ok(engine)
    }
}

/// Sets position servos to where they are.
fn hold(engine: &mut Engine) {
    for actuator in 0..engine.model().actuator_trntype().len() {
        let model = engine.model();
        let one = model.actuator_ctrlnum()[actuator] == 1 && model.actuator_outnum()[actuator] == 1;
        if !one || unit::control(model, actuator) != Control::Place {
            continue;
        }
        let control = range(model.actuator_ctrladr()[actuator], 1).start;
        let out = range(model.actuator_outadr()[actuator], 1).start;
        let [min, max] = if model.actuator_ctrllimited()[control] {
            model.actuator_ctrlrange()[control]
        } else {
            [f64::NEG_INFINITY, f64::INFINITY]
        };
        let place = engine.data().actuator_length()[out].max(min).min(max);
        engine.data_mut().ctrl_mut()[control] = place;
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

/// Inputs with the controls that they are, and those that cannot be.
fn inputs(
    file: &ModelFile,
    signals: &ModelSignals,
) -> (Vec<(Port, Range<usize>)>, Vec<SignalMismatch>) {
    let model = file.model();
    let mut inputs: Vec<(Port, Range<usize>)> = Vec::new();
    let mut misfits = Vec::new();
    for (index, wish) in signals.inputs.iter().enumerate() {
        let input = || {
            named(&wish.signal)?;
            let id = found(model, ElementKind::Actuator, &wish.actuator)?;
            let size = usize::try_from(model.actuator_ctrlnum()[id]).unwrap_or(0);
            let control = range(model.actuator_ctrladr()[id], size);
            if let Some((port, _)) = inputs.iter().find(|(_, taken)| *taken == control) {
                let driven = SignalError::Driven {
                    actuator: wish.actuator.clone(),
                    other: port.name.clone(),
                };
                return Err((Place::ElementKind, driven));
            }
            let unit = agreed(unit::of_control(model, id), wish.unit)?;
            Ok((Port::input(&wish.signal, unit, size), control))
        };
        match input() {
            Ok(input) => inputs.push(input),
            Err((place, why)) => misfits.push(SignalMismatch {
                index,
                input: true,
                place,
                why,
            }),
        }
    }
    (inputs, misfits)
}

/// Outputs with what is written to them, and those that cannot be.
fn outputs(
    file: &ModelFile,
    signals: &ModelSignals,
) -> (Vec<(Port, Written)>, Vec<SignalMismatch>) {
    let output = |wish: &Output| {
        named(&wish.signal)?;
        let meaning = SignalSource::of(file.model(), wish)?;
        let unit = agreed(meaning.unit, wish.unit)?;
        let port = Port::output(&wish.signal, unit, meaning.size);
        as_everywhere(&port)?;
        Ok((port, Written::Of(meaning.source)))
    };
    let (mut outputs, mut misfits) = (Vec::new(), Vec::new());
    for (index, wish) in signals.outputs.iter().enumerate() {
        match output(wish) {
            Ok(output) => outputs.push(output),
            Err((place, why)) => misfits.push(SignalMismatch {
                index,
                input: false,
                place,
                why,
            }),
        }
    }
    (outputs, misfits)
}

/// The unit of the model and that of the wish, which must not contradict each other.
fn agreed(known: Option<Unit>, wanted: Option<Unit>) -> Result<Unit, (Place, SignalError)> {
    match (known, wanted) {
        (Some(known), Some(wanted)) if known != wanted => {
            Err((Place::Unit, SignalError::Unit { known, wanted }))
        }
        (known, wanted) => Ok(known.or(wanted).unwrap_or(Unit::One)),
    }
}

/// A signal's name is words between slashes, and none that the plant has anyway.
fn named(signal: &str) -> Result<(), (Place, SignalError)> {
    let sound = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    let word = |word: &str| !word.is_empty() && word.chars().all(sound);
    let signal = signal.to_owned();
    if !signal.split('/').all(word) {
        return Err((Place::Signal, SignalError::Name { signal }));
    }
    if signal.starts_with("energy/") {
        return Err((Place::Signal, SignalError::Taken { signal }));
    }
    Ok(())
}

/// What expectations know by name is what they take it for.
fn as_everywhere(port: &Port) -> Result<(), (Place, SignalError)> {
    let mut leg = port.name.splitn(3, '/').skip(2);
    let of_leg = port.name.starts_with("leg/").then(|| leg.next()).flatten();
    let known = match of_leg {
        Some(rest) => OF_LEG.iter().find(|(known, ..)| *known == rest),
        None => OF_BODY.iter().find(|(known, ..)| *known == port.name),
    };
    match known {
        Some(&(_, unit, size)) if (unit, size) != (port.unit, port.size) => {
            let words = |unit: Unit, size: usize| match size {
                1 => format!("one number in {unit}"),
                size => format!("{size} numbers in {unit}"),
            };
            let standard = SignalError::Standard {
                signal: port.name.clone(),
                expected: words(unit, size),
                found: words(port.unit, port.size),
            };
            Err((Place::Signal, standard))
        }
        _ => Ok(()),
    }
}
