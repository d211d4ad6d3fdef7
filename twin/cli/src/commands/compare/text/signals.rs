//! Text form of the signals of a comparison: one line per kind, by decreasing difference.

use super::super::EventDifference;
use super::super::signals::{Drifted, OfSignal, RESIDUAL};
use super::figures::{Scale, figure, percent, quantity, three};
use crate::report::grid::{Cell, Grid, Left, Right};
use crate::report::table::folded;
use twinrig_kernel::signal;

/// Maximum number of kinds shown; the JSON contains all signals.
const SHOWN: usize = 12;

/// Kinds that are shown first.
const FIRST: [&str; 2] = [signal::BODY_POSITION, signal::BODY_RPY];

/// Share below which differences are rounding errors.
const ROUNDING: f64 = 1e-9;

/// Signals whose names differ only in the leg, with all their components.
struct Kind<'d> {
    group: &'d str,
    name: String,
    /// Component with the greatest difference among all legs.
    worst: &'d OfSignal,
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
        let aligned = differ.iter().any(|kind| kind.worst.by_leg.is_some());
        let how = if aligned {
            "stride by stride"
        } else {
            "at equal times"
        };
        let mut lines = vec![
            String::new(),
            format!(
                "  signals {how}: b − a, and as a share of the range in a; worst leg and component, in its unit"
            ),
        ];
        let mut grid = Grid::new(&[[Left; 1].as_slice(), &[Right; 8]].concat());
        let scale = if aligned { "at equal times" } else { "" };
        grid.header(&format!(
            "signal | max | | rms | > 1 % | > 10 % | first, last tenth | growth per second | {scale}"
        ));
        let (residual, differ): (Vec<Kind<'_>>, Vec<Kind<'_>>) =
            differ.into_iter().partition(Kind::is_residual);
        for kind in differ.iter().take(SHOWN).chain(&residual) {
            grid.row(kind.row(aligned));
        }
        lines.extend(grid.lines(2));
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

    /// Returns the kinds of [`FIRST`], then the others by decreasing difference.
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
                if signal.aligned.max > kind.worst.aligned.max {
                    kind.worst = signal;
                }
            } else {
                kinds.push(Kind {
                    group: &signal.group,
                    name,
                    worst: signal,
                    share,
                });
            }
        }
        kinds.sort_by(|a, b| {
            let place = |kind: &Kind<'_>| {
                let place = FIRST.iter().position(|name| *name == kind.name);
                place.unwrap_or(FIRST.len())
            };
            let share = |kind: &Kind<'_>| kind.worst.aligned.share.unwrap_or(0.0);
            place(a).cmp(&place(b)).then(share(b).total_cmp(&share(a)))
        });
        kinds
    }
}

impl OfSignal {
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

    fn row(&self, aligned: bool) -> [Cell; 9] {
        let Drifted {
            max,
            rms,
            share,
            exceeds_1_percent_at_s,
            exceeds_10_percent_at_s,
            rms_of_tenths,
            growth_per_s,
            ..
        } = &self.worst.aligned;
        let unit = &self.worst.unit;
        let scale = Scale::of(*max, unit);
        let scaled = |value: f64| three(value * scale.factor);
        let ends = [rms_of_tenths.first(), rms_of_tenths.last()]
            .map(|rms| scaled(rms.copied().unwrap_or(0.0)));
        // A share of the residual, which is an error itself, is not meaningful.
        let has_share = !self.is_residual();
        let at = |at: &Option<f64>| {
            let at = at.filter(|_| has_share);
            at.map_or_else(String::new, |at| format!("{} s", figure(at)))
        };
        let percent = |share: Option<f64>| percent(share.filter(|_| has_share));
        [
            self.worst.name().into(),
            quantity(*max, unit).into(),
            percent(*share).into(),
            scaled(*rms).into(),
            at(exceeds_1_percent_at_s).into(),
            at(exceeds_10_percent_at_s).into(),
            ends.join(", ").into(),
            scaled(*growth_per_s).into(),
            percent(self.worst.plain.share.filter(|_| aligned)).into(),
        ]
    }
}
