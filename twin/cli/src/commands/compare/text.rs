//! The comparison for a person: the verdict in a line, the footsteps, the signals that differ most.

use super::super::diff::some_of;
use super::{Drifted, EventDifference, First, Footsteps, OfSignal, Spread};
use crate::grid::{Cell, Grid, Side, Tint};
use crate::paint::Paint;

/// Signals that are shown, one component of each; all are in the JSON.
const SHOWN: usize = 12;

/// Footsteps without a partner that are named.
const NAMED: usize = 6;

impl EventDifference {
    /// Some lines for a person.
    pub(in super::super) fn text(&self, paint: Paint) -> String {
        let mut lines = vec![self.verdict(paint)];
        lines.extend(self.ends());
        if self.footsteps.a + self.footsteps.b == 0 {
            lines
                .push("  no footsteps in either recording: signals at equal times only".to_owned());
        } else {
            lines.extend(self.of_footsteps(paint));
        }
        lines.extend(self.of_signals(paint));
        for (name, only) in [("a", &self.only_in_a), ("b", &self.only_in_b)] {
            if !only.is_empty() {
                lines.push(format!("  signals only in {name}: {}", some_of(only)));
            }
        }
        lines.join("\n")
    }

    fn verdict(&self, paint: Paint) -> String {
        let ms = self.bounds.time_s * 1e3;
        let mm = self.bounds.place_m * 1e3;
        if self.nothing {
            return paint.yellow("nothing to compare");
        }
        if let Some(first) = &self.first {
            let word = paint.red("different");
            let from = figure(first.at_s);
            return format!("{word} from {from} s on: {}", paint.bold(&first.told()));
        }
        if let Some(first) = &self.first_signal {
            let word = paint.red("different");
            let from = first
                .at_s
                .map_or_else(String::new, |at| format!(" from {} s on", figure(at)));
            let name = paint.bold(&format!("{}[{}]", first.signal, first.component));
            return format!(
                "{word}{from}: {name}, off by {} of its range in the end",
                percent(Some(first.share))
            );
        }
        if self.ended_early {
            let word = paint.red("different");
            let (a, b) = (figure(self.ended_a_s), figure(self.ended_b_s));
            return format!("{word}: a ended at {a} s, b at {b} s");
        }
        let word = paint.green("the same");
        let mut within = Vec::new();
        if self.footsteps.pairs > 0 {
            within.push(format!(
                "{} footsteps within {} ms and {} mm",
                self.footsteps.pairs,
                figure(ms),
                figure(mm)
            ));
        }
        if let Some(share) = self.bounds.share {
            within.push(format!(
                "{} signals within {} of their ranges",
                self.signals.len(),
                percent(Some(share))
            ));
        }
        format!("{word}: {}", within.join(", "))
    }

    /// What keeps the comparison from going to the end.
    fn ends(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for (name, at) in [("a", self.cut_off_a_s), ("b", self.cut_off_b_s)] {
            if let Some(at) = at {
                lines.push(format!(
                    "  {name} was cut off at {} s, and is compared as far as it goes",
                    figure(at)
                ));
            }
        }
        if self.ended_early && self.first.is_some() {
            let (a, b) = (figure(self.ended_a_s), figure(self.ended_b_s));
            lines.push(format!("  a ended at {a} s, b at {b} s"));
        }
        lines
    }

    fn of_footsteps(&self, paint: Paint) -> Vec<String> {
        let of = &self.footsteps;
        let mut lines = vec![String::new()];
        lines.push(format!(
            "  footsteps: {} in a, {} in b; {} are pairs, {} of them the same within {} ms and {} mm",
            of.a,
            of.b,
            of.pairs,
            of.same,
            figure(self.bounds.time_s * 1e3),
            figure(self.bounds.place_m * 1e3),
        ));
        let missing: Vec<&First> = self.legs.iter().flat_map(|leg| &leg.missing).collect();
        let named = missing.iter().take(NAMED).map(|first| first.told());
        if !missing.is_empty() {
            let more = missing.len().saturating_sub(NAMED);
            let more = if more > 0 {
                format!(", and {more} more")
            } else {
                String::new()
            };
            lines.push(format!(
                "  without a partner: {}{more}",
                named.collect::<Vec<_>>().join(", ")
            ));
        }
        for (other, count) in [("b", of.beyond_b), ("a", of.beyond_a)] {
            if count > 0 {
                lines.push(format!("  {count} are later than the end of {other}"));
            }
        }
        if of.pairs > 0 {
            lines.push(String::new());
            lines.extend(self.table_of_footsteps().lines(2, paint));
        }
        lines
    }

    fn table_of_footsteps(&self) -> Grid {
        let mut sides = vec![Side::Left];
        sides.extend([Side::Right; 11]);
        let mut grid = Grid::new(&sides);
        let dim = |text: &str| Cell::new(text, Tint::Dim);
        grid.row([
            dim("b − a"),
            dim("pairs"),
            dim("same"),
            dim("touch-down"),
            dim("rms"),
            dim("most"),
            dim("lift-off"),
            dim("rms"),
            dim("most"),
            dim("place"),
            dim("rms"),
            dim("most"),
        ]);
        let mut row = |name: &str, of: &Footsteps| {
            let [touch_down, lift_off] =
                [&of.touch_down, &of.lift_off].map(|spread| spread.shown("ms"));
            let [place, place_rms, place_max] = of.place.shown("mm");
            let [a, b, c] = touch_down;
            let [d, e, f] = lift_off;
            grid.row([
                name.into(),
                of.pairs.to_string().into(),
                of.same.to_string().into(),
                a,
                b,
                c,
                d,
                e,
                f,
                place,
                place_rms,
                place_max,
            ]);
        };
        for leg in &self.legs {
            row(&leg.leg, &leg.footsteps);
        }
        row("all", &self.footsteps);
        grid
    }

    fn of_signals(&self, paint: Paint) -> Vec<String> {
        let mut worst: Vec<&OfSignal> = Vec::new();
        let mut still = 0;
        for signal in &self.signals {
            let same = |other: &&OfSignal| {
                (&other.group, &other.signal) == (&signal.group, &signal.signal)
            };
            if worst.iter().any(same) {
                continue;
            }
            if signal.aligned.max == 0.0 && signal.plain.max == 0.0 {
                still += 1;
            } else {
                worst.push(signal);
            }
        }
        if worst.is_empty() {
            return Vec::new();
        }
        let aligned = worst.iter().any(|signal| signal.by_leg.is_some());
        let how = if aligned {
            "stride by stride"
        } else {
            "at equal times"
        };
        let mut lines = vec![
            String::new(),
            format!("  signals {how}: b − a, and as a share of the range in a; most telling first"),
        ];
        let mut sides = vec![Side::Left];
        sides.extend([Side::Right; 8]);
        let mut grid = Grid::new(&sides);
        let dim = |text: &str| Cell::new(text, Tint::Dim);
        let equal = if aligned { "at equal times" } else { "" };
        grid.row([
            dim("signal"),
            dim("most"),
            dim(""),
            dim("rms"),
            dim("> 1 %"),
            dim("> 10 %"),
            dim("first, last tenth"),
            dim("grows a second"),
            dim(equal),
        ]);
        for signal in worst.iter().take(SHOWN) {
            grid.row(signal.row(aligned));
        }
        lines.extend(grid.lines(2, paint));
        let more = worst.len().saturating_sub(SHOWN);
        if more + still > 0 {
            lines.push(format!("  {more} signals that differ less, and {still} that do not at all: --json has every component"));
        }
        lines
    }
}

impl First {
    /// `LF 5: touch-down 7.1 ms later, place 12 mm off`
    fn told(&self) -> String {
        let leg = &self.leg;
        if self.what != "moved" {
            let number = self.footstep_a.or(self.footstep_b).unwrap_or_default();
            return format!(
                "{leg} footstep {number} at {} s {}",
                figure(self.at_s),
                self.what
            );
        }
        let (a, b) = (
            self.footstep_a.unwrap_or_default(),
            self.footstep_b.unwrap_or_default(),
        );
        let number = if a == b {
            a.to_string()
        } else {
            format!("{a} ({b} in b)")
        };
        let by = |what: &str, by: Option<f64>| {
            // Below a microsecond it is the rounding of times.
            let by = by.filter(|by| by.abs() >= 1e-6)?;
            let way = if by < 0.0 { "earlier" } else { "later" };
            Some(format!("{what} {} ms {way}", figure(by.abs() * 1e3)))
        };
        let place = self
            .place_by_m
            .map(|by| format!("place {} mm off", figure(by * 1e3)));
        let parts = [
            by("touch-down", self.touch_down_by_s),
            by("lift-off", self.lift_off_by_s),
            place,
        ];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        format!("{leg} footstep {number}: {}", parts.join(", "))
    }
}

impl Spread {
    /// Median, root of the mean square, and most, in thousandths.
    fn shown(&self, unit: &str) -> [Cell; 3] {
        [self.median, self.rms, self.max].map(|value| {
            let shown = value.map(|value| format!("{} {unit}", figure(value * 1e3)));
            shown.unwrap_or_default().into()
        })
    }
}

impl OfSignal {
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
        } = &self.aligned;
        let at = |at: &Option<f64>| at.map_or_else(String::new, |at| format!("{} s", figure(at)));
        let ends = [rms_of_tenths.first(), rms_of_tenths.last()]
            .map(|rms| figure(rms.copied().unwrap_or(0.0)));
        [
            self.name().into(),
            format!("{} {}", figure(*max), self.unit).into(),
            percent(*share).into(),
            figure(*rms).into(),
            at(exceeds_1_percent_at_s).into(),
            at(exceeds_10_percent_at_s).into(),
            ends.join(", ").into(),
            figure(*growth_per_s).into(),
            if aligned {
                percent(self.plain.share).into()
            } else {
                "".into()
            },
        ]
    }
}

/// A number in three digits.
fn figure(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e5).contains(&size) {
        return format!("{value:.2e}");
    }
    let digits = if size < 0.01 {
        5
    } else if size < 0.1 {
        4
    } else if size < 10.0 {
        3
    } else if size < 100.0 {
        2
    } else {
        1
    };
    let text = format!("{value:.digits$}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A share in per cent; nothing where there is none.
fn percent(share: Option<f64>) -> String {
    share.map_or_else(String::new, |share| format!("{} %", figure(share * 100.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let all = [
            0.0,
            1.0,
            -0.00123,
            0.0123,
            0.123,
            12.3456,
            1234.56,
            1e-7,
            f64::INFINITY,
        ];
        let shown = all.map(figure);
        let expected = [
            "0", "1", "-0.00123", "0.0123", "0.123", "12.35", "1234.6", "1.00e-7", "inf",
        ];
        assert_eq!(shown, expected);
    }
}
