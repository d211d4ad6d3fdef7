//! Times of ROS in JSON: objects with seconds and nanoseconds.

use super::cell::Cell;
use super::error::LogFault;
use super::json::JsonReader;
use super::paths::{self, Receiver, Sought};

/// Names of the parts of a time, in versions 2 and 1 of ROS.
const NAMES: [(&str, usize); 5] = [
    ("sec", 0),
    ("secs", 0),
    ("nanosec", 1),
    ("nsec", 1),
    ("nsecs", 1),
];

/// Reads an object or a list as a time.
pub(super) fn read(reader: &mut JsonReader<'_, '_>) -> Result<Cell<'static>, LogFault> {
    let mut stamp = Stamp([None; 2]);
    let sought = NAMES.map(|(name, slot)| Sought {
        path: name.to_owned(),
        slot,
    });
    paths::read(reader, &sought, &mut stamp)?;
    let [Some(seconds), Some(nanos)] = stamp.0 else {
        return Ok(Cell::Composite("an object without `sec` and `nanosec`"));
    };
    let whole = seconds.checked_mul(1_000_000_000);
    let nanos = whole.and_then(|whole| whole.checked_add(nanos));
    Ok(Cell::Nanos(nanos.unwrap_or(i128::MAX)))
}

/// Seconds and nanoseconds of a time.
struct Stamp([Option<i128>; 2]);

impl Receiver for Stamp {
    fn cell(&mut self, slot: usize, cell: Cell<'_>) -> Result<(), LogFault> {
        if let (Cell::Digits(digits), Some(part)) = (cell, self.0.get_mut(slot)) {
            *part = digits.parse().ok();
        }
        Ok(())
    }
}
