//! The functions of FMI 2.0 that do something.
#![expect(non_snake_case, reason = "names are those of the standard")]

use std::ffi::{c_char, c_int, c_void};

use twinrig_rig::fmu::{FmuInstance, FmuState};

use crate::component::{Component, free_state};
use crate::failure::{Failure, Status};
use crate::logger::{Callback, Log2, Logger, c_text};
use crate::phase::Phase;
use crate::raw;

/// `fmi2Type` of co-simulation.
const CO_SIMULATION: c_int = 1;
/// `fmi2StatusKind` of the time reached.
const LAST_SUCCESSFUL_TIME: c_int = 2;
/// `fmi2StatusKind` of the end requested by the FMU.
const TERMINATED: c_int = 3;

const REAL: &str = "Real";

/// Callbacks of the master. Memory is managed here, and no step is asynchronous.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fmi2CallbackFunctions {
    logger: Option<Log2>,
    allocate_memory: *const c_void,
    free_memory: *const c_void,
    step_finished: *const c_void,
    component_environment: *mut c_void,
}

#[cfg(test)]
impl fmi2CallbackFunctions {
    pub(crate) fn of(logger: Option<Log2>, component_environment: *mut c_void) -> Self {
        Self {
            logger,
            allocate_memory: std::ptr::null(),
            free_memory: std::ptr::null(),
            step_finished: std::ptr::null(),
            component_environment,
        }
    }
}

/// Returns the name of the types.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

/// Returns the version of the interface.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

/// Creates an instance; returns null if that fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    instanceName: *const c_char,
    fmuType: c_int,
    fmuGUID: *const c_char,
    fmuResourceLocation: *const c_char,
    functions: *const fmi2CallbackFunctions,
    _visible: c_int,
    _loggingOn: c_int,
) -> *mut Component {
    // SAFETY: null, or the callbacks of the master.
    let callbacks = unsafe { functions.as_ref() };
    // SAFETY: null, or a text of the master.
    let name = unsafe { raw::text(instanceName, "instanceName") };
    let logger = Logger {
        callback: Callback::Fmi2(callbacks.and_then(|functions| functions.logger)),
        environment: callbacks.map_or(std::ptr::null_mut(), |it| it.component_environment),
        name: c_text(name.as_ref().unwrap_or(&"")),
    };
    Component::create(logger, "fmi2Instantiate", || {
        name?;
        if fmuType != CO_SIMULATION {
            let why = "it is for co-simulation only";
            return Err(Failure::Unsupported { why });
        }
        // SAFETY: null, or texts of the master.
        let token = unsafe { raw::text(fmuGUID, "fmuGUID") }?;
        // SAFETY: as above.
        let location = unsafe { raw::text(fmuResourceLocation, "fmuResourceLocation") }?;
        Ok(FmuInstance::of_location(location, token)?)
    })
}

/// Frees an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(c: *mut Component) {
    // SAFETY: null, or an instance that the master does not use any more.
    unsafe { Component::free(c) };
}

/// Accepts settings of the logger: errors are always passed to it, and there are no further
/// messages.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetDebugLogging(
    c: *mut Component,
    _loggingOn: c_int,
    _nCategories: usize,
    _categories: *const *const c_char,
) -> Status {
    // SAFETY: null, or an instance of the master.
    unsafe { Component::call(c, "fmi2SetDebugLogging", Phase::LIVE, |_| Ok(())) }
}

/// Sets start and stop time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    c: *mut Component,
    _toleranceDefined: c_int,
    _tolerance: f64,
    startTime: f64,
    stopTimeDefined: c_int,
    stopTime: f64,
) -> Status {
    let allowed = [Phase::Instantiated];
    // SAFETY: null, or an instance of the master.
    unsafe {
        Component::call(c, "fmi2SetupExperiment", &allowed, |component| {
            let stop = (stopTimeDefined != 0).then_some(stopTime);
            Ok(component.instance().set_experiment(startTime, stop)?)
        })
    }
}

/// Begins the initialization.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterInitializationMode(c: *mut Component) -> Status {
    let (call, allowed) = ("fmi2EnterInitializationMode", [Phase::Instantiated]);
    // SAFETY: null, or an instance of the master.
    unsafe {
        Component::call(c, call, &allowed, |component| {
            component.enter(Phase::Initialization);
            Ok(())
        })
    }
}

/// Ends the initialization.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2ExitInitializationMode(c: *mut Component) -> Status {
    let (call, allowed) = ("fmi2ExitInitializationMode", [Phase::Initialization]);
    // SAFETY: null, or an instance of the master.
    unsafe { Component::call(c, call, &allowed, Component::begin) }
}

/// Ends the simulation.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Terminate(c: *mut Component) -> Status {
    // SAFETY: null, or an instance of the master.
    unsafe {
        Component::call(c, "fmi2Terminate", &[Phase::Step], |component| {
            component.enter(Phase::Terminated);
            Ok(())
        })
    }
}

/// Builds the instance anew.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Reset(c: *mut Component) -> Status {
    // SAFETY: null, or an instance of the master.
    unsafe { Component::call(c, "fmi2Reset", Phase::LIVE, Component::reset) }
}

/// Reads numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(
    c: *mut Component,
    vr: *const u32,
    nvr: usize,
    value: *mut f64,
) -> Status {
    // SAFETY: null, or an instance and arrays of the master.
    unsafe {
        Component::call(c, "fmi2GetReal", Phase::GET, |component| {
            let references = raw::slice(vr, nvr, "vr")?;
            let values = raw::slice_mut(value, nvr, "value")?;
            for (value, reference) in values.iter_mut().zip(references) {
                *value = component.instance().number(REAL, *reference)?;
            }
            Ok(())
        })
    }
}

/// Sets inputs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(
    c: *mut Component,
    vr: *const u32,
    nvr: usize,
    value: *const f64,
) -> Status {
    // SAFETY: null, or an instance and arrays of the master.
    unsafe {
        Component::call(c, "fmi2SetReal", Phase::SET, |component| {
            let references = raw::slice(vr, nvr, "vr")?;
            let values = raw::slice(value, nvr, "value")?;
            component.set_numbers(REAL, references, values)
        })
    }
}

/// Reads texts, which live until the next call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetString(
    c: *mut Component,
    vr: *const u32,
    nvr: usize,
    value: *mut *const c_char,
) -> Status {
    // SAFETY: null, or an instance and arrays of the master.
    unsafe {
        Component::call(c, "fmi2GetString", Phase::GET, |component| {
            let references = raw::slice(vr, nvr, "vr")?;
            component.read_texts(references, raw::slice_mut(value, nvr, "value")?)
        })
    }
}

/// Advances by a step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(
    c: *mut Component,
    currentCommunicationPoint: f64,
    communicationStepSize: f64,
    _noSetFMUStatePriorToCurrentPoint: c_int,
) -> Status {
    // SAFETY: null, or an instance of the master.
    unsafe {
        Component::call(c, "fmi2DoStep", &[Phase::Step], |component| {
            component.step(currentCommunicationPoint, communicationStepSize)
        })
    }
}

/// Saves the state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(
    c: *mut Component,
    FMUstate: *mut *mut FmuState,
) -> Status {
    // SAFETY: null, or an instance and a state of the master.
    unsafe {
        Component::call(c, "fmi2GetFMUstate", Phase::LIVE, |component| {
            component.save(FMUstate)
        })
    }
}

/// Restores a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetFMUstate(c: *mut Component, FMUstate: *mut FmuState) -> Status {
    // SAFETY: null, or an instance and a state of the master.
    unsafe {
        Component::call(c, "fmi2SetFMUstate", Phase::LIVE, |component| {
            component.restore(FMUstate)
        })
    }
}

/// Frees a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeFMUstate(
    c: *mut Component,
    FMUstate: *mut *mut FmuState,
) -> Status {
    // SAFETY: null, or an instance and a state of the master.
    unsafe {
        Component::call(c, "fmi2FreeFMUstate", Phase::LIVE, |_| {
            free_state(FMUstate);
            Ok(())
        })
    }
}

/// Returns the number of bytes of a serialised state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializedFMUstateSize(
    c: *mut Component,
    FMUstate: *mut FmuState,
    size: *mut usize,
) -> Status {
    let call = "fmi2SerializedFMUstateSize";
    // SAFETY: null, or an instance and a state of the master.
    unsafe {
        Component::call(c, call, Phase::LIVE, |component| {
            component.serialised_size(FMUstate, size)
        })
    }
}

/// Serialises a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializeFMUstate(
    c: *mut Component,
    FMUstate: *mut FmuState,
    serializedState: *mut u8,
    size: usize,
) -> Status {
    // SAFETY: null, or an instance, a state and an array of the master.
    unsafe {
        Component::call(c, "fmi2SerializeFMUstate", Phase::LIVE, |component| {
            component.serialise(FMUstate, serializedState, size)
        })
    }
}

/// Makes a state of serialised bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DeSerializeFMUstate(
    c: *mut Component,
    serializedState: *const u8,
    size: usize,
    FMUstate: *mut *mut FmuState,
) -> Status {
    // SAFETY: null, or an instance, an array and a state of the master.
    unsafe {
        Component::call(c, "fmi2DeSerializeFMUstate", Phase::LIVE, |component| {
            component.deserialise(serializedState, size, FMUstate)
        })
    }
}

/// Returns the time reached.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealStatus(c: *mut Component, s: c_int, value: *mut f64) -> Status {
    if s != LAST_SUCCESSFUL_TIME {
        return Status::Discard;
    }
    // SAFETY: null, or an instance and a place of the master.
    unsafe {
        Component::call(c, "fmi2GetRealStatus", Phase::GET, |component| {
            *raw::place(value, "value")? = component.instance().time_s();
            Ok(())
        })
    }
}

/// Returns whether the FMU requests the end of the simulation, which it never does.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBooleanStatus(
    c: *mut Component,
    s: c_int,
    value: *mut c_int,
) -> Status {
    if s != TERMINATED {
        return Status::Discard;
    }
    // SAFETY: null, or an instance and a place of the master.
    unsafe {
        Component::call(c, "fmi2GetBooleanStatus", Phase::GET, |_| {
            *raw::place(value, "value")? = 0;
            Ok(())
        })
    }
}
