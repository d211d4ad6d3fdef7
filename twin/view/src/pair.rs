//! Two runs, aligned by their footsteps.

use serde::Serialize;
use twinrig_kernel::signal;
use twinrig_record::{LegFootsteps, RecordError, SHARES, SignalDrift, compare_events};
use twinrig_report::number::{percent, quantity};
use twinrig_report::table::{Cell, Column, Table};

use crate::link::{component_name, instant};
use crate::parting::{Parting, parting};
use crate::run::Run;

/// Alignment of two runs.
#[derive(Debug, Serialize)]
pub(crate) struct Pair {
    /// Corresponding instants of both runs \[s\], rising; the offset is constant outside.
    knots: Vec<[f64; 2]>,
}

/// Signals of the table of differences.
const SHOWN: usize = 40;

/// Two runs beside each other.
pub(crate) struct Compared {
    pub(crate) pair: Pair,
    /// The difference by which the second run parts from the first.
    pub(crate) parting: Option<Parting>,
    /// Footsteps, and signals by the instant at which they part.
    pub(crate) tables: [Table; 2],
}

/// Compares two runs.
pub(crate) fn compared(runs: [&Run<'_>; 2]) -> Result<Compared, RecordError> {
    let [a, b] = runs;
    let comparison = compare_events(a.shown(), b.shown(), [a.end(), b.end()])?;
    let most = comparison
        .legs
        .iter()
        .max_by_key(|leg| leg.pairing.pairs.len());
    let pair = Pair {
        knots: most.map_or_else(Vec::new, knots),
    };
    let parting = parting(a.shown(), b.shown(), &comparison, "A");
    let from = parting.as_ref().map_or(0.0, |it| it.at_s);
    Ok(Compared {
        pair,
        parting,
        tables: [
            footsteps(&comparison.legs),
            signals(comparison.signals, from),
        ],
    })
}

/// Returns the paired touch-downs of a leg, where both rise.
fn knots(leg: &LegFootsteps) -> Vec<[f64; 2]> {
    let mut rising: Vec<[f64; 2]> = Vec::new();
    for &(a, b) in &leg.pairing.pairs {
        let knot = [leg.a[a].touch_down_s, leg.b[b].touch_down_s];
        let last = rising.last();
        if last.is_none_or(|last| knot[0] > last[0] && knot[1] > last[1]) {
            rising.push(knot);
        }
    }
    rising
}

fn footsteps(legs: &[LegFootsteps]) -> Table {
    let mut table = Table::new([
        Column::label("leg"),
        Column::number("footsteps of A"),
        Column::number("footsteps of B"),
        Column::number("pairs"),
        Column::number("touch-downs of B later by, at most").in_unit("s"),
        Column::text("at"),
        Column::number("distance of places, at most").in_unit("m"),
        Column::text("at"),
    ]);
    for leg in legs {
        let pairs = leg.pairing.pairs.iter();
        let pairs = pairs.map(|&(a, b)| (leg.a[a], leg.b[b]));
        let later = pairs
            .clone()
            .map(|(a, b)| (b.touch_down_s - a.touch_down_s, a));
        let later = later.max_by(|x, y| x.0.abs().total_cmp(&y.0.abs()));
        let apart = pairs.filter_map(|(a, b)| {
            let (from, to) = (a.position_m?, b.position_m?);
            let squares = from
                .iter()
                .zip(to)
                .map(|(from, to)| (to - from) * (to - from));
            Some((squares.sum::<f64>().sqrt(), a))
        });
        let apart = apart.max_by(|x, y| x.0.total_cmp(&y.0));
        let at = |it: Option<(f64, twinrig_record::RecordedFootstep)>| {
            let at = it.map(|(_, step)| step.touch_down_s);
            at.map_or_else(Cell::empty, |at| instant(0, at))
        };
        table.row([
            leg.leg.as_str().into(),
            leg.a.len().into(),
            leg.b.len().into(),
            leg.pairing.pairs.len().into(),
            later.map(|(later, _)| later).into(),
            at(later),
            apart.map(|(apart, _)| apart).into(),
            at(apart),
        ]);
    }
    table
}

/// Returns the signals by the instant at which they first differ by a tenth of their range, then by
/// a hundredth. Where the alignment of the footsteps differs before the runs do, `from` counts.
fn signals(mut signals: Vec<SignalDrift>, from: f64) -> Table {
    let onset = |drift: &SignalDrift| {
        let [little, much] = drift.aligned.exceeds_at_s;
        [much, little].map(|at| at.unwrap_or(f64::INFINITY))
    };
    let is_shown = |drift: &SignalDrift| {
        let differs = drift.aligned.exceeds_at_s[0].is_some();
        differs && !drift.signal.starts_with(signal::ENERGY_PREFIX)
    };
    signals.retain(is_shown);
    signals.sort_by(|x, y| {
        let ([x, x_little], [y, y_little]) = (onset(x), onset(y));
        x.total_cmp(&y).then(x_little.total_cmp(&y_little))
    });
    let exceeds =
        |share: f64| Column::text(format!("differs by {} of its range from", percent(share)));
    let mut table = Table::new([
        Column::label("signal"),
        exceeds(SHARES[1]),
        exceeds(SHARES[0]),
        Column::text("greatest difference"),
        Column::text("at"),
    ]);
    for drift in signals.iter().take(SHOWN) {
        let name = component_name(&drift.signal, drift.components, drift.component);
        let at = |at: Option<f64>| at.map_or_else(Cell::empty, |at| instant(0, at.max(from)));
        let [little, much] = drift.aligned.exceeds_at_s;
        table.row([
            name.into(),
            at(much),
            at(little),
            quantity(drift.aligned.max, &drift.unit).into(),
            at(Some(drift.aligned.max_at_s)),
        ]);
    }
    table
}
