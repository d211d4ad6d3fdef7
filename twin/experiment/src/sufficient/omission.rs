//! Proof that what a scene leaves out changes nothing: it is put back once, and every kept signal
//! is the same bit for bit.

use std::collections::BTreeMap;

use serde::Serialize;
use twinrig_kernel::SimTime;
use twinrig_record::{Digest, Fingerprint};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::report::{Report, Status};
use twinrig_rig::run::observers::{RunLayouts, RunObserver};
use twinrig_runtime::Group;
use twinrig_scenario::{LeftOut, RecordSpec, Scenario, Setting};

use crate::error::Error;
use crate::sufficient::runs::{RunOptions, SufficiencyBuilder, run};
use crate::{Candidate, RunFailure};

/// Settings of a scene that computes what controller, boards and expectations read, and no more.
const LEAST: [[&str; 2]; 2] = [["record.signals", "[]"], ["record.frames", "\"0 Hz\""]];
/// Rate of poses in a complete recording \[Hz\].
const FRAMES: f64 = 25.0;

const GROUPS: [Group; 4] = [
    Group::Plant,
    Group::ProcessInputs,
    Group::ProcessOutputs,
    Group::Diagnostics,
];

/// Comparison of the least scene of a choice with one in which everything is computed and recorded.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OmissionProof {
    /// Verdict of the choice on the scenario's own expectations.
    pub verdict: &'static str,
    /// Parts that the least scene leaves out.
    pub left_out: Vec<LeftOut>,
    /// Number of signals that both scenes have.
    pub kept: usize,
    /// Number of signals that were put back.
    pub put_back: usize,
    /// Kept signals that changed.
    pub changed_signals: Vec<String>,
    /// Expectations whose verdict or margin changed.
    pub changed_expectations: Vec<String>,
}

/// Fingerprints of the signals of a run.
#[derive(Default)]
struct SignalDigests {
    /// Name, range of values and fingerprint of each signal of each group.
    groups: BTreeMap<usize, Vec<(String, std::ops::Range<usize>, Fingerprint)>>,
}

fn index(group: Group) -> usize {
    GROUPS
        .iter()
        .position(|&other| other == group)
        .unwrap_or(GROUPS.len())
}

impl RunObserver for SignalDigests {
    fn begin(&mut self, layouts: &RunLayouts<'_>) {
        for group in GROUPS {
            let fields = layouts.layout(group).fields();
            let digests = fields.map(|field| {
                let name = field.port.name.clone();
                (name, field.range(), Fingerprint::new())
            });
            self.groups.insert(index(group), digests.collect());
        }
    }

    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        let number = index(group);
        for (_, range, digest) in self.groups.get_mut(&number).into_iter().flatten() {
            if let Some(values) = values.get(range.clone()) {
                // Groups are distinguished by the map.
                digest.sample(now.as_nanos(), 0, values);
            }
        }
    }
}

impl SignalDigests {
    fn finished(&self) -> BTreeMap<(usize, &str), Digest> {
        let groups = self.groups.iter();
        let signals = groups.flat_map(|(&group, signals)| {
            let signals = signals.iter();
            signals.map(move |(name, _, digest)| ((group, name.as_str()), digest.digest()))
        });
        signals.collect()
    }
}

impl OmissionProof {
    /// Runs a choice with the least scene and with everything computed and recorded.
    ///
    /// # Errors
    /// One of the runs cannot start or does not complete.
    pub fn of(builder: &SufficiencyBuilder<'_>, choice: &Candidate) -> Result<Self, Error> {
        let least = LEAST.map(|[key, value]| Setting {
            origin: "--sufficient".to_owned(),
            key: key.to_owned(),
            value: value.to_owned(),
        });
        let least = builder.assembly(choice, &least)?;
        let scenario = least.scenario();
        let everything = Scenario {
            record: RecordSpec {
                signals: None,
                frames: Some(FRAMES),
                bytes: true,
            },
            ..scenario.clone()
        };
        let outputs = least.plant_outputs().iter();
        let outputs: Vec<String> = outputs.map(|port| port.name.clone()).collect();
        let complete = least.with_scenario(&everything, &outputs)?;
        let (reduced, reduced_digests) = observed(&least, false)?;
        let (full, full_digests) = observed(&complete, true)?;
        Ok(Self::compare(
            least.scene().left_out.clone(),
            (&reduced, &reduced_digests),
            (&full, &full_digests),
        ))
    }

    fn compare(
        left_out: Vec<LeftOut>,
        (reduced, reduced_digests): (&Report, &SignalDigests),
        (full, full_digests): (&Report, &SignalDigests),
    ) -> Self {
        let (kept, all) = (reduced_digests.finished(), full_digests.finished());
        let changed = kept
            .iter()
            .filter(|(key, digest)| all.get(key) != Some(digest));
        let changed = changed.map(|((_, name), _)| (*name).to_owned());
        let mut changed_signals: Vec<String> = changed.collect();
        changed_signals.dedup();
        let pairs = reduced.expectations.iter().zip(&full.expectations);
        let changed = pairs.filter(|(a, b)| {
            let bits = |margin: Option<f64>| margin.map(f64::to_bits);
            a.outcome.verdict != b.outcome.verdict
                || bits(a.outcome.margin) != bits(b.outcome.margin)
        });
        Self {
            verdict: reduced.verdict.key(),
            left_out,
            kept: kept.len(),
            put_back: all.len().saturating_sub(kept.len()),
            changed_signals,
            changed_expectations: changed.map(|(line, _)| line.outcome.name.clone()).collect(),
        }
    }

    /// Returns whether nothing kept changed.
    pub fn holds(&self) -> bool {
        self.changed_signals.is_empty() && self.changed_expectations.is_empty()
    }

    /// Returns whether the choice passes.
    pub fn passes(&self) -> bool {
        self.verdict == Status::Pass.key()
    }
}

/// Runs a scene and returns the fingerprints of its signals.
fn observed(assembly: &Assembly<'_>, is_recorded: bool) -> Result<(Report, SignalDigests), Error> {
    let mut digests = SignalDigests::default();
    let options = RunOptions {
        start: 0,
        limit_s: f64::INFINITY,
        is_recorded,
        observer: Some(&mut digests),
    };
    let ran = run(assembly, options);
    let (report, _) = ran.map_err(|failure: RunFailure| Error::NoSufficiency {
        file: assembly.scenario().file.clone(),
        why: format!("the run of the choice failed: {failure}"),
        help: "run the choice by `twin run` with the printed settings".to_owned(),
    })?;
    Ok((report, digests))
}
