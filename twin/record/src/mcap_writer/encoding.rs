//! Records of MCAP files and their fields, little endian.

use std::collections::BTreeMap;

/// Appends a record, whose content `content` appends.
pub(super) fn record(to: &mut Vec<u8>, opcode: u8, content: impl FnOnce(&mut Vec<u8>)) {
    to.push(opcode);
    let length = to.len();
    put(to, [0; 8]);
    let start = to.len();
    content(to);
    let size = (to.len() - start) as u64;
    to[length..start].copy_from_slice(&size.to_le_bytes());
}

/// Appends the bytes of a number.
pub(super) fn put<const N: usize>(to: &mut Vec<u8>, bytes: [u8; N]) {
    to.extend_from_slice(&bytes);
}

/// Appends bytes after their number.
pub(super) fn put_bytes(to: &mut Vec<u8>, bytes: &[u8]) {
    let count = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
    put(to, count.to_le_bytes());
    to.extend(bytes);
}

/// Appends a string.
pub(super) fn put_text(to: &mut Vec<u8>, text: &str) {
    put_bytes(to, text.as_bytes());
}

/// Appends a map of strings.
pub(super) fn put_map(to: &mut Vec<u8>, map: &BTreeMap<String, String>) {
    let mut bytes = Vec::new();
    for (key, value) in map {
        put_text(&mut bytes, key);
        put_text(&mut bytes, value);
    }
    put_bytes(to, &bytes);
}
