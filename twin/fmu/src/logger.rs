//! The logger of the master.

use std::ffi::{CString, c_char, c_int, c_void};

use crate::failure::Status;

/// Logger of FMI 2.0: environment, instance, status, category, format with its arguments.
pub(crate) type Log2 =
    unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...);

/// Logger of FMI 3.0: environment, status, category, message.
pub(crate) type Log3 = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);

/// Logger of one instance.
pub(crate) struct Logger {
    pub(crate) callback: Callback,
    /// Pointer of the master that its callback receives.
    pub(crate) environment: *mut c_void,
    /// Name of the instance.
    pub(crate) name: CString,
}

/// Callback of either version, if the master has one.
pub(crate) enum Callback {
    Fmi2(Option<Log2>),
    Fmi3(Option<Log3>),
}

impl Logger {
    /// Passes a message to the master.
    pub(crate) fn log(&self, status: Status, message: &str) {
        let category = match status {
            Status::Discard => c"logStatusDiscard",
            Status::Fatal => c"logStatusFatal",
            _ => c"logStatusError",
        };
        match self.callback {
            Callback::Fmi2(Some(log)) => {
                // The message is a format of `printf`, with value references between `#`.
                let message = c_text(&message.replace('%', "%%").replace('#', "##"));
                // SAFETY: a function of this type, which the master keeps until it has freed the
                // instance; the texts live during the call, and the format has no arguments.
                unsafe {
                    log(
                        self.environment,
                        self.name.as_ptr(),
                        status as c_int,
                        category.as_ptr(),
                        message.as_ptr(),
                    );
                }
            }
            Callback::Fmi3(Some(log)) => {
                let message = c_text(message);
                // SAFETY: as above.
                unsafe {
                    log(
                        self.environment,
                        status as c_int,
                        category.as_ptr(),
                        message.as_ptr(),
                    );
                }
            }
            Callback::Fmi2(None) | Callback::Fmi3(None) => {}
        }
    }
}

/// Returns a text for C, which has no zero bytes inside.
pub(crate) fn c_text(text: &str) -> CString {
    CString::new(text.replace('\0', "")).unwrap_or_default()
}
