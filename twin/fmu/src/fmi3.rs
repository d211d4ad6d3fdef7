//! The functions of FMI 3.0 that do something.
#![expect(non_snake_case, reason = "names are those of the standard")]

use std::ffi::{c_char, c_void};

use twinrig_rig::fmu::{FmuError, FmuInstance, FmuState};

use crate::component::{Component, free_state};
use crate::failure::{Failure, Status};
use crate::logger::{Callback, Log3, Logger, c_text};
use crate::phase::Phase;
use crate::raw;

const FLOAT64: &str = "Float64";
/// Value reference of the independent variable, which is a variable in FMI 3.0 only.
const TIME: u32 = 0;

/// Returns the version of the interface.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// Creates an instance; returns null if that fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    instanceName: *const c_char,
    instantiationToken: *const c_char,
    resourcePath: *const c_char,
    _visible: bool,
    _loggingOn: bool,
    eventModeUsed: bool,
    _earlyReturnAllowed: bool,
    _requiredIntermediateVariables: *const u32,
    nRequiredIntermediateVariables: usize,
    instanceEnvironment: *mut c_void,
    logMessage: Option<Log3>,
    _intermediateUpdate: *const c_void,
) -> *mut Component {
    // SAFETY: null, or a text of the master.
    let name = unsafe { raw::text(instanceName, "instanceName") };
    let logger = Logger {
        callback: Callback::Fmi3(logMessage),
        environment: instanceEnvironment,
        name: c_text(name.as_ref().unwrap_or(&"")),
    };
    Component::create(logger, "fmi3InstantiateCoSimulation", || {
        name?;
        if eventModeUsed {
            let why = "it has no event mode";
            return Err(Failure::Unsupported { why });
        }
        if nRequiredIntermediateVariables > 0 {
            let why = "it has no intermediate values";
            return Err(Failure::Unsupported { why });
        }
        // SAFETY: null, or texts of the master.
        let token = unsafe { raw::text(instantiationToken, "instantiationToken") }?;
        // SAFETY: as above.
        let location = unsafe { raw::text(resourcePath, "resourcePath") }?;
        Ok(FmuInstance::of_location(location, token)?)
    })
}

/// Frees an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(instance: *mut Component) {
    // SAFETY: null, or an instance that the master does not use any more.
    unsafe { Component::free(instance) };
}

/// Accepts settings of the logger: errors are always passed to it, and there are no further
/// messages.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetDebugLogging(
    instance: *mut Component,
    _loggingOn: bool,
    _nCategories: usize,
    _categories: *const *const c_char,
) -> Status {
    // SAFETY: null, or an instance of the master.
    unsafe { Component::call(instance, "fmi3SetDebugLogging", Phase::LIVE, |_| Ok(())) }
}

/// Sets start and stop time, and begins the initialization.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    instance: *mut Component,
    _toleranceDefined: bool,
    _tolerance: f64,
    startTime: f64,
    stopTimeDefined: bool,
    stopTime: f64,
) -> Status {
    let (call, allowed) = ("fmi3EnterInitializationMode", [Phase::Instantiated]);
    // SAFETY: null, or an instance of the master.
    unsafe {
        Component::call(instance, call, &allowed, |component| {
            let stop = stopTimeDefined.then_some(stopTime);
            component.instance().set_experiment(startTime, stop)?;
            component.enter(Phase::Initialization);
            Ok(())
        })
    }
}

/// Ends the initialization.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3ExitInitializationMode(instance: *mut Component) -> Status {
    let (call, allowed) = ("fmi3ExitInitializationMode", [Phase::Initialization]);
    // SAFETY: null, or an instance of the master.
    unsafe { Component::call(instance, call, &allowed, Component::begin) }
}

/// Ends the simulation.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Terminate(instance: *mut Component) -> Status {
    // SAFETY: null, or an instance of the master.
    unsafe {
        Component::call(instance, "fmi3Terminate", &[Phase::Step], |component| {
            component.enter(Phase::Terminated);
            Ok(())
        })
    }
}

/// Builds the instance anew.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Reset(instance: *mut Component) -> Status {
    // SAFETY: null, or an instance of the master.
    unsafe { Component::call(instance, "fmi3Reset", Phase::LIVE, Component::reset) }
}

/// Returns the value references of the elements of variables, one after the other; `given` is the
/// number of values that the master passes.
fn elements(
    component: &mut Component,
    references: &[u32],
    given: usize,
) -> Result<Vec<u32>, Failure> {
    let mut all = Vec::new();
    for &reference in references {
        let size = component.instance().size(reference);
        let size = size.and_then(|size| u32::try_from(size).ok());
        let kind = FLOAT64;
        let size = size.ok_or(FmuError::NoSuchVariable { kind, reference })?;
        all.extend(reference..reference + size);
    }
    if all.len() == given {
        return Ok(all);
    }
    let expected = all.len();
    Err(FmuError::Length { given, expected }.into())
}

/// Reads numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFloat64(
    instance: *mut Component,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *mut f64,
    nValues: usize,
) -> Status {
    // SAFETY: null, or an instance and arrays of the master.
    unsafe {
        Component::call(instance, "fmi3GetFloat64", Phase::GET, |component| {
            let references = raw::slice(valueReferences, nValueReferences, "valueReferences")?;
            let values = raw::slice_mut(values, nValues, "values")?;
            let elements = elements(component, references, nValues)?;
            let instance = component.instance();
            for (value, element) in values.iter_mut().zip(elements) {
                *value = match element {
                    TIME => instance.time_s(),
                    _ => instance.number(FLOAT64, element)?,
                };
            }
            Ok(())
        })
    }
}

/// Sets inputs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFloat64(
    instance: *mut Component,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *const f64,
    nValues: usize,
) -> Status {
    // SAFETY: null, or an instance and arrays of the master.
    unsafe {
        Component::call(instance, "fmi3SetFloat64", Phase::SET, |component| {
            let references = raw::slice(valueReferences, nValueReferences, "valueReferences")?;
            let values = raw::slice(values, nValues, "values")?;
            let elements = elements(component, references, nValues)?;
            if elements.contains(&TIME) {
                return Err(component.instance().no_input(TIME).into());
            }
            component.set_numbers(FLOAT64, &elements, values)
        })
    }
}

/// Reads texts, which live until the next call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetString(
    instance: *mut Component,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *mut *const c_char,
    nValues: usize,
) -> Status {
    // SAFETY: null, or an instance and arrays of the master.
    unsafe {
        Component::call(instance, "fmi3GetString", Phase::GET, |component| {
            let references = raw::slice(valueReferences, nValueReferences, "valueReferences")?;
            if nValues != references.len() {
                let (given, expected) = (nValues, references.len());
                return Err(FmuError::Length { given, expected }.into());
            }
            component.read_texts(references, raw::slice_mut(values, nValues, "values")?)
        })
    }
}

/// Advances by a step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    instance: *mut Component,
    currentCommunicationPoint: f64,
    communicationStepSize: f64,
    _noSetFMUStatePriorToCurrentPoint: bool,
    eventHandlingNeeded: *mut bool,
    terminateSimulation: *mut bool,
    earlyReturn: *mut bool,
    lastSuccessfulTime: *mut f64,
) -> Status {
    // SAFETY: null, or an instance and places of the master.
    unsafe {
        Component::call(instance, "fmi3DoStep", &[Phase::Step], |component| {
            *raw::place(eventHandlingNeeded, "eventHandlingNeeded")? = false;
            *raw::place(terminateSimulation, "terminateSimulation")? = false;
            *raw::place(earlyReturn, "earlyReturn")? = false;
            let reached = raw::place(lastSuccessfulTime, "lastSuccessfulTime")?;
            let stepped = component.step(currentCommunicationPoint, communicationStepSize);
            *reached = component.instance().time_s();
            stepped
        })
    }
}

/// Saves the state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(
    instance: *mut Component,
    FMUState: *mut *mut FmuState,
) -> Status {
    // SAFETY: null, or an instance and a state of the master.
    unsafe {
        Component::call(instance, "fmi3GetFMUState", Phase::LIVE, |component| {
            component.save(FMUState)
        })
    }
}

/// Restores a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFMUState(
    instance: *mut Component,
    FMUState: *mut FmuState,
) -> Status {
    // SAFETY: null, or an instance and a state of the master.
    unsafe {
        Component::call(instance, "fmi3SetFMUState", Phase::LIVE, |component| {
            component.restore(FMUState)
        })
    }
}

/// Frees a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(
    instance: *mut Component,
    FMUState: *mut *mut FmuState,
) -> Status {
    // SAFETY: null, or an instance and a state of the master.
    unsafe {
        Component::call(instance, "fmi3FreeFMUState", Phase::LIVE, |_| {
            free_state(FMUState);
            Ok(())
        })
    }
}

/// Returns the number of bytes of a serialised state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializedFMUStateSize(
    instance: *mut Component,
    FMUState: *mut FmuState,
    size: *mut usize,
) -> Status {
    let call = "fmi3SerializedFMUStateSize";
    // SAFETY: null, or an instance and a state of the master.
    unsafe {
        Component::call(instance, call, Phase::LIVE, |component| {
            component.serialised_size(FMUState, size)
        })
    }
}

/// Serialises a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializeFMUState(
    instance: *mut Component,
    FMUState: *mut FmuState,
    serializedState: *mut u8,
    size: usize,
) -> Status {
    let call = "fmi3SerializeFMUState";
    // SAFETY: null, or an instance, a state and an array of the master.
    unsafe {
        Component::call(instance, call, Phase::LIVE, |component| {
            component.serialise(FMUState, serializedState, size)
        })
    }
}

/// Makes a state of serialised bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DeserializeFMUState(
    instance: *mut Component,
    serializedState: *const u8,
    size: usize,
    FMUState: *mut *mut FmuState,
) -> Status {
    let call = "fmi3DeserializeFMUState";
    // SAFETY: null, or an instance, an array and a state of the master.
    unsafe {
        Component::call(instance, call, Phase::LIVE, |component| {
            component.deserialise(serializedState, size, FMUState)
        })
    }
}
