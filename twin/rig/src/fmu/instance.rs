//! Instance of an FMU, behind both versions of the C interface.

use std::fmt;
use std::path::Path;

use twinrig_kernel::{SimDuration, SimTime, Snapshot, signal};
use twinrig_runtime::{RigError, catch_panic};

use crate::assembly::Assembly;
use crate::fmu::error::FmuError;
use crate::fmu::file_uri;
use crate::fmu::part::{FmuPart, Simulated};
use crate::fmu::plant_part::PlantPart;
use crate::fmu::resources::Resources;
use crate::fmu::rig_part::RigPart;
use crate::fmu::variables::{Element, FINGERPRINT, Variables};
use crate::registry::Registry;

/// Largest magnitude of a time in nanoseconds that is exact in `f64` arithmetic around it \[ns\]:
/// 104 days.
const NANOS_MAX: f64 = 9_007_199_254_740_992.0;

/// Largest difference of the master's time from the present one \[s\], besides that in proportion.
const TIME_TOLERANCE_S: f64 = 1e-6;
/// Largest difference of the master's time from the present one, as a share of it.
const TIME_TOLERANCE: f64 = 1e-9;

/// A plant or a rig that a master steps.
///
/// The state machine of FMI is the caller's: it calls [`FmuInstance::begin`] once, and steps
/// afterwards. After an error that [is fatal](FmuError::is_fatal) nothing may be called but drop.
pub struct FmuInstance {
    resources: Resources,
    key: [u8; 32],
    variables: Variables,
    part: Box<dyn Simulated>,
    /// Time of the master at the start \[ns\].
    start_ns: i64,
    /// End of the experiment in the time of the master \[ns\].
    stop_ns: Option<i64>,
    /// Whether the outputs are those of the present state.
    is_observed: bool,
}

/// Saved state of an instance, with a number of the caller.
#[derive(Clone, PartialEq, Eq)]
pub struct FmuState {
    /// Hash of the resources of its FMU.
    key: [u8; 32],
    snapshot: Snapshot,
}

impl fmt::Debug for FmuState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "FmuState of {} bytes", self.snapshot.0.len())
    }
}

/// Contents of a saved state: number of the caller, start time, part. The stop time is a property
/// of the experiment that an instance runs, not of a state.
type Saved = (u8, i64, Snapshot);

impl FmuInstance {
    /// Builds the instance of the resources at `location`, a file URI or a path, which must have
    /// the `token` of the model description.
    ///
    /// # Errors
    /// [`FmuError`] if they cannot be read, are of another version or another FMU, or if the
    /// scenario cannot be built.
    pub fn of_location(location: &str, token: &str) -> Result<Self, FmuError> {
        Self::of_resources(&file_uri::path_of(location)?, token)
    }

    /// Builds the instance of the resources in a folder.
    ///
    /// # Errors
    /// As [`FmuInstance::of_location`].
    pub fn of_resources(folder: &Path, token: &str) -> Result<Self, FmuError> {
        let resources = Resources::read(folder)?;
        resources.check_token(token)?;
        Self::of(resources)
    }

    /// Builds the instance of resources in memory.
    pub(crate) fn of(resources: Resources) -> Result<Self, FmuError> {
        let built = catch_panic(|| build(&resources));
        let (part, variables) = built.map_err(FmuError::Panic)??;
        Ok(Self {
            key: resources.key(),
            resources,
            variables,
            part,
            start_ns: 0,
            stop_ns: None,
            is_observed: false,
        })
    }

    /// Replaces the part by one with the same variables.
    #[cfg(test)]
    pub(crate) fn replace_part(&mut self, part: Box<dyn Simulated>) {
        self.part = part;
    }

    /// Returns the variables.
    pub(crate) fn variables(&self) -> &Variables {
        &self.variables
    }

    /// Returns the number of elements of the variable whose first element has this value reference;
    /// none for another element and for a text.
    pub fn size(&self, reference: u32) -> Option<usize> {
        self.variables.size(reference)
    }

    /// Sets the time of the master at the start, and the time that no step may pass. A stop time
    /// beyond the range of the clock is none.
    ///
    /// # Errors
    /// [`FmuError::NoStart`] and [`FmuError::NoTime`] for other times out of range, and for NaN.
    pub fn set_experiment(&mut self, start_s: f64, stop_s: Option<f64>) -> Result<(), FmuError> {
        let start_ns = nanos(start_s).map_err(|_| FmuError::NoStart { start_s })?;
        let stop_s = stop_s.filter(|stop_s| stop_s.is_nan() || *stop_s <= NANOS_MAX / 1e9);
        let stop_ns = stop_s.map(nanos).transpose()?;
        (self.start_ns, self.stop_ns) = (start_ns, stop_ns);
        Ok(())
    }

    /// Handles the events of the start, after which steps are possible.
    ///
    /// # Errors
    /// [`FmuError::Failed`] if a part fails.
    pub fn begin(&mut self) -> Result<(), FmuError> {
        self.is_observed = false;
        let part = &mut self.part;
        guarded(|| part.begin())
    }

    /// Advances by a step that ends at `current_s + step_s`, to the nearest nanosecond, so that
    /// rounding errors of the master do not accumulate. A step to the present time does nothing.
    ///
    /// # Errors
    /// [`FmuError`] if the step is negative, does not begin at the present time (up to rounding
    /// errors), ends after the stop time or at no time at all, and if a part fails.
    pub fn step(&mut self, current_s: f64, step_s: f64) -> Result<(), FmuError> {
        let to_ns = nanos(current_s + step_s)?;
        if step_s < 0.0 {
            return Err(FmuError::NegativeStep { step_s });
        }
        let now_s = self.time_s();
        if (current_s - now_s).abs() > TIME_TOLERANCE_S + TIME_TOLERANCE * now_s.abs() {
            return Err(FmuError::NotNow { current_s, now_s });
        }
        if let Some(stop_ns) = self.stop_ns.filter(|stop_ns| to_ns > *stop_ns) {
            return Err(FmuError::PastStop {
                to_s: seconds(to_ns),
                stop_s: seconds(stop_ns),
            });
        }
        let now_ns = self.now_ns();
        let since_start = u64::try_from(to_ns.saturating_sub(self.start_ns)).ok();
        let to = since_start.map(|since| SimTime::ZERO + SimDuration::from_nanos(since));
        let to = to.filter(|_| to_ns >= now_ns);
        let to = to.ok_or_else(|| FmuError::Past {
            to_s: seconds(to_ns),
            now_s,
        })?;
        if to_ns == now_ns {
            return Ok(());
        }
        self.is_observed = false;
        let part = &mut self.part;
        guarded(|| part.advance(to))
    }

    /// Returns the present time in the time of the master \[s\].
    pub fn time_s(&self) -> f64 {
        seconds(self.now_ns())
    }

    fn now_ns(&self) -> i64 {
        let now = i64::try_from(self.part.now().as_nanos()).unwrap_or(i64::MAX);
        self.start_ns.saturating_add(now)
    }

    /// Returns the value of a number other than time; `kind` is the name of its type in messages.
    ///
    /// # Errors
    /// [`FmuError::NoSuchVariable`], and the error of an observation that fails.
    pub fn number(&mut self, kind: &'static str, reference: u32) -> Result<f64, FmuError> {
        match self.variables.element(reference) {
            Some(Element::Input(index)) => Ok(self.part.input(index)),
            Some(Element::Output(group, index)) => {
                if !self.is_observed {
                    let part = &mut self.part;
                    guarded(|| part.observe())?;
                    self.is_observed = true;
                }
                Ok(self.part.output(group, index))
            }
            Some(Element::Time) | None => Err(FmuError::NoSuchVariable { kind, reference }),
        }
    }

    /// Sets inputs to values, all or none of them.
    ///
    /// # Errors
    /// [`FmuError`] if there is no such input, or if it cannot have this value.
    pub fn set_numbers(
        &mut self,
        kind: &'static str,
        references: &[u32],
        values: &[f64],
    ) -> Result<(), FmuError> {
        let mut inputs = Vec::with_capacity(values.len());
        for (&reference, &value) in references.iter().zip(values) {
            let index = match self.variables.element(reference) {
                Some(Element::Input(index)) => index,
                Some(Element::Output(..)) => return Err(self.no_input(reference)),
                Some(Element::Time) | None => {
                    return Err(FmuError::NoSuchVariable { kind, reference });
                }
            };
            if !value.is_finite() {
                let name = self.name(reference);
                return Err(FmuError::NotFinite { name, value });
            }
            inputs.push((index, value));
        }
        let part = &mut self.part;
        guarded(|| part.set_inputs(&inputs)).map_err(|error| match error {
            FmuError::Failed(RigError::Change { source, .. }) => source.into(),
            error => error,
        })?;
        self.is_observed = false;
        Ok(())
    }

    /// Returns the error of setting a variable that is no input.
    pub fn no_input(&self, reference: u32) -> FmuError {
        let name = self.name(reference);
        FmuError::NotAnInput { name }
    }

    fn name(&self, reference: u32) -> String {
        if self.variables.fingerprint() == Some(reference) {
            return FINGERPRINT.to_owned();
        }
        let owner = self.variables.owner(reference);
        let name = owner.and_then(|owner| {
            let mut named = owner.references().zip(owner.element_names());
            Some(named.find(|(known, _)| *known == reference)?.1)
        });
        name.unwrap_or_else(|| "time".to_owned())
    }

    /// Returns the value of a text.
    ///
    /// # Errors
    /// [`FmuError::NoSuchVariable`].
    pub fn text(&self, reference: u32) -> Result<String, FmuError> {
        let known = self.variables.fingerprint() == Some(reference);
        let fingerprint = known.then(|| self.part.fingerprint()).flatten();
        fingerprint.ok_or(FmuError::NoSuchVariable {
            kind: "String",
            reference,
        })
    }

    /// Saves the instance, with a number of the caller.
    ///
    /// # Errors
    /// [`FmuError::Panic`] if a part panics.
    pub fn save(&self, number: u8) -> Result<FmuState, FmuError> {
        let saved = catch_panic(|| {
            let saved: Saved = (number, self.start_ns, self.part.save());
            Snapshot::of(&saved)
        });
        Ok(FmuState {
            key: self.key,
            snapshot: saved?,
        })
    }

    /// Restores a state of this instance, or of another one of the same FMU, and returns the number
    /// that was saved with it.
    ///
    /// # Errors
    /// [`FmuError::State`] if it belongs to another FMU.
    pub fn restore(&mut self, state: &FmuState) -> Result<u8, FmuError> {
        let refused = |why: String| FmuError::State { why };
        if state.key != self.key {
            return Err(refused("it was saved by another one".to_owned()));
        }
        let saved = state.snapshot.read::<Saved>();
        let (number, start_ns, part) = saved.map_err(|error| refused(error.to_string()))?;
        self.is_observed = false;
        let restored = catch_panic(|| self.part.restore(&part))?;
        restored.map_err(|error| refused(error.to_string()))?;
        self.start_ns = start_ns;
        Ok(number)
    }

    /// Returns a state as bytes, which another process can restore.
    pub fn serialise(&self, state: &FmuState) -> Vec<u8> {
        state.snapshot.checked(&state.key)
    }

    /// Returns the state of bytes.
    ///
    /// # Errors
    /// [`FmuError::State`] for any bytes but those of [`FmuInstance::serialise`] of the same FMU.
    pub fn deserialise(&self, bytes: &[u8]) -> Result<FmuState, FmuError> {
        let key = self.key;
        match Snapshot::verified(bytes, &key) {
            Ok(snapshot) => Ok(FmuState { key, snapshot }),
            Err(error) => Err(FmuError::State {
                why: error.to_string(),
            }),
        }
    }

    /// Builds the instance anew, as it was at first.
    ///
    /// # Errors
    /// As [`FmuInstance::of_location`].
    pub fn reset(&mut self) -> Result<(), FmuError> {
        *self = Self::of(self.resources.clone())?;
        Ok(())
    }
}

/// Builds the simulated part with its variables.
fn build(resources: &Resources) -> Result<(Box<dyn Simulated>, Variables), FmuError> {
    let registry = Registry::standard();
    let assembly = resources.assembly(&registry)?;
    Ok(match resources.part() {
        FmuPart::Plant => {
            let window = assembly.scenario().observe.period;
            // A master has no other way to the energy balance.
            let plant = assembly.bare_plant(&energy_outputs(&assembly))?;
            let (part, variables) = PlantPart::new(plant, window);
            (Box::new(part), variables)
        }
        FmuPart::Rig => {
            let (part, variables) = RigPart::new(assembly.rig_around(|plant| plant)?);
            (Box::new(part), variables)
        }
    })
}

/// Returns the terms of the energy balance that the plant has as outputs.
fn energy_outputs(assembly: &Assembly<'_>) -> Vec<String> {
    let names = assembly.plant_outputs().iter().map(|port| &port.name);
    let terms = names.filter(|name| name.starts_with(signal::ENERGY_PREFIX));
    terms.cloned().collect()
}

/// Runs code of the part; a panic is an error.
fn guarded(run: impl FnOnce() -> Result<(), RigError>) -> Result<(), FmuError> {
    Ok(catch_panic(run)??)
}

/// Returns the number nearest to a time, as a decimal in a file would be read \[s\].
fn seconds(nanos: i64) -> f64 {
    nanos as f64 / 1e9
}

/// Returns a time of the master in nanoseconds.
fn nanos(seconds: f64) -> Result<i64, FmuError> {
    let nanos = libm::round(seconds * 1e9);
    if nanos.abs() <= NANOS_MAX {
        #[expect(clippy::cast_possible_truncation, reason = "the range is checked")]
        return Ok(nanos as i64);
    }
    Err(FmuError::NoTime { seconds })
}
