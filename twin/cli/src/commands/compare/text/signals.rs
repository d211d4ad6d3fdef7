//! Text form of the signals of a comparison: one line per kind, by the onset of the difference.

use core::cmp::Ordering;

use super::super::EventDifference;
use super::super::signals::{OfSignal, RESIDUAL};
use twinrig_kernel::signal;
use twinrig_kernel::signal::folded;
use twinrig_report::number::{plain, quantity};
use twinrig_report::table::{Cell, Column, Table};

/// Maximum number of kinds shown; the JSON contains all signals.
const SHOWN: usize = 12;

/// Share below which differences are rounding errors.
const ROUNDING: f64 = 1e-9;

/// Signals whose names differ only in the leg, with all their components.
struct Kind<'d> {
    group: &'d str,
    name: String,
    /// Component that differs first among all legs.
    first: &'d OfSignal,
    /// Greatest share of all components, which decides whether the kind differs.
    share: f64,
}

impl EventDifference {
    pub(super) fn signal_lines(&self) -> Vec<String> {
        let kinds = self.kinds();
        let (differ, equal): (Vec<Kind<'_>>, Vec<Kind<'_>>) =
            kinds.into_iter().partition(|kind| kind.share >= ROUNDING);
        if differ.is_empty() {
            return Vec::new();
        }
        let aligned = differ.iter().any(|kind| kind.first.by_leg.is_some());
        let how = if aligned {
            "stride by stride"
        } else {
            "at equal times"
        };
        let mut lines = vec![
            String::new(),
            format!(
                "  signals {how}: b − a, and as a share of the range in a; by the time of 10 %, then of 1 %; first leg and component, in its unit"
            ),
        ];
        let mut table = Table::new([
            Column::label("signal"),
            Column::number("max"),
            Column::number("share"),
            Column::number("rms"),
            Column::number("> 1 %").in_unit("s"),
            Column::number("> 10 %").in_unit("s"),
            Column::number("first tenth"),
            Column::number("last tenth"),
            Column::number("growth per second"),
            Column::number("at equal times"),
        ]);
        let (residual, differ): (Vec<Kind<'_>>, Vec<Kind<'_>>) =
            differ.into_iter().partition(Kind::is_residual);
        for kind in differ.iter().take(SHOWN).chain(&residual) {
            table.row(kind.row(aligned));
        }
        lines.extend(table.grid().lines(2));
        let (more, equal) = (differ.len().saturating_sub(SHOWN), equal.len());
        let rest = match (more, equal) {
            (0, 0) => return lines,
            (0, _) => format!("{equal} kinds of signals do not differ"),
            (_, 0) => format!("{more} kinds of signals differ less"),
            _ => format!("{more} kinds of signals differ less, and {equal} do not differ"),
        };
        lines.push(format!("  {rest}: --json lists all components"));
        lines
    }

    /// Returns the kinds in the order in which they differ: a cause stands above its effects.
    fn kinds(&self) -> Vec<Kind<'_>> {
        let mut legs: Vec<&str> = self.legs.iter().map(|leg| leg.leg.as_str()).collect();
        // Includes legs without footsteps.
        let named = self.signals.iter();
        legs.extend(named.filter_map(|of| Some(signal::parse_leg(&of.signal)?.0)));
        legs.sort_unstable();
        legs.dedup();
        let mut kinds: Vec<Kind<'_>> = Vec::new();
        for signal in &self.signals {
            let name = folded(&signal.signal, &legs);
            let share = signal.share();
            let known = kinds
                .iter_mut()
                .find(|kind| kind.group == signal.group && kind.name == name);
            if let Some(kind) = known {
                kind.share = kind.share.max(share);
                if signal.onset(kind.first) == Ordering::Less {
                    kind.first = signal;
                }
            } else {
                kinds.push(Kind {
                    group: &signal.group,
                    name,
                    first: signal,
                    share,
                });
            }
        }
        kinds.sort_by(|a, b| a.first.onset(b.first));
        kinds
    }
}

impl OfSignal {
    /// Compares by the time at which the difference exceeds 10 % of the range, then 1 %, then by
    /// its maximum as a share of the range, the greatest first.
    fn onset(&self, other: &Self) -> Ordering {
        let key = |of: &Self| {
            let drift = &of.aligned;
            let [tenth, hundredth] = [drift.exceeds_10_percent_at_s, drift.exceeds_1_percent_at_s]
                .map(|at_s| at_s.unwrap_or(f64::INFINITY));
            [tenth, hundredth, -drift.share.unwrap_or(0.0)]
        };
        let pairs = key(self).into_iter().zip(key(other));
        pairs.fold(Ordering::Equal, |order, (a, b)| order.then(a.total_cmp(&b)))
    }

    /// Returns the greatest relative difference, at equal times or at equal footsteps; 0 for
    /// signals without a range.
    fn share(&self) -> f64 {
        let shares = [self.aligned.share, self.plain.share];
        shares.into_iter().flatten().fold(0.0, f64::max)
    }
}

impl Kind<'_> {
    fn is_residual(&self) -> bool {
        self.name == RESIDUAL
    }

    fn row(&self, aligned: bool) -> [Cell; 10] {
        let drift = &self.first.aligned;
        let shown = |value: f64| Cell::from(quantity(value, &self.first.unit));
        // A share of the residual, which is an error itself, is not meaningful.
        let has_share = !self.is_residual();
        let share = |share: Option<f64>| share.filter(|_| has_share).map(percent);
        let at = |at_s: Option<f64>| Cell::from(at_s.filter(|_| has_share));
        [
            self.first.name().into(),
            shown(drift.max),
            share(drift.share).into(),
            shown(drift.rms),
            at(drift.exceeds_1_percent_at_s),
            at(drift.exceeds_10_percent_at_s),
            drift.rms_of_tenths.first().copied().map(shown).into(),
            drift.rms_of_tenths.last().copied().map(shown).into(),
            shown(drift.growth_per_s),
            share(self.first.plain.share.filter(|_| aligned)).into(),
        ]
    }
}

/// Formats a share of a range, which may be a small part of a per cent.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", plain(100.0 * share))
}

#[cfg(test)]
mod tests {
    use twinrig_record::Drift;

    use super::*;

    fn signal(name: &str, exceeds_at_s: [Option<f64>; 2], share: f64) -> OfSignal {
        let drift = Drift {
            share: Some(share),
            exceeds_at_s,
            ..Drift::default()
        };
        OfSignal {
            group: "plant".to_owned(),
            signal: name.to_owned(),
            component: 0,
            components: 1,
            unit: "1".to_owned(),
            by_leg: None,
            aligned: drift.clone().into(),
            plain: drift.into(),
            ends_at_s: None,
            ends_a: None,
            ends_b: None,
        }
    }

    #[test]
    fn signal_that_differs_first_stands_above_those_that_differ_more() {
        let mut signals = [
            signal("body", [Some(0.2), Some(0.9)], 50.0),
            signal("equal", [None, None], 1e-12),
            signal("drift", [Some(0.1), None], 0.05),
            signal("leg", [Some(0.3), Some(0.4)], 0.2),
            signal("small", [Some(0.1), None], 0.02),
        ];
        signals.sort_by(OfSignal::onset);
        let names = signals.each_ref().map(|signal| signal.signal.as_str());
        assert_eq!(names, ["leg", "body", "drift", "small", "equal"]);
    }
}
