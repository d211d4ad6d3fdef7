//! Pointers of the master as references and slices.

use std::ffi::{CStr, c_char};

use crate::failure::Failure;

/// Checks that an array of the master can be a slice.
fn check<T>(pointer: *const T, length: usize, argument: &'static str) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::Null { argument });
    }
    if !pointer.is_aligned() {
        let alignment = align_of::<T>();
        return Err(Failure::Alignment {
            argument,
            alignment,
        });
    }
    let bytes = length.checked_mul(size_of::<T>());
    match bytes.map(isize::try_from) {
        Some(Ok(_)) => Ok(()),
        _ => Err(Failure::Length { argument, length }),
    }
}

/// Returns an array of the master, which may be null if it is empty.
///
/// # Safety
/// If it is neither null nor empty, `pointer` points to `length` values that live and are not
/// written during the call.
pub(crate) unsafe fn slice<'a, T>(
    pointer: *const T,
    length: usize,
    argument: &'static str,
) -> Result<&'a [T], Failure> {
    if length == 0 {
        return Ok(&[]);
    }
    check(pointer, length, argument)?;
    // SAFETY: not null, aligned, not longer than memory; the caller promises the rest.
    Ok(unsafe { std::slice::from_raw_parts(pointer, length) })
}

/// Returns an array of the master that is written.
///
/// # Safety
/// As [`slice`], and nothing else refers to the values during the call: arrays of one call do not
/// overlap. Every bit pattern is a value of `T`, since the master need not have written the array.
pub(crate) unsafe fn slice_mut<'a, T>(
    pointer: *mut T,
    length: usize,
    argument: &'static str,
) -> Result<&'a mut [T], Failure> {
    if length == 0 {
        return Ok(&mut []);
    }
    check(pointer, length, argument)?;
    // SAFETY: not null, aligned, not longer than memory; the caller promises the rest.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, length) })
}

/// Returns a value of the master that is written.
///
/// # Safety
/// If it is not null, `pointer` points to a value that lives during the call, and to which nothing
/// else refers.
pub(crate) unsafe fn place<'a, T>(
    pointer: *mut T,
    argument: &'static str,
) -> Result<&'a mut T, Failure> {
    check(pointer, 1, argument)?;
    // SAFETY: not null, and aligned; the caller promises the rest.
    Ok(unsafe { &mut *pointer })
}

/// Copies bytes to a buffer of the master, which may be longer.
pub(crate) fn write(bytes: &[u8], buffer: &mut [u8]) -> Result<(), Failure> {
    let (needed, given) = (bytes.len(), buffer.len());
    let place = buffer.get_mut(..needed);
    place
        .ok_or(Failure::Buffer { needed, given })?
        .copy_from_slice(bytes);
    Ok(())
}

/// Returns a text of the master.
///
/// # Safety
/// If it is not null, `pointer` points to a text that ends with a zero byte and lives during the
/// call.
pub(crate) unsafe fn text<'a>(
    pointer: *const c_char,
    argument: &'static str,
) -> Result<&'a str, Failure> {
    if pointer.is_null() {
        return Err(Failure::Null { argument });
    }
    // SAFETY: not null; the caller promises the rest.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| Failure::Text { argument })
}
