//! Text form of a comparison: verdict, summary of the differences, footsteps, and the signals that
//! differ most.

mod footsteps;
mod signals;
mod summary;

use signals::percent;

use super::super::diff::some_of;
use super::EventDifference;
use twinrig_report::number::{precise, si};
use twinrig_report::text::style::{BOLD, GREEN, RED, YELLOW, styled};

impl EventDifference {
    /// Returns the text form.
    pub(in super::super) fn text(&self) -> String {
        if self.bit_for_bit {
            return styled(GREEN, "identical, bit for bit");
        }
        let mut lines = self.verdict();
        lines.extend(self.ends());
        if self.footsteps.a + self.footsteps.b == 0 {
            lines
                .push("  no footsteps in either recording: signals at equal times only".to_owned());
        } else {
            lines.extend(self.footstep_lines());
        }
        lines.extend(self.signal_lines());
        for (name, only) in [("a", &self.only_in_a), ("b", &self.only_in_b)] {
            if !only.is_empty() {
                lines.push(format!("  signals only in {name}: {}", some_of(only)));
            }
        }
        lines.join("\n")
    }

    /// Returns the verdict, the summary of the differences at the end, and the first difference.
    fn verdict(&self) -> Vec<String> {
        if self.nothing {
            return vec![styled(YELLOW, "nothing to compare")];
        }
        let word = if self.same {
            styled(GREEN, "equal")
        } else {
            styled(RED, "different")
        };
        let why = self.why();
        match self.summary() {
            Some(summary) => vec![format!("{word}: {summary}"), format!("  {why}")],
            None if why.starts_with("from ") => vec![format!("{word} {why}")],
            None => vec![format!("{word}: {why}")],
        }
    }

    /// Returns the first difference, or the tolerances within which the runs are equal.
    fn why(&self) -> String {
        if let Some(first) = &self.first {
            let from = precise(first.at_s, "s");
            return format!("from {from}: {}", styled(BOLD, &first.description()));
        }
        if let Some(first) = &self.first_signal {
            let difference = format!(
                "{}, maximum difference {} of its range",
                styled(BOLD, &first.name()),
                percent(first.share)
            );
            return match first.at_s {
                Some(at) => format!("from {}: {difference}", precise(at, "s")),
                None => difference,
            };
        }
        if self.ended_early {
            let [a, b] = [self.ended_a_s, self.ended_b_s].map(|at| precise(at, "s"));
            return format!("a ended at {a}, b at {b}");
        }
        let mut within = Vec::new();
        if self.footsteps.pairs > 0 {
            within.push(format!(
                "{} footsteps within {} and {}",
                self.footsteps.pairs,
                si(self.bounds.time_s, "s"),
                si(self.bounds.place_m, "m")
            ));
        }
        if let Some(share) = self.bounds.share {
            within.push(format!(
                "{} signals within {} of their ranges",
                self.signals.len(),
                percent(share)
            ));
        }
        within.join(", ")
    }

    /// Returns the truncations that limit the comparison.
    fn ends(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for (name, at) in [("a", self.cut_off_a_s), ("b", self.cut_off_b_s)] {
            if let Some(at) = at {
                lines.push(format!(
                    "  {name} was cut off at {} and is compared up to there",
                    precise(at, "s")
                ));
            }
        }
        if self.ended_early && self.first.is_some() {
            let [a, b] = [self.ended_a_s, self.ended_b_s].map(|at| precise(at, "s"));
            lines.push(format!("  a ended at {a}, b at {b}"));
        }
        lines
    }
}
