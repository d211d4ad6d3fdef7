//! Exported symbols.

use std::cell::RefCell;

thread_local! {
    /// Request of the host, and the answer to it.
    static BUFFER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

#[link(wasm_import_module = "host")]
unsafe extern "C" {
    /// Shows the part of the run that is done.
    safe fn progress(share: f64);
}

/// Returns the address of a request of `length` bytes.
#[unsafe(no_mangle)]
pub extern "C" fn reserve(length: usize) -> *mut u8 {
    BUFFER.with_borrow_mut(|buffer| {
        buffer.clear();
        buffer.resize(length, 0);
        buffer.as_mut_ptr()
    })
}

/// Runs the request; returns the length of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn run() -> usize {
    let request = BUFFER.take();
    let answer = crate::answer(&request, &mut |share| progress(share));
    // Numbers and texts can always be serialised.
    let answer = serde_json::to_vec(&answer).unwrap_or_default();
    let length = answer.len();
    BUFFER.set(answer);
    length
}

/// Returns the address of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    BUFFER.with_borrow(|buffer| buffer.as_ptr())
}
