//! Values at paths of JSON: columns of rows, constants beside them, fields of messages.

use super::cell::Cell;
use super::error::LogFault;
use super::json::{JsonReader, Next};

/// A value that is sought: its path in dots, and its number. A key with dots in it is found, too.
#[derive(Debug, Clone)]
pub(super) struct Sought {
    pub path: String,
    pub slot: usize,
}

/// A path of which a part remains behind the present key.
#[derive(Clone, Copy)]
struct Rest<'s> {
    path: &'s str,
    slot: usize,
}

/// Receiver of values and of keys at the top.
pub(super) trait Receiver {
    /// Takes the value of a slot.
    ///
    /// # Errors
    /// The value is refused.
    fn cell(&mut self, slot: usize, cell: Cell<'_>) -> Result<(), LogFault>;

    /// Takes a list or an object in the place of a value, which it reads; `false` if it does not.
    ///
    /// # Errors
    /// The value is refused.
    fn composite(
        &mut self,
        _slot: usize,
        _reader: &mut JsonReader<'_, '_>,
    ) -> Result<bool, LogFault> {
        Ok(false)
    }

    /// Takes the name of a key, for suggestions.
    fn key(&mut self, _key: &str) {}
}

/// Reads a value and passes those that are sought to `receiver`.
pub(super) fn read(
    reader: &mut JsonReader<'_, '_>,
    sought: &[Sought],
    receiver: &mut impl Receiver,
) -> Result<(), LogFault> {
    let rests: Vec<Rest<'_>> = sought
        .iter()
        .map(|sought| Rest {
            path: &sought.path,
            slot: sought.slot,
        })
        .collect();
    below(reader, &rests, receiver, true)
}

fn below(
    reader: &mut JsonReader<'_, '_>,
    rests: &[Rest<'_>],
    receiver: &mut impl Receiver,
    is_top: bool,
) -> Result<(), LogFault> {
    let kind = reader.kind()?;
    if kind == Next::Scalar || rests.is_empty() {
        return reader.pass();
    }
    reader.enter()?;
    let mut count = 0_usize;
    let mut found = Vec::new();
    loop {
        found.clear();
        if kind == Next::Object {
            if !reader.next_key(count == 0)? {
                return Ok(());
            }
            let key = reader.key();
            found.extend(rests.iter().filter_map(|rest| behind(*rest, key)));
            if is_top {
                receiver.key(key);
            }
        } else {
            if !reader.next_element(count == 0)? {
                return Ok(());
            }
            let index = count.to_string();
            found.extend(rests.iter().filter_map(|rest| behind(*rest, &index)));
        }
        count += 1;
        value(reader, &found, receiver)?;
    }
}

/// Reads the value of a key; `found` has the paths that begin with the key.
fn value(
    reader: &mut JsonReader<'_, '_>,
    found: &[Rest<'_>],
    receiver: &mut impl Receiver,
) -> Result<(), LogFault> {
    if found.is_empty() {
        return reader.pass();
    }
    let ends = |rest: &&Rest<'_>| rest.path.is_empty();
    let composite = match reader.kind()? {
        Next::Scalar => {
            let cell = reader.scalar()?;
            return found
                .iter()
                .filter(ends)
                .try_for_each(|rest| receiver.cell(rest.slot, cell));
        }
        Next::Object => "an object",
        Next::List => "a list",
    };
    for rest in found.iter().filter(ends) {
        if receiver.composite(rest.slot, reader)? {
            return Ok(());
        }
        receiver.cell(rest.slot, Cell::Composite(composite))?;
    }
    let deeper: Vec<Rest<'_>> = found.iter().filter(|rest| !ends(rest)).copied().collect();
    below(reader, &deeper, receiver, false)
}

/// Returns what remains of a path behind `key`; none if it does not begin with it. Elements of
/// lists are `list.0` or `list[0]`.
fn behind<'s>(rest: Rest<'s>, key: &str) -> Option<Rest<'s>> {
    let after = rest.path.strip_prefix(key)?;
    let path = match after.as_bytes().first() {
        None => after,
        Some(b'.' | b'[') => &after[1..],
        Some(b']') if rest.path.len() > after.len() => match after.as_bytes().get(1) {
            Some(b'.' | b'[') => &after[2..],
            _ => &after[1..],
        },
        Some(_) => return None,
    };
    Some(Rest { path, ..rest })
}
