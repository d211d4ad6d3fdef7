//! Data of the scripts of a page.

use serde::Serialize;
use twinrig_kernel::signal;
use twinrig_record::{RecordError, VerdictMessage};

use crate::columns::Columns;
use crate::figure::Figure;
use crate::gait::{LegGait, gait};
use crate::incidents::{Incident, incidents};
use crate::judged::{Judged, decisive};
use crate::link::component_name;
use crate::pair::Pair;
use crate::run::Run;
use crate::signals::{Group, signals};
use crate::timing::{Histogram, timing};
use crate::wires::{Wires, wires};

/// Data of the scripts.
#[derive(Serialize)]
pub(crate) struct Data {
    pub(crate) runs: Vec<RunData>,
    pub(crate) pair: Option<Pair>,
    /// Index of a run, and its instant at which the page opens \[s\].
    pub(crate) open: (usize, f64),
    /// Signals that are plotted first; empty for those of a set.
    pub(crate) signals: Vec<String>,
}

#[derive(Serialize)]
pub(crate) struct RunData {
    pub(crate) name: String,
    /// End of the run \[s\].
    pub(crate) end: f64,
    pub(crate) figure: Option<Figure>,
    pub(crate) gait: Vec<LegGait>,
    pub(crate) incidents: Vec<Incident>,
    pub(crate) judged: Judged,
    pub(crate) groups: Vec<Group>,
    pub(crate) timing: Vec<Histogram>,
    pub(crate) wires: Option<Wires>,
}

impl RunData {
    /// Returns the data of one of `share` runs.
    pub(crate) fn of(
        run: &Run<'_>,
        verdict: Option<&VerdictMessage>,
        share: usize,
        columns: &mut Columns,
    ) -> Result<Self, RecordError> {
        let figure = Figure::of(run, columns)?;
        let legs = figure.iter().flat_map(Figure::legs);
        let gait = gait(run, legs)?;
        let incidents = incidents(run, &gait, verdict)?;
        let notable = incidents.iter().filter(|it| it.is_notable());
        let instants = verdict
            .into_iter()
            .flat_map(|verdict| &verdict.expectations);
        let instants = notable.map(|it| it.at).chain(instants.filter_map(decisive));
        Ok(Self {
            name: run.name().to_owned(),
            end: run.end().as_secs_f64(),
            wires: wires(run, instants, share),
            judged: Judged::of(run, verdict, columns),
            groups: signals(run, share, columns),
            timing: timing(run.shown()),
            figure,
            gait,
            incidents,
        })
    }
}

/// Returns the names of a component of a signal, of every leg if it is of one.
pub(crate) fn of_all_legs(data: &[RunData], (name, component): &(String, usize)) -> Vec<String> {
    let of_leg = |name: &str| signal::parse_leg(name).map(|(_, name)| name.to_owned());
    let alike = |other: &str| match of_leg(name) {
        Some(name) => of_leg(other) == Some(name),
        None => other == name,
    };
    let groups = data.iter().flat_map(|run| &run.groups);
    let signals = groups.flat_map(Group::signals);
    let signals = signals.filter(|(other, _)| alike(other));
    let mut names: Vec<String> = signals
        .map(|(other, components)| component_name(other, components, *component))
        .collect();
    names.sort();
    names.dedup();
    names
}
