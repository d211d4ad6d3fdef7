//! An instance of an FMU as a plant.

use std::sync::{Mutex, PoisonError};

use serde_json::json;
use twinrig::kernel::{Direction, Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig::runtime::{EnergyBalance, Plant, PlantFault, WorkCounts};

use crate::fmu::failure::Failure;
use crate::fmu::link::{Link, Request};
use crate::fmu::signals::Signal;
use crate::fmu::units::Scale;

/// Size of a number in requests and replies.
const NUMBER: usize = size_of::<f64>();

/// Properties of the FMU and of its start.
pub(super) struct Start<'a> {
    /// Kind of the plant.
    pub kind: &'static str,
    /// Name of the FMU.
    pub name: &'a str,
    /// Identity of the FMU.
    pub token: &'a str,
    /// Capability that it lacks for saving its state.
    pub missing_state: Option<&'a str>,
    /// Start values by variable.
    pub parameters: &'a [(String, Vec<f64>)],
    /// Tolerance of its solver.
    pub tolerance: Option<f64>,
    /// Whether the FMU may end the simulation.
    pub may_terminate: bool,
    /// Greatest communication step; none: as long as inputs are constant.
    pub step: Option<SimDuration>,
}

/// An element of a signal.
#[derive(Clone, Debug)]
struct Element {
    variable: String,
    scale: Scale,
}

/// Instance of an FMU.
pub(super) struct FmuPlant {
    name: String,
    fmu: String,
    token: String,
    missing_state: Option<String>,
    step: Option<SimDuration>,
    may_terminate: bool,
    ports: Vec<Port>,
    inputs: Vec<Element>,
    /// Elements of the outputs, then the terms of the energy balance, if the FMU has one.
    outputs: Vec<Element>,
    initial: Vec<f64>,
    values: Vec<f64>,
    /// Index of the first term.
    energy: usize,
    now: SimTime,
    steps: u64,
    /// Request of a step, for reuse.
    request: Vec<u8>,
    worker: Mutex<Worker>,
}

/// Link to the worker, and the failure after which it is not used any more.
struct Worker {
    link: Link,
    failure: Option<Failure>,
}

impl Worker {
    fn call(&mut self, request: Request, payload: &[u8]) -> Result<Vec<u8>, Failure> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        let reply = self.link.call(request, payload);
        reply.inspect_err(|failure| self.failure = Some(failure.clone()))
    }
}

/// State of a plant between two steps: identity of the FMU, time, outputs, number of steps, and the
/// state of the FMU if it can be saved.
type Saved = (String, SimTime, Vec<f64>, u64, Option<Vec<u8>>);

impl FmuPlant {
    /// Starts the FMU of a worker, with these signals and the terms of its `energy` balance.
    pub fn start(
        mut link: Link,
        signals: &[Signal],
        energy: &[Signal],
        start: &Start<'_>,
    ) -> Result<Self, Failure> {
        let all = signals.iter().chain(energy);
        let variables = |direction| -> Vec<&String> {
            let signals = all.clone().filter(|it| it.port.direction == direction);
            signals.flat_map(|signal| &signal.variables).collect()
        };
        let request = json!({
            "inputs": variables(Direction::Input),
            "outputs": variables(Direction::Output),
            "parameters": start.parameters,
            "tolerance": start.tolerance,
        });
        let reply = link.call(Request::Start, request.to_string().as_bytes())?;
        let inputs = elements(signals, Direction::Input);
        let mut outputs = elements(signals, Direction::Output);
        let terms = outputs.len();
        outputs.extend(elements(energy, Direction::Output));
        if reply.len() != NUMBER * (inputs.len() + outputs.len()) {
            return Err(Failure::Worker("sent a reply of a wrong size".to_owned()));
        }
        let (first, rest) = reply.split_at(NUMBER * inputs.len());
        let mut plant = Self {
            name: start.kind.to_owned(),
            fmu: start.name.to_owned(),
            token: start.token.to_owned(),
            missing_state: start.missing_state.map(str::to_owned),
            step: start.step,
            may_terminate: start.may_terminate,
            ports: signals.iter().map(|signal| signal.port.clone()).collect(),
            initial: vec![0.0; inputs.len()],
            values: vec![0.0; outputs.len()],
            inputs,
            outputs,
            energy: terms,
            now: SimTime::ZERO,
            steps: 0,
            request: Vec::new(),
            worker: Mutex::new(Worker {
                link,
                failure: None,
            }),
        };
        decode(first, &plant.inputs, &mut plant.initial)?;
        decode(rest, &plant.outputs, &mut plant.values)?;
        Ok(plant)
    }

    fn fault(&self, failure: &Failure) -> PlantFault {
        if matches!(failure, Failure::Interrupted) {
            return PlantFault::interrupted(self, self.now);
        }
        let part = failure.part().map(|part| format!("/{part}"));
        PlantFault {
            time: self.now,
            part: format!("{}{}", self.fmu, part.unwrap_or_default()),
            energy: self.energy().stored(),
            why: failure.why(),
        }
    }

    fn step_to(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), Failure> {
        self.request.clear();
        let duration = (to - self.now).as_secs_f64();
        for number in [self.now.as_secs_f64(), duration] {
            self.request.extend_from_slice(&number.to_le_bytes());
        }
        for (value, element) in inputs.iter().zip(&self.inputs) {
            let value = element.scale.to_variable(*value);
            self.request.extend_from_slice(&value.to_le_bytes());
        }
        let worker = self
            .worker
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner);
        let reply = worker.call(Request::Advance, &self.request)?;
        let decoded = decode(&reply, &self.outputs, &mut self.values);
        decoded.inspect_err(|failure| worker.failure = Some(failure.clone()))?;
        self.now = to;
        self.steps += 1;
        Ok(())
    }
}

fn elements(signals: &[Signal], direction: Direction) -> Vec<Element> {
    let signals = signals.iter().filter(|it| it.port.direction == direction);
    let elements = signals.flat_map(|signal| {
        let (count, names) = (signal.scales.len(), &signal.variables);
        // A variable with several elements is the only one of its signal, or named for all.
        let name = move |n: usize| {
            if names.len() == count {
                names[n].clone()
            } else {
                names.join(", ")
            }
        };
        let scales = signal.scales.iter().enumerate();
        scales.map(move |(n, scale)| Element {
            variable: name(n),
            scale: *scale,
        })
    });
    elements.collect()
}

/// Reads numbers as values of signals, all or none.
fn decode(bytes: &[u8], elements: &[Element], values: &mut [f64]) -> Result<(), Failure> {
    let (numbers, rest) = bytes.as_chunks::<NUMBER>();
    if numbers.len() != elements.len() || !rest.is_empty() {
        return Err(Failure::Worker("sent a reply of a wrong size".to_owned()));
    }
    for (number, element) in numbers.iter().zip(elements) {
        let number = f64::from_le_bytes(*number);
        if !number.is_finite() {
            return Err(Failure::Failed {
                part: element.variable.clone(),
                why: format!("its value is {number}"),
            });
        }
    }
    for ((number, element), value) in numbers.iter().zip(elements).zip(values) {
        *value = element.scale.to_signal(f64::from_le_bytes(*number));
    }
    Ok(())
}

impl Plant for FmuPlant {
    fn name(&self) -> &str {
        &self.name
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        inputs.copy_from_slice(&self.initial);
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        let duration = to - self.now;
        let start = self.now;
        let step = self.step.unwrap_or(duration).as_nanos().max(1);
        let parts = duration.as_nanos().div_ceil(step).max(1);
        for part in 1..=parts {
            // Whole nanoseconds, and the end exactly.
            let passed = u128::from(duration.as_nanos()) * u128::from(part) / u128::from(parts);
            let passed = u64::try_from(passed).unwrap_or(duration.as_nanos());
            let next = start + SimDuration::from_nanos(passed);
            let stepped = self.step_to(next, inputs);
            stepped.map_err(|failure| self.fault(&failure))?;
        }
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.copy_from_slice(&self.values[..self.energy]);
    }

    fn has_ended(&self) -> bool {
        let worker = self.worker.lock().unwrap_or_else(PoisonError::into_inner);
        self.may_terminate && matches!(worker.failure, Some(Failure::Terminated { .. }))
    }

    fn energy(&self) -> EnergyBalance {
        let values = self.values[self.energy..].try_into();
        values.map_or_else(|_| EnergyBalance::default(), EnergyBalance::of_values)
    }

    fn work(&self) -> WorkCounts {
        WorkCounts::of_steps(self.steps)
    }

    /// A failure is reported by the next advance.
    fn save(&self) -> Snapshot {
        let state = self.missing_state.is_none().then(|| {
            let mut worker = self.worker.lock().unwrap_or_else(PoisonError::into_inner);
            worker.call(Request::Save, &[]).unwrap_or_default()
        });
        let saved: Saved = (
            self.token.clone(),
            self.now,
            self.values.clone(),
            self.steps,
            state,
        );
        Snapshot::of(&saved)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        if let Some(capability) = &self.missing_state {
            return Err(SnapshotError::Lacking {
                part: format!("the FMU `{}`", self.fmu),
                capability: capability.clone(),
            });
        }
        let (token, now, values, steps, state): Saved = snapshot.read()?;
        if token != self.token || values.len() != self.values.len() {
            return Err(SnapshotError::Mismatch {
                expected: format!("the FMU {} with {} values", self.token, self.values.len()),
                found: format!("the FMU {token} with {} values", values.len()),
            });
        }
        let worker = self
            .worker
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner);
        let restored = worker.call(Request::Restore, &state.unwrap_or_default());
        restored.map_err(|failure| SnapshotError::Decode {
            state: "state of this FMU",
            why: failure.to_string(),
        })?;
        (self.now, self.values, self.steps) = (now, values, steps);
        Ok(())
    }
}
