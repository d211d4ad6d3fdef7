//! Signals to plot, decimated, and the energy balance.

use serde::Serialize;
use twinrig_kernel::Unit;
use twinrig_runtime::EnergyBalance;

use crate::columns::{Column, Columns};
use crate::decimated::Decimation;
use crate::run::Run;

/// Signals that are sampled together.
#[derive(Debug, Serialize)]
pub(crate) struct Group {
    name: String,
    /// Times of the kept samples \[s\].
    times: Column,
    /// Samples for each one that is kept.
    factor: f64,
    signals: Vec<Signal>,
}

impl Group {
    /// Returns the names of the signals, and their numbers of components.
    pub(crate) fn signals(&self) -> impl Iterator<Item = (&str, usize)> {
        let signals = self.signals.iter();
        signals.map(|signal| (signal.name.as_str(), signal.values.len()))
    }

    /// Returns the number of samples for each one that is kept.
    pub(crate) fn factor(&self) -> f64 {
        self.factor
    }
}

/// A signal.
#[derive(Debug, Serialize)]
struct Signal {
    name: String,
    unit: String,
    /// Components.
    values: Vec<Column>,
}

/// Kept samples of all components together, and of one component: twice the points of a plot over
/// the width of a screen.
const SAMPLES: usize = 1_400_000;
const OF_COMPONENT: [usize; 2] = [600, 4000];

/// Returns the signals of one of `runs` runs, each group with its samples.
pub(crate) fn signals(run: &Run<'_>, runs: usize, columns: &mut Columns) -> Vec<Group> {
    let recording = run.shown();
    let groups = recording.groups();
    let components = |signals: &[twinrig_record::Signal]| -> usize {
        signals.iter().map(|signal| signal.size).sum()
    };
    let all: usize = groups.iter().map(|it| components(&it.signals)).sum();
    let most = (SAMPLES / runs.max(1) / all.max(1)).clamp(OF_COMPONENT[0], OF_COMPONENT[1]);
    let mut shown: Vec<Group> = Vec::new();
    for group in groups.iter().filter(|group| !group.is_empty()) {
        let times = recording.samples(group).map(|it| it.time.as_secs_f64());
        let times: Vec<f64> = times.collect();
        let decimation = Decimation::to(times.len(), most);
        let mut values = vec![Vec::with_capacity(times.len()); components(&group.signals)];
        for sample in recording.samples(group) {
            for (of, value) in values.iter_mut().zip(sample.all()) {
                of.push(value);
            }
        }
        let mut values = values.iter();
        let signals = group.signals.iter().map(|signal| Signal {
            name: signal.name.clone(),
            unit: signal.unit.clone(),
            values: values
                .by_ref()
                .take(signal.size)
                .map(|values| columns.add(&decimation.values(values)))
                .collect(),
        });
        let signals = signals.collect();
        shown.push(Group {
            name: group.name.clone(),
            times: columns.add_fine(&decimation.times(&times)),
            factor: decimation.factor(),
            signals,
        });
    }
    shown.extend(energy(run, columns));
    shown
}

type Term = fn(&EnergyBalance) -> f64;

/// Terms of the energy balance.
const TERMS: [(&str, Term); 5] = [
    ("actuators", |balance| balance.actuator),
    ("dissipated", |balance| balance.dissipated),
    ("impacts", |balance| balance.impact),
    ("exchanged", |balance| balance.exchanged),
    ("residual", |balance| balance.residual),
];

/// Returns the energy balance since the start of the run; none without a repetition.
fn energy(run: &Run<'_>, columns: &mut Columns) -> Option<Group> {
    let course = &run.repetition()?.course;
    let times: Vec<f64> = course.iter().map(|it| it.at.as_secs_f64()).collect();
    let terms = TERMS.map(|(name, term)| {
        let values: Vec<f64> = course.iter().map(|it| term(&it.energy)).collect();
        Signal {
            name: format!("{ENERGY}/{name}"),
            unit: Unit::Joule.symbol().to_owned(),
            values: vec![columns.add(&values)],
        }
    });
    let moves = course.iter().any(|it| it.energy.exchanged > 0.0);
    moves.then(|| Group {
        name: ENERGY.to_owned(),
        times: columns.add_fine(&times),
        factor: 1.0,
        signals: terms.into(),
    })
}

/// Name of the group of the energy balance.
const ENERGY: &str = "energy balance";
