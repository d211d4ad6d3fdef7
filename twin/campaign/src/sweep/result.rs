//! Result of a sweep: a function of its specification, scenario and build.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use serde::Serialize;
use twinrig_kernel::Unit;

use super::design::Design;
use super::log::RowPlace;
use super::partition::Partition;
use super::row::{RowKey, RowVerdict, SweepRow};
use super::share::{Share, ShareSpec, ShareVerdict};
use super::spec::SweepSpec;
use super::summary::RowSummary;
use super::value::SweepValue;

/// Verdict of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SweepVerdict {
    /// All shares pass; without shares, all runs.
    Pass,
    /// A share fails; without shares, a run.
    Fail,
    /// No share fails, and one is undecided.
    Undecided,
    /// The partition is complete; others are missing.
    Partial,
    /// The sweep was interrupted before its end.
    Interrupted,
    /// A run has an error.
    Error,
}

impl SweepVerdict {
    /// Returns the exit code.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Pass | Self::Partial => 0,
            Self::Fail | Self::Undecided => 1,
            Self::Interrupted | Self::Error => 2,
        }
    }

    /// Returns the word of reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Undecided => "undecided",
            Self::Partial => "partial",
            Self::Interrupted => "interrupted",
            Self::Error => "error",
        }
    }
}

/// A dimension with the key of the scenario.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResultDimension {
    /// Dotted key.
    pub key: String,
    /// Unit of its numbers; none where a value has no number.
    pub unit: Option<Unit>,
}

/// A point whose run is done.
#[derive(Clone, Debug, PartialEq)]
pub struct ResultRow {
    /// Number of the point, from 0.
    pub index: usize,
    /// A value for each dimension.
    pub point: Vec<SweepValue>,
    /// Key of the row.
    pub key: RowKey,
    /// Where the row is on disk.
    pub place: RowPlace,
    /// Summary of the row, which equal points share.
    pub summary: Arc<RowSummary>,
}

/// All of a run, which is on disk.
#[derive(Clone, Debug, PartialEq)]
pub struct CompleteRow {
    /// Command that repeats the run.
    pub command: String,
    /// Result of the run.
    pub row: SweepRow,
}

/// A run that does not pass.
#[derive(Clone, Debug, PartialEq)]
pub struct FailedRun {
    /// Name of its point.
    pub name: String,
    /// The run.
    pub run: CompleteRow,
}

/// Numbers of points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SweepCounts {
    /// All points of the design.
    pub points: usize,
    /// Runs that pass.
    pub pass: usize,
    /// Runs that fail.
    pub fail: usize,
    /// Runs with an error.
    pub error: usize,
    /// Points without a run.
    pub missing: usize,
}

/// Result of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepResult {
    /// Name of the sweep.
    pub name: String,
    /// File of the specification.
    pub spec: String,
    /// Name of the scenario.
    pub scenario: String,
    /// File of the scenario.
    pub file: String,
    /// Hash of the build.
    pub build: String,
    /// Settings of all runs: keys and values in TOML.
    pub settings: Vec<(String, String)>,
    /// Design.
    pub design: Design,
    /// Points of a trajectory of the design, if it has any.
    pub trajectory_points: Option<usize>,
    /// Names of the expectations with elementary effects; none for all.
    pub measures: Vec<String>,
    /// Partition of this call.
    pub partition: Partition,
    /// Dimensions, in the order of the specification.
    pub dimensions: Vec<ResultDimension>,
    /// Verdict.
    pub verdict: SweepVerdict,
    /// Numbers of points.
    pub counts: SweepCounts,
    /// Shares of the runs that are done.
    pub shares: Vec<Share>,
    /// Hash of all points and fingerprints; none if a point is missing.
    pub hash: Option<String>,
    /// Warning about shares that cannot pass; see [`SweepSpec::warning`].
    pub share_warning: Option<String>,
    /// Rows, in the order of the points.
    pub rows: Vec<ResultRow>,
    /// The first runs that do not pass, as far as readers want a list of them: those with an error,
    /// then those that fail.
    pub failures: Vec<FailedRun>,
}

impl SweepResult {
    /// Counts and judges the rows; all other fields are given in `self`.
    #[must_use]
    pub fn judged(mut self, spec: &SweepSpec, interrupted: bool) -> Self {
        let with = |verdict| {
            let rows = self.rows.iter();
            rows.filter(|row| row.summary.verdict == verdict).count()
        };
        self.counts = SweepCounts {
            points: spec.design.points,
            pass: with(RowVerdict::Pass),
            fail: with(RowVerdict::Fail),
            error: with(RowVerdict::Error),
            missing: spec.design.points - self.rows.len(),
        };
        let rows = || self.rows.iter().map(|row| &*row.summary);
        let share = |share: &ShareSpec| share.share(rows());
        self.shares = spec.shares.iter().map(share).collect();
        self.share_warning = spec.warning();
        self.hash = (self.counts.missing == 0).then(|| self.hash_of_rows());
        self.verdict = self.verdict_of_counts(interrupted);
        if self.counts.missing == 0 {
            // The result is that of all partitions.
            self.partition = Partition::WHOLE;
        }
        self
    }

    fn verdict_of_counts(&self, interrupted: bool) -> SweepVerdict {
        let counts = &self.counts;
        if interrupted && counts.missing > 0 {
            return SweepVerdict::Interrupted;
        }
        if counts.error > 0 {
            return SweepVerdict::Error;
        }
        if counts.missing > 0 {
            return SweepVerdict::Partial;
        }
        match self.shares.iter().map(|share| share.verdict).max() {
            Some(ShareVerdict::Pass) => SweepVerdict::Pass,
            Some(ShareVerdict::Undecided) => SweepVerdict::Undecided,
            None if counts.fail == 0 => SweepVerdict::Pass,
            Some(ShareVerdict::Fail) | None => SweepVerdict::Fail,
        }
    }

    /// Hash over the point and the fingerprint of each row, and whether it has an error. The build
    /// does not enter it: two builds with the same hash have the same runs, bit for bit.
    fn hash_of_rows(&self) -> String {
        let mut hasher = blake3::Hasher::new_derive_key("twinrig sweep, version 1");
        let mut add = |text: &str| {
            hasher.update(&(text.len() as u64).to_le_bytes());
            hasher.update(text.as_bytes());
        };
        for row in &self.rows {
            for (dimension, value) in self.dimensions.iter().zip(&row.point) {
                add(&dimension.key);
                add(&value.toml);
            }
            add(row.summary.fingerprint.as_deref().unwrap_or_default());
            // The text of an error has paths, which belong to the machine.
            add(if row.summary.has_error { "error" } else { "" });
        }
        hasher.finalize().to_hex().to_string()
    }

    /// Returns the keys of dimensions without effect: runs that differ in nothing else are equal,
    /// as those of several seeds in a scenario that draws no random number.
    pub fn without_effect(&self) -> Vec<&str> {
        let keys = self.dimensions.iter().enumerate();
        let keys = keys.filter(|(index, _)| self.has_no_effect(*index));
        keys.map(|(_, dimension)| dimension.key.as_str()).collect()
    }

    /// Whether there are runs that differ in one dimension only, and all such runs are equal.
    fn has_no_effect(&self, dimension: usize) -> bool {
        // The first value and fingerprint, by the values of all other dimensions.
        let mut runs: BTreeMap<Vec<&str>, (&SweepValue, &str)> = BTreeMap::new();
        let mut equal = false;
        for row in &self.rows {
            let Some(print) = row.summary.fingerprint.as_deref() else {
                continue;
            };
            let others = row.point.iter().enumerate();
            let others = others.filter(|(index, _)| *index != dimension);
            let mut key = Vec::with_capacity(self.dimensions.len());
            key.extend(others.map(|(_, value)| value.toml.as_str()));
            let value = &row.point[dimension];
            let (first, known) = runs.entry(key).or_insert((value, print));
            if *known != print {
                return false;
            }
            // Equal points have equal runs, whether or not the dimension has an effect.
            equal |= first.cell() != value.cell();
        }
        equal
    }

    /// Returns the runs that do not pass: those with an error, then those that fail.
    pub fn not_passed(&self) -> impl Iterator<Item = &ResultRow> {
        let of = |verdict: RowVerdict| {
            let rows = self.rows.iter();
            rows.filter(move |row| row.summary.verdict == verdict)
        };
        of(RowVerdict::Error).chain(of(RowVerdict::Fail))
    }

    /// Returns the name of a point, as in `JUnit` files: `trot@seed-17`.
    pub fn name_of(&self, row: &ResultRow) -> String {
        let keys: Vec<&str> = self.dimensions.iter().map(|it| it.key.as_str()).collect();
        point_name(&self.file, &keys, &row.point)
    }

    /// Returns the reason for a sweep without an answer.
    pub fn error(&self) -> Option<String> {
        let SweepCounts { error, missing, .. } = self.counts;
        match self.verdict {
            SweepVerdict::Error if error == 1 => Some("a run has an error".to_owned()),
            SweepVerdict::Error => Some(format!("{error} runs have an error")),
            SweepVerdict::Interrupted => Some(format!(
                "interrupted; {missing} points are missing, and the same command continues"
            )),
            _ => None,
        }
    }

    /// Returns all warnings, one a line.
    pub fn warning(&self) -> Option<String> {
        let effect = self.effect_warning();
        let warnings: Vec<&str> = [&self.share_warning, &effect]
            .into_iter()
            .filter_map(Option::as_deref)
            .collect();
        (!warnings.is_empty()).then(|| warnings.join("\n"))
    }

    /// Returns the warning about dimensions without effect.
    pub fn effect_warning(&self) -> Option<String> {
        let keys = self.without_effect();
        let keys: Vec<String> = keys.iter().map(|key| format!("`{key}`")).collect();
        (!keys.is_empty()).then(|| {
            format!(
                "{} has no effect: runs that differ in nothing else are equal, and their number is \
                 no evidence for the interval of a share",
                keys.join(", ")
            )
        })
    }
}

/// Returns the name of a point of the scenario in `file`: `trot@seed-17`.
pub fn point_name(file: &str, keys: &[&str], point: &[SweepValue]) -> String {
    let stem = Path::new(file).file_stem();
    let stem = stem.map_or_else(|| file.into(), |stem| stem.to_string_lossy());
    let values = keys.iter().zip(point).map(|(key, value)| {
        let last = key.rsplit('.').next().unwrap_or(key);
        let ends = |other: &&&str| other.rsplit('.').next() == Some(last);
        let key = match keys.iter().filter(ends).count() {
            1 => last,
            _ => key,
        };
        format!("{key}-{}", value.shown().replace(' ', ""))
    });
    format!("{stem}@{}", values.collect::<Vec<_>>().join(","))
}
