//! From collected rows to a log: groups, origin of time, constants.

use std::sync::Arc;

use twinrig_document::{print_quantity, quoted};
use twinrig_kernel::SimTime;

use super::collect::{Collected, Collector};
use super::constant::{Changed, Constant};
use super::error::{LogFault, LogPlace};
use super::imported::{ImportedGroup, ImportedSignal};
use super::mapping::{LogGroup, LogMapping, LogOrigin, LogSetting, NoteText};

/// Fault with a place of its own.
pub(super) type Placed = (LogFault, Option<LogPlace>);

/// Latest beginning at which times are kept \[ns\].
const FIRST_HOUR: i64 = 3_600_000_000_000;
const SECOND: i64 = 1_000_000_000;
/// A hundred years.
const LONGEST: i64 = 100 * 31_557_600 * SECOND;

/// Returns the time of the log at which the recording begins \[ns\].
pub(super) fn origin(mapping: &LogMapping, sources: &[Collected]) -> i64 {
    let first = sources.iter().filter_map(|source| source.times.first());
    let first = first.min().copied().unwrap_or_default();
    let whole_second = first.div_euclid(SECOND).saturating_mul(SECOND);
    match mapping.origin {
        LogOrigin::Keep => 0,
        LogOrigin::Auto if (0..FIRST_HOUR).contains(&first) => 0,
        LogOrigin::Auto | LogOrigin::First => whole_second,
    }
}

/// Returns the groups of a log, and the number of samples left out of them.
pub(super) fn groups(
    mapping: &LogMapping,
    mut sources: Vec<Collected>,
    origin: i64,
) -> Result<(Vec<ImportedGroup>, u64), LogFault> {
    let mut shifted = Vec::new();
    for source in &mut sources {
        let times = std::mem::take(&mut source.times);
        let times = times.into_iter().map(|time| shift(time, origin));
        shifted.push(Arc::new(times.collect::<Result<Vec<SimTime>, _>>()?));
    }
    let (mut groups, mut left_out) = (Vec::new(), 0);
    for group in LogGroup::ALL {
        let mut parts = Vec::new();
        for (source, times) in sources.iter_mut().zip(&shifted) {
            let all = std::mem::take(&mut source.columns).into_iter();
            let is_of_group = |index: usize| {
                let signal = mapping.signals.get(index);
                signal.is_some_and(|signal| signal.group == group)
            };
            let (of_group, others) = all.partition(|(index, _)| is_of_group(*index));
            source.columns = others;
            let columns: Vec<(usize, Vec<f64>)> = of_group;
            if !columns.is_empty() {
                parts.push((Arc::clone(times), columns));
            }
        }
        let (times, mut columns, lost) = merged(parts);
        left_out += lost;
        if columns.is_empty() {
            continue;
        }
        columns.sort_by_key(|(index, _)| *index);
        let signals = columns.into_iter().filter_map(|(index, values)| {
            let signal = mapping.signals.get(index)?;
            Some(ImportedSignal {
                name: signal.name.value.clone(),
                unit: signal.conversion.unit.unit,
                values,
            })
        });
        groups.push(ImportedGroup::new(
            group,
            times,
            signals.collect(),
            mapping.gap,
        ));
    }
    Ok((groups, left_out))
}

fn shift(time: i64, origin: i64) -> Result<SimTime, LogFault> {
    let shifted = time.checked_sub(origin);
    let shifted = shifted.filter(|shifted| (0..LONGEST).contains(shifted));
    let nanos = shifted.and_then(|shifted| u64::try_from(shifted).ok());
    nanos
        .map(SimTime::from_nanos)
        .ok_or_else(|| LogFault::TimeRange {
            value: format!("{} s", time as f64 / 1e9),
        })
}

/// Columns: positions of signals in the mapping, with their values.
type Columns = Vec<(usize, Vec<f64>)>;
/// Times and columns of a part of a group.
type Part = (Arc<Vec<SimTime>>, Columns);

/// Merges the parts of a group: at each time of any part there is a sample, with the last values of
/// the others. Samples before all parts have begun are left out and counted.
fn merged(mut parts: Vec<Part>) -> (Arc<Vec<SimTime>>, Columns, u64) {
    if parts.len() <= 1 {
        let (times, columns) = parts.pop().unwrap_or_default();
        return (times, columns, 0);
    }
    let mut times: Vec<SimTime> = Vec::new();
    for (part, _) in &parts {
        times.extend(part.iter());
    }
    times.sort_unstable();
    times.dedup();
    let begin = parts.iter().filter_map(|(times, _)| times.first()).max();
    let lost = begin.map_or(0, |begin| times.partition_point(|time| time < begin));
    times.drain(..lost);
    let mut columns = Vec::new();
    for (part, of_part) in parts {
        for (index, values) in of_part {
            let mut row = 0;
            let held = times.iter().filter_map(|time| {
                while part.get(row + 1).is_some_and(|next| next <= time) {
                    row += 1;
                }
                values.get(row).copied()
            });
            columns.push((index, held.collect()));
        }
    }
    (Arc::new(times), columns, lost as u64)
}

/// Constants of a log, in the order of [`LogMapping::constants`].
pub(super) struct Constants {
    outside: Vec<Option<Constant>>,
    inside: Vec<Option<(Constant, Option<Changed>)>>,
    names: Vec<String>,
}

impl Constants {
    /// Takes the constants out of a collector.
    pub(super) fn of(collector: &mut Collector<'_>) -> Self {
        Self {
            outside: std::mem::take(&mut collector.outside),
            inside: std::mem::take(&mut collector.inside),
            names: collector.names.clone(),
        }
    }

    /// Returns a constant; one outside of the rows has precedence.
    fn get(&self, index: usize, column: &str) -> Result<Option<&Constant>, Placed> {
        if let Some(Some(constant)) = self.outside.get(index) {
            return Ok(Some(constant));
        }
        match self.inside.get(index) {
            Some(Some((first, Some(changed)))) => {
                let fault = LogFault::NotConstant {
                    column: column.to_owned(),
                    first: first.written.clone(),
                    other: changed.other.clone(),
                };
                let row = Some(changed.row);
                let line = changed.line;
                Err((fault, Some(LogPlace { line, row })))
            }
            Some(Some((constant, None))) => Ok(Some(constant)),
            _ => Ok(None),
        }
    }

    /// Returns the settings: dotted keys and values in TOML.
    pub(super) fn settings(&self, mapping: &LogMapping) -> Result<Vec<(String, String)>, Placed> {
        let mut settings = Vec::new();
        for (index, setting) in mapping.settings.iter().enumerate() {
            match self.get(index, &setting.column)? {
                Some(constant) => {
                    let value = toml(setting, constant).map_err(|fault| (fault, None))?;
                    settings.push((setting.key.value.clone(), value));
                }
                None if setting.is_optional => {}
                None => {
                    let column = setting.column.clone();
                    let known = self.names.clone();
                    return Err((LogFault::MissingColumn { column, known }, None));
                }
            }
        }
        Ok(settings)
    }

    /// Returns the remarks: names and texts.
    pub(super) fn notes(&self, mapping: &LogMapping) -> Result<Vec<(String, String)>, Placed> {
        let mut notes = Vec::new();
        let mut index = mapping.settings.len();
        for note in &mapping.notes {
            let name = &note.name.value;
            match &note.text {
                NoteText::Text(text) => notes.push((name.clone(), text.clone())),
                NoteText::Column(column) => {
                    let constant = self.get(index, column)?;
                    index += 1;
                    let text = constant.map(|constant| constant.written.clone());
                    notes.extend(text.map(|text| (name.clone(), text)));
                }
            }
        }
        Ok(notes)
    }
}

/// Returns the value of a setting in TOML.
fn toml(setting: &LogSetting, constant: &Constant) -> Result<String, LogFault> {
    let wrong = || LogFault::WrongType {
        column: setting.column.clone(),
        found: format!("`{}`", constant.written),
        expected: "a finite number",
    };
    match (setting.unit, constant.number) {
        (Some(unit), Some(number)) if !constant.is_boolean && number.is_finite() => {
            let text = print_quantity(unit.to_si(number), unit.unit);
            let is_plain = text.parse::<f64>().is_ok();
            Ok(if is_plain { text } else { quoted(&text) })
        }
        (Some(_), _) => Err(wrong()),
        (None, Some(number)) if !constant.is_boolean => {
            let finite = number.is_finite().then(|| number.to_string());
            finite.ok_or_else(wrong)
        }
        (None, Some(_)) => Ok(constant.written.clone()),
        (None, None) => Ok(quoted(&constant.written)),
    }
}
