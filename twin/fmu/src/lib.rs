//! The library inside exported FMUs: the C interfaces of FMI 2.0 and 3.0 for co-simulation, over
//! [`twinrig_rig::fmu::FmuInstance`].
//!
//! Every exported function checks its pointers, lengths and the state of the instance, catches
//! panics, and reports errors to the logger of the master. There is no global state: instances are
//! independent, and may be on threads of their own.
//!
//! Out of scope: model exchange, scheduled execution, event mode, derivatives of inputs and
//! outputs, asynchronous steps. Their functions exist and return an error.

mod component;
mod failure;
mod fmi2;
mod fmi2_unsupported;
mod fmi3;
mod fmi3_unsupported;
mod logger;
mod phase;
mod raw;

#[cfg(test)]
mod tests;

const LENGTH: usize = twinrig_rig::fmu::MARKER.len();

/// By this the exporter recognises the library and its version.
#[used]
static MARKER: [u8; LENGTH] = reversed(twinrig_rig::fmu::MARKER.as_bytes());

const fn reversed(bytes: &[u8]) -> [u8; LENGTH] {
    let mut reversed = [0; LENGTH];
    let mut n = 0;
    while n < LENGTH {
        reversed[n] = bytes[LENGTH - 1 - n];
        n += 1;
    }
    reversed
}
