//! The functions of FMI 3.0 without an effect: for types that no variable has, for other kinds of
//! FMUs, and for properties that the model description denies.

use std::ffi::{c_char, c_void};

use twinrig_rig::fmu::FmuError;

use crate::component::Component;
use crate::failure::{Failure, Status};
use crate::logger::{Callback, Log3, Logger, c_text};
use crate::phase::Phase;
use crate::raw;

/// Functions that read or set variables of a type that there is none of: of no variable they do
/// nothing, of any they fail.
macro_rules! without_variables {
    ($($call:ident($($argument:ty),*), $kind:literal;)*) => {$(
        /// Fails, unless called for no variable.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $call(
            instance: *mut Component,
            references: *const u32,
            length: usize,
            $(_: $argument),*
        ) -> Status {
            // SAFETY: null, or an instance and an array of the master.
            unsafe {
                Component::call(instance, stringify!($call), Phase::LIVE, |_| {
                    match raw::slice(references, length, "valueReferences")?.first() {
                        Some(&reference) => {
                            Err(FmuError::NoSuchVariable { kind: $kind, reference }.into())
                        }
                        None => Ok(()),
                    }
                })
            }
        }
    )*};
}

without_variables! {
    fmi3GetFloat32(*mut f32, usize), "Float32";
    fmi3GetInt8(*mut i8, usize), "Int8";
    fmi3GetUInt8(*mut u8, usize), "UInt8";
    fmi3GetInt16(*mut i16, usize), "Int16";
    fmi3GetUInt16(*mut u16, usize), "UInt16";
    fmi3GetInt32(*mut i32, usize), "Int32";
    fmi3GetUInt32(*mut u32, usize), "UInt32";
    fmi3GetInt64(*mut i64, usize), "Int64";
    fmi3GetUInt64(*mut u64, usize), "UInt64";
    fmi3GetBoolean(*mut bool, usize), "Boolean";
    fmi3GetBinary(*mut usize, *mut *const u8, usize), "Binary";
    fmi3GetClock(*mut bool), "Clock";
    fmi3SetFloat32(*const f32, usize), "Float32";
    fmi3SetInt8(*const i8, usize), "Int8";
    fmi3SetUInt8(*const u8, usize), "UInt8";
    fmi3SetInt16(*const i16, usize), "Int16";
    fmi3SetUInt16(*const u16, usize), "UInt16";
    fmi3SetInt32(*const i32, usize), "Int32";
    fmi3SetUInt32(*const u32, usize), "UInt32";
    fmi3SetInt64(*const i64, usize), "Int64";
    fmi3SetUInt64(*const u64, usize), "UInt64";
    fmi3SetBoolean(*const bool, usize), "Boolean";
    fmi3SetString(*const *const c_char, usize), "input of type String";
    fmi3SetBinary(*const usize, *const *const u8, usize), "Binary";
    fmi3SetClock(*const bool), "Clock";
    fmi3GetIntervalDecimal(*mut f64, *mut i32), "Clock";
    fmi3GetIntervalFraction(*mut u64, *mut u64, *mut i32), "Clock";
    fmi3GetShiftDecimal(*mut f64), "Clock";
    fmi3GetShiftFraction(*mut u64, *mut u64), "Clock";
    fmi3SetIntervalDecimal(*const f64), "Clock";
    fmi3SetIntervalFraction(*const u64, *const u64), "Clock";
    fmi3SetShiftDecimal(*const f64), "Clock";
    fmi3SetShiftFraction(*const u64, *const u64), "Clock";
    fmi3GetOutputDerivatives(*const i32, *mut f64, usize), "derivative of a Float64";
}

/// Functions that fail.
macro_rules! unsupported {
    ($($call:ident($($argument:ty),*), $why:expr;)*) => {$(
        /// Fails: the model description does not offer it.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $call(instance: *mut Component, $(_: $argument),*) -> Status {
            // SAFETY: null, or an instance of the master.
            unsafe {
                Component::call(instance, stringify!($call), Phase::LIVE, |_| {
                    Err(Failure::Unsupported { why: $why })
                })
            }
        }
    )*};
}

const NO_EVENTS: &str = "it has no event mode";
const NO_CONFIGURATION: &str = "it has no structural parameters";
const NO_DERIVATIVES: &str = "it has no directional derivatives";
const NO_DEPENDENCIES: &str = "its dependencies are in the model description";
const NO_EXCHANGE: &str = "it is not for model exchange";
const NO_SCHEDULE: &str = "it is not for scheduled execution";

unsupported! {
    fmi3EnterEventMode(), NO_EVENTS;
    fmi3EnterStepMode(), NO_EVENTS;
    fmi3EvaluateDiscreteStates(), NO_EVENTS;
    fmi3UpdateDiscreteStates(
        *mut bool, *mut bool, *mut bool, *mut bool, *mut bool, *mut f64
    ), NO_EVENTS;
    fmi3EnterConfigurationMode(), NO_CONFIGURATION;
    fmi3ExitConfigurationMode(), NO_CONFIGURATION;
    fmi3GetNumberOfVariableDependencies(u32, *mut usize), NO_DEPENDENCIES;
    fmi3GetVariableDependencies(
        u32, *mut usize, *mut u32, *mut usize, *mut i32, usize
    ), NO_DEPENDENCIES;
    fmi3GetDirectionalDerivative(
        *const u32, usize, *const u32, usize, *const f64, usize, *mut f64, usize
    ), NO_DERIVATIVES;
    fmi3GetAdjointDerivative(
        *const u32, usize, *const u32, usize, *const f64, usize, *mut f64, usize
    ), NO_DERIVATIVES;
    fmi3EnterContinuousTimeMode(), NO_EXCHANGE;
    fmi3CompletedIntegratorStep(bool, *mut bool, *mut bool), NO_EXCHANGE;
    fmi3SetTime(f64), NO_EXCHANGE;
    fmi3SetContinuousStates(*const f64, usize), NO_EXCHANGE;
    fmi3GetContinuousStateDerivatives(*mut f64, usize), NO_EXCHANGE;
    fmi3GetEventIndicators(*mut f64, usize), NO_EXCHANGE;
    fmi3GetContinuousStates(*mut f64, usize), NO_EXCHANGE;
    fmi3GetNominalsOfContinuousStates(*mut f64, usize), NO_EXCHANGE;
    fmi3GetNumberOfEventIndicators(*mut usize), NO_EXCHANGE;
    fmi3GetNumberOfContinuousStates(*mut usize), NO_EXCHANGE;
    fmi3ActivateModelPartition(u32, f64), NO_SCHEDULE;
}

/// Refuses an instance for model exchange.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateModelExchange(
    _name: *const c_char,
    _token: *const c_char,
    _path: *const c_char,
    _visible: bool,
    _logging: bool,
    environment: *mut c_void,
    log: Option<Log3>,
) -> *mut Component {
    refuse(
        "fmi3InstantiateModelExchange",
        environment,
        log,
        NO_EXCHANGE,
    )
}

/// Refuses an instance for scheduled execution.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateScheduledExecution(
    _name: *const c_char,
    _token: *const c_char,
    _path: *const c_char,
    _visible: bool,
    _logging: bool,
    environment: *mut c_void,
    log: Option<Log3>,
    _clock_update: *const c_void,
    _lock: *const c_void,
    _unlock: *const c_void,
) -> *mut Component {
    let call = "fmi3InstantiateScheduledExecution";
    refuse(call, environment, log, NO_SCHEDULE)
}

fn refuse(
    call: &str,
    environment: *mut c_void,
    log: Option<Log3>,
    why: &'static str,
) -> *mut Component {
    let logger = Logger {
        callback: Callback::Fmi3(log),
        environment,
        name: c_text(""),
    };
    Component::create(logger, call, || Err(Failure::Unsupported { why }))
}
