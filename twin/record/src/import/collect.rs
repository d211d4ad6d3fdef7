//! Rows of a log: values of the selected columns, checked and converted as they arrive.

use super::cell::{self, Cell};
use super::constant::{Changed, Constant};
use super::error::LogFault;
use super::json::JsonReader;
use super::mapping::{LogMapping, LogSignal, MissingValues};
use super::paths::{Receiver, Sought};
use super::stamp;

/// Names that are kept for suggestions.
const NAMES_MOST: usize = 200;
/// A signal that is collected.
struct Column<'m> {
    signal: &'m LogSignal,
    /// Position among the signals of the mapping.
    index: usize,
    name: String,
    present: Option<f64>,
    /// Whether the column was in the row, perhaps without a value.
    was_seen: bool,
    /// Whether it was in any row.
    is_known: bool,
    is_absent: bool,
    values: Vec<f64>,
    held: u64,
}

/// Collector of the rows of a log, or of the messages of a topic.
pub(super) struct Collector<'m> {
    mapping: &'m LogMapping,
    columns: Vec<Column<'m>>,
    /// Time of the row \[ns\].
    time: Option<i64>,
    last_time: Option<i64>,
    times: Vec<i64>,
    /// Whether rows may be out of order, and are sorted at the end.
    sorts: bool,
    values_most: u64,
    /// Rows that were read, and those left out before all signals had a value.
    pub rows: u64,
    left_out: u64,
    /// Line of the present row.
    pub row_line: Option<u64>,
    /// Constants outside of the rows, and in them.
    pub outside: Vec<Option<Constant>>,
    pub inside: Vec<Option<(Constant, Option<Changed>)>>,
    /// Names in the first row.
    pub names: Vec<String>,
}

/// What was collected.
pub(super) struct Collected {
    /// Times of the rows \[ns\], in order.
    pub times: Vec<i64>,
    /// Positions of signals in the mapping, with their values.
    pub columns: Vec<(usize, Vec<f64>)>,
    /// Names of columns with the number of rows in which a value was repeated.
    pub held: Vec<(String, u64)>,
    /// Names of optional columns that were not there.
    pub absent: Vec<String>,
    pub rows: u64,
    pub left_out: u64,
}

impl<'m> Collector<'m> {
    /// Creates a collector of the signals that `is_selected` selects, of at most so many values.
    pub(super) fn new(
        mapping: &'m LogMapping,
        is_selected: impl Fn(&LogSignal) -> bool,
        values_most: u64,
    ) -> Self {
        let signals = mapping.signals.iter().enumerate();
        let columns = signals.filter(|(_, signal)| is_selected(signal));
        let column = |(index, signal): (usize, &'m LogSignal)| Column {
            signal,
            index,
            name: signal.column.name(),
            present: None,
            was_seen: false,
            is_known: false,
            is_absent: false,
            values: Vec::new(),
            held: 0,
        };
        let constants = mapping.constants().count();
        Self {
            mapping,
            columns: columns.map(column).collect(),
            time: None,
            last_time: None,
            times: Vec::new(),
            sorts: false,
            values_most,
            rows: 0,
            left_out: 0,
            row_line: None,
            outside: vec![None; constants],
            inside: vec![None; constants],
            names: Vec::new(),
        }
    }

    /// Lets rows be out of order.
    pub(super) fn sorting(mut self) -> Self {
        self.sorts = true;
        self
    }

    /// Returns the paths of the values of a row: of the time, the signals and the constants.
    pub(super) fn sought(&self) -> Vec<Sought> {
        let time = self.mapping.time.iter().map(String::as_str);
        let time = time.map(|path| (path, 0));
        let signals = self.columns.iter().map(|column| &column.signal.column.path);
        let signals = signals.map(|path| path.value.as_str()).zip(1..);
        let constants = self.mapping.constants().zip(1 + self.columns.len()..);
        let all = time.chain(signals).chain(constants);
        all.map(|(path, slot)| Sought {
            path: path.to_owned(),
            slot,
        })
        .collect()
    }

    /// Begins a row.
    pub(super) fn begin(&mut self, line: Option<u64>) {
        self.rows += 1;
        self.row_line = line;
        self.time = None;
        for column in &mut self.columns {
            column.present = None;
            column.was_seen = false;
        }
    }

    /// Sets the time of the row \[ns\].
    pub(super) fn set_time(&mut self, cell: Cell<'_>) -> Result<(), LogFault> {
        let name = self.mapping.time.as_deref().unwrap_or("time");
        let unit = self.mapping.time_unit;
        let range = || LogFault::TimeRange {
            value: cell.words(),
        };
        let seconds = |number: f64| {
            let nanos = (unit.to_si(number) * 1e9).round();
            let is_within = nanos.abs() < 9e18;
            #[expect(clippy::cast_possible_truncation, reason = "it is within the range")]
            is_within.then_some(nanos as i64)
        };
        let nanos = match (cell, unit.power_of_ten()) {
            (Cell::Nanos(nanos), _) => i64::try_from(nanos).ok(),
            (Cell::Digits(digits), Some(power)) => cell::rounded(digits, 9 + power),
            (Cell::Integer(whole), Some(power)) => cell::rounded(&whole.to_string(), 9 + power),
            (Cell::Number(number), _) if number.is_finite() => seconds(number),
            (Cell::Digits(_) | Cell::Integer(_), None) => cell.number().and_then(seconds),
            (Cell::Missing, _) => {
                let column = name.to_owned();
                return Err(LogFault::MissingValue { column });
            }
            _ => {
                return Err(LogFault::WrongType {
                    column: name.to_owned(),
                    found: cell.words(),
                    expected: "a time",
                });
            }
        };
        self.time = Some(nanos.ok_or_else(range)?);
        Ok(())
    }

    fn set_signal(&mut self, slot: usize, cell: Cell<'_>) -> Result<(), LogFault> {
        let Some(column) = self.columns.get_mut(slot) else {
            return Ok(());
        };
        column.was_seen = true;
        column.is_known = true;
        let name = &column.name;
        if column.is_absent {
            // It was not in the first row, and so is not recorded.
            let column = name.clone();
            return Err(LogFault::MissingValue { column });
        }
        if matches!(cell, Cell::Missing) {
            return Ok(());
        }
        let Some(number) = cell.number() else {
            return Err(LogFault::WrongType {
                column: name.clone(),
                found: cell.words(),
                expected: "a number",
            });
        };
        let holds = column.signal.missing == MissingValues::Hold;
        if number.is_nan() && holds {
            return Ok(());
        }
        if !number.is_finite() {
            return Err(LogFault::NotFinite {
                column: name.clone(),
                value: number,
            });
        }
        column.present = Some(column.signal.conversion.convert(number, name)?);
        Ok(())
    }

    fn set_constant(&mut self, index: usize, cell: Cell<'_>) {
        let (row, line) = (self.rows, self.row_line);
        let (Some(slot), Some(constant)) = (self.inside.get_mut(index), Constant::of(cell)) else {
            return;
        };
        match slot {
            None => *slot = Some((constant, None)),
            Some((first, changed @ None)) if *first != constant => {
                let other = constant.written;
                *changed = Some(Changed { other, row, line });
            }
            Some(_) => {}
        }
    }

    /// Sets a constant outside of the rows.
    pub(super) fn set_outside(&mut self, index: usize, cell: Cell<'_>) {
        if let (Some(slot), Some(constant)) = (self.outside.get_mut(index), Constant::of(cell)) {
            *slot = Some(constant);
        }
    }

    /// Ends a row, in which every value that it has was set.
    pub(super) fn end(&mut self) -> Result<(), LogFault> {
        let name = self.mapping.time.as_deref().unwrap_or("time");
        let missing = |name: &str, names: &[String]| LogFault::MissingColumn {
            column: name.to_owned(),
            known: names.to_vec(),
        };
        let time = match self.time {
            Some(time) => time,
            None if self.rows == 1 => return Err(missing(name, &self.names)),
            None => {
                let column = name.to_owned();
                return Err(LogFault::MissingValue { column });
            }
        };
        self.check_order(time)?;
        let mut is_complete = true;
        for column in &mut self.columns {
            if column.present.is_some() || column.is_absent {
                continue;
            }
            if self.rows == 1 && !column.was_seen && column.signal.is_optional {
                column.is_absent = true;
                continue;
            }
            if column.signal.missing == MissingValues::Error {
                return Err(if self.rows == 1 && !column.was_seen {
                    missing(&column.name, &self.names)
                } else {
                    let column = column.name.clone();
                    LogFault::MissingValue { column }
                });
            }
            column.present = column.values.last().copied();
            is_complete &= column.present.is_some();
            column.held += u64::from(column.present.is_some());
        }
        if is_complete {
            self.keep(time)
        } else {
            self.left_out += 1;
            Ok(())
        }
    }

    fn check_order(&mut self, time: i64) -> Result<(), LogFault> {
        let before = self.last_time.replace(time);
        match before {
            _ if self.sorts => Ok(()),
            Some(before) if time < before => Err(LogFault::TimeGoesBack { before, time }),
            Some(before) if time == before => Err(LogFault::SameTime { time }),
            _ => Ok(()),
        }
    }

    fn keep(&mut self, time: i64) -> Result<(), LogFault> {
        let width = 1 + self.columns.len() as u64;
        let most = self.values_most;
        if width.saturating_mul(1 + self.times.len() as u64) > most {
            return Err(LogFault::TooManyValues { most });
        }
        self.times.push(time);
        for column in &mut self.columns {
            column.values.extend(column.present);
        }
        Ok(())
    }

    /// Returns what was collected.
    ///
    /// # Errors
    /// No rows, no complete row, or two messages of one time.
    pub(super) fn finish(mut self) -> Result<Collected, LogFault> {
        if self.rows == 0 {
            return Err(LogFault::NoRows);
        }
        if self.times.is_empty() {
            let mut columns = self.columns.iter();
            let never = columns.find(|column| !column.is_absent && column.values.is_empty());
            let unknown = self.columns.iter().find(|column| !column.is_known);
            return Err(match (unknown, never) {
                (Some(column), _) => LogFault::MissingColumn {
                    column: column.name.clone(),
                    known: self.names,
                },
                (None, column) => LogFault::NoCompleteRow {
                    column: column.map_or_else(String::new, |column| column.name.clone()),
                },
            });
        }
        if self.sorts {
            self.sort()?;
        }
        let all = self.columns.into_iter();
        let (absent, present): (Vec<_>, Vec<_>) = all.partition(|column| column.is_absent);
        let held = present.iter().filter(|column| column.held > 0);
        Ok(Collected {
            held: held
                .map(|column| (column.name.clone(), column.held))
                .collect(),
            absent: absent.into_iter().map(|column| column.name).collect(),
            columns: present
                .into_iter()
                .map(|column| (column.index, column.values))
                .collect(),
            times: self.times,
            rows: self.rows,
            left_out: self.left_out,
        })
    }

    /// Sorts rows by time; messages of a file need not be in order.
    fn sort(&mut self) -> Result<(), LogFault> {
        if !self.times.is_sorted() {
            let mut order: Vec<usize> = (0..self.times.len()).collect();
            order.sort_by_key(|&row| self.times.get(row));
            let sorted = |values: &[f64]| -> Vec<f64> {
                order
                    .iter()
                    .filter_map(|&row| values.get(row).copied())
                    .collect()
            };
            for column in &mut self.columns {
                column.values = sorted(&column.values);
            }
            self.times.sort_unstable();
        }
        let mut pairs = self.times.iter().zip(self.times.iter().skip(1));
        let same = pairs.find(|(before, time)| before == time);
        same.map_or(Ok(()), |(_, &time)| Err(LogFault::SameTime { time }))
    }
}

impl Receiver for Collector<'_> {
    fn cell(&mut self, slot: usize, cell: Cell<'_>) -> Result<(), LogFault> {
        let Some(slot) = slot.checked_sub(1) else {
            return self.set_time(cell);
        };
        match slot.checked_sub(self.columns.len()) {
            None => self.set_signal(slot, cell),
            Some(constant) => {
                self.set_constant(constant, cell);
                Ok(())
            }
        }
    }

    /// Reads a time of ROS in JSON.
    fn composite(
        &mut self,
        slot: usize,
        reader: &mut JsonReader<'_, '_>,
    ) -> Result<bool, LogFault> {
        let is_time = slot == 0 && self.mapping.time.is_some();
        if !is_time || !self.mapping.has_topics() {
            return Ok(false);
        }
        self.set_time(stamp::read(reader)?)?;
        Ok(true)
    }

    fn key(&mut self, key: &str) {
        if self.rows == 1 && self.names.len() < NAMES_MOST {
            self.names.push(key.chars().take(100).collect());
        }
    }
}
