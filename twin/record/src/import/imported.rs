//! A log in memory, with the signals that its mapping selects.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::Arc;

use serde::Serialize;
use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime, Unit};
use twinrig_runtime::Observer;

use super::mapping::{LogFormat, LogGroup};
use crate::{Cadence, Fingerprint, RecordError, RecordedGroup, Recorder, RunInfo, Skeleton};

/// Gaps that are listed, of each group.
const GAPS_LISTED: usize = 20;

/// A log that was read: the selected signals in SI units, at the times of the log.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedLog {
    /// Name of the file, without its folder.
    pub file: String,
    /// BLAKE3 of its bytes on disk, in hexadecimal digits.
    pub hash: String,
    /// Format.
    pub format: LogFormat,
    /// Name and text of the mapping.
    pub mapping: (String, String),
    /// Time of the log at which the recording begins \[ns\].
    pub origin_ns: i64,
    /// Rows or messages that were read.
    pub rows: u64,
    /// Rows that were left out, because a signal had no value yet.
    pub left_out: u64,
    /// Columns, with the number of rows in which the value of the row above was repeated.
    pub held: Vec<(String, u64)>,
    /// Optional columns that the log does not have.
    pub absent: Vec<String>,
    /// Settings of the plant: dotted keys and values in TOML.
    pub settings: Vec<(String, String)>,
    /// Remarks: names and texts.
    pub notes: Vec<(String, String)>,
    /// Size up to which a truncated file was read \[bytes\]; none of a complete one.
    pub truncated_at: Option<u64>,
    /// Groups of signals that are sampled together.
    pub groups: Vec<ImportedGroup>,
}

/// Signals of a log that are sampled together.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedGroup {
    /// Measured or commanded.
    pub group: LogGroup,
    /// Times of the samples, in order.
    pub times: Arc<Vec<SimTime>>,
    /// Signals; at least one.
    pub signals: Vec<ImportedSignal>,
    /// Intervals between samples; none of a single sample.
    pub periods: Option<LogPeriods>,
    /// Number of gaps, and the first of them.
    pub gaps: (usize, Vec<LogGap>),
}

/// A signal of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedSignal {
    /// Its path in the recording.
    pub name: String,
    /// Its unit.
    pub unit: Unit,
    /// A value for each sample.
    pub values: Vec<f64>,
}

impl ImportedSignal {
    /// Least and greatest value.
    pub fn range(&self) -> [f64; 2] {
        let empty = [f64::INFINITY, f64::NEG_INFINITY];
        let values = self.values.iter();
        values.fold(empty, |[least, most], &value| {
            [least.min(value), most.max(value)]
        })
    }
}

/// Quantiles of the intervals between samples \[ns\].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct LogPeriods {
    /// 1 % are at most this long.
    pub p1_ns: u64,
    /// Median.
    pub p50_ns: u64,
    /// 99 % are at most this long.
    pub p99_ns: u64,
    /// The longest.
    pub max_ns: u64,
}

/// An interval between samples that is longer than expected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct LogGap {
    /// Time of the sample before it \[ns\].
    pub start_ns: u64,
    /// Its length \[ns\].
    pub length_ns: u64,
}

impl ImportedGroup {
    /// Creates a group, and finds its gaps: intervals longer than `gap`, by default than ten times
    /// the median.
    pub(super) fn new(
        group: LogGroup,
        times: Arc<Vec<SimTime>>,
        signals: Vec<ImportedSignal>,
        gap: Option<SimDuration>,
    ) -> Self {
        let intervals = || {
            let pairs = times.iter().zip(times.iter().skip(1));
            pairs.map(|(before, after)| (before.as_nanos(), after.as_nanos() - before.as_nanos()))
        };
        let mut sorted: Vec<u64> = intervals().map(|(_, length)| length).collect();
        sorted.sort_unstable();
        let quantile = |percent: usize| sorted.get(sorted.len().saturating_sub(1) * percent / 100);
        let periods = sorted.last().map(|&max_ns| LogPeriods {
            p1_ns: quantile(1).copied().unwrap_or_default(),
            p50_ns: quantile(50).copied().unwrap_or_default(),
            p99_ns: quantile(99).copied().unwrap_or_default(),
            max_ns,
        });
        let usual = periods.map_or(0, |periods| periods.p50_ns.saturating_mul(10));
        let longest = gap.map_or(usual, SimDuration::as_nanos);
        let gaps = intervals().filter(|(_, length)| *length > longest);
        let listed = gaps.clone().take(GAPS_LISTED);
        let listed = listed.map(|(start_ns, length_ns)| LogGap {
            start_ns,
            length_ns,
        });
        Self {
            group,
            gaps: (gaps.clone().count(), listed.collect()),
            times,
            signals,
            periods,
        }
    }

    fn layout(&self) -> Layout {
        let port = |signal: &ImportedSignal| Port::output(&signal.name, signal.unit, 1);
        let ports: Vec<Port> = self.signals.iter().map(port).collect();
        Layout::of(&ports, Direction::Output)
    }
}

/// Prefix of the metadata of a recording whose values belong to the file of its robot or bench.
pub const SETTING_PREFIX: &str = "setting.";

impl ImportedLog {
    /// Time of the first and of the last sample.
    pub fn span(&self) -> [SimTime; 2] {
        let ends = |end: fn(&[SimTime]) -> Option<&SimTime>| {
            let groups = self.groups.iter();
            groups.filter_map(move |group| end(&group.times).copied())
        };
        let first = ends(<[SimTime]>::first).min();
        let last = ends(<[SimTime]>::last).max();
        [first, last].map(|time| time.unwrap_or(SimTime::ZERO))
    }

    /// Returns the metadata of the recording, beside those of a run: `log.*` about the file,
    /// `setting.KEY` with values in TOML, `note.NAME`.
    pub fn metadata(&self) -> BTreeMap<String, String> {
        let mut metadata = BTreeMap::new();
        let mut add = |key: &str, value: String| {
            metadata.insert(key.to_owned(), value);
        };
        add("log.file", self.file.clone());
        add("log.blake3", self.hash.clone());
        add("log.format", self.format.word().to_owned());
        add("log.mapping", self.mapping.0.clone());
        add("log.origin", format!("{} s", exact_seconds(self.origin_ns)));
        add("log.rows", self.rows.to_string());
        if self.left_out > 0 {
            add("log.left_out", self.left_out.to_string());
        }
        if let Some(bytes) = self.truncated_at {
            add("log.truncated_at", bytes.to_string());
        }
        for (column, count) in &self.held {
            add(&format!("log.held.{column}"), count.to_string());
        }
        for group in &self.groups {
            let (count, listed) = &group.gaps;
            if *count > 0 {
                let listed = serde_json::to_string(listed).unwrap_or_default();
                add(
                    &format!("log.gaps.{}", group.group.word()),
                    count.to_string(),
                );
                add(&format!("log.gap_list.{}", group.group.word()), listed);
            }
        }
        for (key, value) in &self.settings {
            add(&format!("{SETTING_PREFIX}{key}"), value.clone());
        }
        for (name, text) in &self.notes {
            add(&format!("note.{name}"), text.clone());
        }
        metadata
    }

    /// Writes the recording; `build` identifies the program. The mapping is attached.
    ///
    /// # Errors
    /// `out` cannot be written.
    pub fn write<W: Write>(&self, out: W, build: &str) -> Result<W, RecordError> {
        let layouts: Vec<Layout> = self.groups.iter().map(ImportedGroup::layout).collect();
        let pairs = self.groups.iter().zip(&layouts);
        let recorded = pairs.map(|(group, layout)| RecordedGroup {
            group: group.group.group(),
            layout,
            keep: &|_| true,
        });
        let recorded: Vec<RecordedGroup<'_>> = recorded.collect();
        let info = RunInfo {
            files: vec![(
                "mapping.toml".to_owned(),
                self.mapping.1.clone().into_bytes(),
            )],
            build: build.to_owned(),
            notes: self.metadata(),
            ..RunInfo::default()
        };
        let cadence = Cadence {
            frames: None,
            ..Cadence::default()
        };
        let mut recorder = Recorder::new(out, &info, &recorded, &Skeleton::default(), cadence)?;
        let mut fingerprint = Fingerprint::new();
        let mut values = Vec::new();
        let mut next = vec![0_usize; self.groups.len()];
        // The earliest sample of all groups; of those at one time the first group's.
        let earliest = |next: &[usize]| {
            let times = self.groups.iter().zip(next).enumerate();
            let times = times.filter_map(|(n, (group, &row))| Some((*group.times.get(row)?, n)));
            times.min()
        };
        while let Some((time, n)) = earliest(&next) {
            let (Some(group), Some(row)) = (self.groups.get(n), next.get_mut(n)) else {
                break;
            };
            values.clear();
            let columns = group.signals.iter().map(|signal| &signal.values);
            values.extend(columns.filter_map(|column| column.get(*row)));
            *row += 1;
            recorder.samples(time, group.group.group(), &values);
            fingerprint.samples(time, group.group.group(), &values);
            if recorder.failure().is_some() {
                break;
            }
        }
        let [_, last] = self.span();
        recorder.finish(fingerprint.digest(), last)
    }
}

/// Formats nanoseconds as seconds, with all digits that are not 0.
fn exact_seconds(nanos: i64) -> String {
    let sign = if nanos < 0 { "-" } else { "" };
    let nanos = nanos.unsigned_abs();
    let (whole, rest) = (nanos / 1_000_000_000, nanos % 1_000_000_000);
    let fraction = format!(".{rest:09}");
    let fraction = fraction.trim_end_matches(['0']).trim_end_matches('.');
    format!("{sign}{whole}{fraction}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_have_all_digits() {
        for (nanos, text) in [
            (0, "0"),
            (1_705_312_345_000_000_000, "1705312345"),
            (-1_500_000_000, "-1.5"),
            (1, "0.000000001"),
        ] {
            assert_eq!(exact_seconds(nanos), text);
        }
    }

    #[test]
    fn gaps_and_quantiles_are_those_of_the_intervals() {
        let millis = (0..100).map(|n| if n < 50 { n } else { n + 30 });
        let times: Vec<_> = millis.map(|n| SimTime::from_nanos(1_000_000 * n)).collect();
        let times = Arc::new(times);
        let of = |gap| ImportedGroup::new(LogGroup::Measured, Arc::clone(&times), vec![], gap);
        let group = of(None);
        let periods = group.periods.unwrap();
        assert_eq!((periods.p1_ns, periods.p50_ns), (1_000_000, 1_000_000));
        assert_eq!(periods.max_ns, 31_000_000);
        let gap = LogGap {
            start_ns: 49_000_000,
            length_ns: 31_000_000,
        };
        assert_eq!(group.gaps, (1, vec![gap]));
        assert_eq!(of(Some(SimDuration::from_millis(31))).gaps.0, 0);
    }
}
