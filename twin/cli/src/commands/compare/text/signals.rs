//! The signals of a comparison, in lines: one of each kind, those that tell most first.

use super::super::EventDifference;
use super::super::signals::{Drifted, OfSignal, RESIDUAL};
use super::figures::{Scale, figure, percent, quantity, three};
use crate::report::grid::{Cell, Grid, Side, Tint};
use crate::report::paint::Paint;
use crate::report::table::folded;

/// Kinds of signals that are shown; all signals are in the JSON.
const SHOWN: usize = 12;

/// What everybody asks first.
const FOREMOST: [&str; 2] = ["body/position", "body/rpy"];

/// Shares below this are the rounding of numbers.
const ROUNDING: f64 = 1e-9;

/// Signals that are called alike but for the leg, with all their components.
struct Kind<'d> {
    group: &'d str,
    name: String,
    /// The component, of whichever leg, that is farthest off.
    worst: &'d OfSignal,
    /// The greatest share of any, by which kinds are told apart that differ from those that do not.
    share: f64,
}

impl EventDifference {
    pub(super) fn of_signals(&self, paint: Paint) -> Vec<String> {
        let kinds = self.kinds();
        let (differ, alike): (Vec<Kind<'_>>, Vec<Kind<'_>>) =
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
                "  signals {how}: b − a, and as a share of the range in a; of legs and components the worst, in its unit"
            ),
        ];
        let mut grid = Grid::new(&[[Side::Left; 1].as_slice(), &[Side::Right; 8]].concat());
        let dim = |text: &str| Cell::new(text, Tint::Dim);
        grid.row([
            dim("signal"),
            dim("most"),
            dim(""),
            dim("rms"),
            dim("> 1 %"),
            dim("> 10 %"),
            dim("first, last tenth"),
            dim("grows a second"),
            dim(if aligned { "at equal times" } else { "" }),
        ]);
        let (residual, differ): (Vec<Kind<'_>>, Vec<Kind<'_>>) =
            differ.into_iter().partition(Kind::is_residual);
        for kind in differ.iter().take(SHOWN).chain(&residual) {
            grid.row(kind.row(aligned));
        }
        lines.extend(grid.lines(2, paint));
        let (more, still) = (differ.len().saturating_sub(SHOWN), alike.len());
        let rest = match (more, still) {
            (0, 0) => return lines,
            (0, _) => format!("{still} kinds of signals do not differ at all"),
            (_, 0) => format!("{more} kinds of signals differ less"),
            _ => format!("{more} kinds of signals differ less, and {still} not at all"),
        };
        lines.push(format!("  {rest}: --json has every component"));
        lines
    }

    /// The foremost, then those that are farthest off.
    fn kinds(&self) -> Vec<Kind<'_>> {
        let mut legs: Vec<&str> = self.legs.iter().map(|leg| leg.leg.as_str()).collect();
        // Legs that never come down are legs, too.
        let named = self.signals.iter();
        legs.extend(named.filter_map(|of| of.signal.strip_prefix("leg/")?.split('/').next()));
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
                let place = FOREMOST.iter().position(|name| *name == kind.name);
                place.unwrap_or(FOREMOST.len())
            };
            let share = |kind: &Kind<'_>| kind.worst.aligned.share.unwrap_or(0.0);
            place(a).cmp(&place(b)).then(share(b).total_cmp(&share(a)))
        });
        kinds
    }
}

impl OfSignal {
    /// The greatest share by which it is off, at equal times or at equal footsteps; nothing where it is nothing in both.
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
        // Of what is an error itself a share says nothing.
        let telling = !self.is_residual();
        let at = |at: &Option<f64>| {
            let at = at.filter(|_| telling);
            at.map_or_else(String::new, |at| format!("{} s", figure(at)))
        };
        let percent = |share: Option<f64>| percent(share.filter(|_| telling));
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
