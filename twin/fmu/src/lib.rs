//! The library inside exported FMUs: the C interfaces of FMI 2.0 and 3.0 for co-simulation, over
//! [`twinrig::fmu::FmuInstance`].
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
mod raw;

#[cfg(test)]
mod tests;

/// Length of the marker.
const MARKER_BYTES: usize =
    twinrig::fmu::MARKER_START.len() + VERSION.len() + twinrig::fmu::MARKER_END.len();
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// By this the exporter recognises the library and its version.
#[used]
static MARKER: [u8; MARKER_BYTES] = marker();

const fn marker() -> [u8; MARKER_BYTES] {
    let parts = [
        twinrig::fmu::MARKER_START.as_bytes(),
        VERSION.as_bytes(),
        twinrig::fmu::MARKER_END.as_bytes(),
    ];
    let mut bytes = [0; MARKER_BYTES];
    let (mut part, mut length) = (0, 0);
    while part < parts.len() {
        let mut n = 0;
        while n < parts[part].len() {
            bytes[length] = parts[part][n];
            n += 1;
            length += 1;
        }
        part += 1;
    }
    bytes
}
