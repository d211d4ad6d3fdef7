//! Text form of the footsteps of a comparison.

use super::super::EventDifference;
use super::super::footsteps::{First, Footsteps};
use twinrig_report::number::{plain, precise, si};
use twinrig_report::table::{Cell, Column, Table};
use twinrig_report::text::style::{YELLOW, styled};

/// Maximum number of footsteps without a partner that are listed.
const NAMED: usize = 6;

impl EventDifference {
    pub(super) fn footstep_lines(&self) -> Vec<String> {
        let of = &self.footsteps;
        let mut lines = vec![String::new()];
        lines.push(format!(
            "  footsteps: {} in a, {} in b; {} pairs, {} of them equal within {} and {}",
            of.a,
            of.b,
            of.pairs,
            of.same,
            si(self.bounds.time_s, "s"),
            si(self.bounds.place_m, "m"),
        ));
        let missing: Vec<&First> = self.legs.iter().flat_map(|leg| &leg.missing).collect();
        let named = missing.iter().take(NAMED).map(|first| first.description());
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
                lines.push(format!("  {count} after the end of {other}"));
            }
        }
        if of.pairs > 0 {
            lines.push(String::new());
            lines.extend(self.footstep_table().grid().lines(2));
            lines.extend(self.suspects());
        }
        lines
    }

    /// Returns the legs whose footsteps may be paired with footsteps of other strides.
    fn suspects(&self) -> Option<String> {
        let stride = self.stride_s?;
        let suspects = self.legs.iter().filter(|leg| leg.footsteps.suspect);
        let legs: Vec<String> = suspects
            .map(|leg| {
                let median = leg.footsteps.touch_down.median.unwrap_or_default();
                format!("{} {} strides", leg.leg, plain(median / stride))
            })
            .collect();
        (!legs.is_empty()).then(|| {
            format!(
                "  {}: the median touch-down differs by {} of {}: pairs of different strides, or b leads or lags by as much",
                styled(YELLOW, "suspect"),
                legs.join(", "),
                si(stride, "s"),
            )
        })
    }

    fn footstep_table(&self) -> Table {
        let of = |name, unit| Column::number(name).in_unit(unit);
        let mut table = Table::new([
            Column::label("b − a"),
            Column::number("pairs"),
            Column::number("equal"),
            of("touch-down median", "s"),
            of("rms", "s"),
            of("max", "s"),
            of("lift-off median", "s"),
            of("rms", "s"),
            of("max", "s"),
            of("position median", "m"),
            of("rms", "m"),
            of("max", "m"),
        ]);
        let mut row = |name: &str, of: &Footsteps| {
            let counts = [name.into(), of.pairs.into(), of.same.into()];
            let spreads = [&of.touch_down, &of.lift_off, &of.place];
            let spreads = spreads.map(|it| [it.median, it.rms, it.max].map(Cell::from));
            table.row(counts.into_iter().chain(spreads.into_iter().flatten()));
        };
        for leg in &self.legs {
            row(&leg.leg, &leg.footsteps);
        }
        row("all", &self.footsteps);
        table
    }
}

impl First {
    /// Returns a description: `LF footstep 5: touch-down 7.1 ms later, position differs by 12 mm`.
    pub(in super::super) fn description(&self) -> String {
        let leg = &self.leg;
        if self.what != "moved" {
            let number = self.footstep_a.or(self.footstep_b).unwrap_or_default();
            return format!(
                "{leg} footstep {number} at {} {}",
                precise(self.at_s, "s"),
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
            // Differences below 1 µs are rounding errors.
            let by = by.filter(|by| by.abs() >= 1e-6)?;
            let order = if by < 0.0 { "earlier" } else { "later" };
            Some(format!("{what} {} {order}", si(by.abs(), "s")))
        };
        let place = self
            .place_by_m
            .map(|by| format!("position differs by {}", si(by, "m")));
        let parts = [
            by("touch-down", self.touch_down_by_s),
            by("lift-off", self.lift_off_by_s),
            place,
        ];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        format!("{leg} footstep {number}: {}", parts.join(", "))
    }
}
