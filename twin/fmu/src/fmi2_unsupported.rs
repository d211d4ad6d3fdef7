//! The functions of FMI 2.0 without an effect: for types that no variable has, and for properties
//! that the model description denies.

use std::ffi::{c_char, c_int};

use twinrig_rig::fmu::FmuError;

use crate::component::Component;
use crate::failure::{Failure, Status};
use crate::phase::Phase;
use crate::raw;

/// Functions that read or set variables of a type that there is none of: of no variable they do
/// nothing, of any they fail.
macro_rules! without_variables {
    ($($call:ident, $kind:literal, $value:ty;)*) => {$(
        /// Fails, unless called for no variable.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $call(
            c: *mut Component,
            vr: *const u32,
            nvr: usize,
            _value: $value,
        ) -> Status {
            // SAFETY: null, or an instance and an array of the master.
            unsafe {
                Component::call(c, stringify!($call), Phase::LIVE, |_| {
                    match raw::slice(vr, nvr, "vr")?.first() {
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
    fmi2GetInteger, "Integer", *mut c_int;
    fmi2GetBoolean, "Boolean", *mut c_int;
    fmi2SetInteger, "Integer", *const c_int;
    fmi2SetBoolean, "Boolean", *const c_int;
    fmi2SetString, "input of type String", *const *const c_char;
}

/// Functions that fail.
macro_rules! unsupported {
    ($($call:ident($($argument:ty),*), $why:literal;)*) => {$(
        /// Fails: the model description does not offer it.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $call(c: *mut Component, $(_: $argument),*) -> Status {
            // SAFETY: null, or an instance of the master.
            unsafe {
                Component::call(c, stringify!($call), Phase::LIVE, |_| {
                    Err(Failure::Unsupported { why: $why })
                })
            }
        }
    )*};
}

unsupported! {
    fmi2GetDirectionalDerivative(
        *const u32, usize, *const u32, usize, *const f64, *mut f64
    ), "it has no directional derivatives";
    fmi2SetRealInputDerivatives(
        *const u32, usize, *const c_int, *const f64
    ), "it does not interpolate inputs";
    fmi2GetRealOutputDerivatives(
        *const u32, usize, *const c_int, *mut f64
    ), "it has no derivatives of outputs";
    fmi2CancelStep(), "a step has ended when its call returns";
}

/// Status of asynchronous steps, of which there are none.
macro_rules! without_status {
    ($($call:ident, $value:ty;)*) => {$(
        /// Returns no status: a step has ended when its call returns.
        #[unsafe(no_mangle)]
        pub extern "C" fn $call(_c: *mut Component, _s: c_int, _value: $value) -> Status {
            Status::Discard
        }
    )*};
}

without_status! {
    fmi2GetStatus, *mut c_int;
    fmi2GetIntegerStatus, *mut c_int;
    fmi2GetStringStatus, *mut *const c_char;
}
