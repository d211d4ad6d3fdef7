//! Results of a study of the timing of a servo bus.

use serde::Serialize;
use serde_json::{Value, json};
use twinrig_dynamixel::timing::StatedTime;
use twinrig_kernel::SimDuration;

use crate::machine::Machine;

/// Loop over a bus.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TimingPoint {
    /// Latency timer of the adapter \[s\].
    pub timer_s: f64,
    /// Baud rate \[bit/s\].
    pub baud: u64,
    /// Read pattern.
    pub read: String,
    /// Number of servos.
    pub servos: u8,
    /// Transfers a second, of the median duration \[Hz\]; as the others none if the loop cannot be
    /// run.
    pub rate_hz: Option<f64>,
    /// Median duration of a transfer \[s\].
    pub duration_s: Option<f64>,
    /// 99th percentile of the duration \[s\].
    pub duration_p99_s: Option<f64>,
    /// Median age of the oldest position at the end of a transfer \[s\].
    pub age_s: Option<f64>,
    /// 99th percentile of that age \[s\].
    pub age_p99_s: Option<f64>,
    /// Reason why there are no values.
    pub why: Option<String>,
}

impl TimingPoint {
    /// Adds durations and ages, in order \[s\].
    pub(super) fn with(self, durations: &[f64], ages: &[f64]) -> Self {
        let percentile = |sorted: &[f64], percent: usize| {
            let last = sorted.len().saturating_sub(1);
            sorted.get(last * percent / 100).copied()
        };
        let duration_s = percentile(durations, 50);
        Self {
            rate_hz: duration_s.map(|it| 1.0 / it),
            duration_s,
            duration_p99_s: percentile(durations, 99),
            age_s: percentile(ages, 50),
            age_p99_s: percentile(ages, 99),
            ..self
        }
    }

    /// Whether the other differs in the number of servos only.
    pub(super) fn is_of_curve(&self, other: &Self) -> bool {
        self.is_of_panel(other) && self.read == other.read
    }

    /// Whether the other has the same timer and baud rate.
    pub(super) fn is_of_panel(&self, other: &Self) -> bool {
        self.timer_s.to_bits() == other.timer_s.to_bits() && self.baud == other.baud
    }
}

/// Loops over a bus, and times that users state.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingStudy {
    /// Model of the servos.
    pub model: &'static str,
    /// Adapter.
    pub adapter: &'static str,
    /// Return delay of the servos.
    pub return_delay: SimDuration,
    /// Transfers of each loop.
    pub transfers: usize,
    /// Loops, by timer, baud rate, read pattern and number of servos.
    pub points: Vec<TimingPoint>,
    /// Times that users state.
    pub stated: Vec<StatedTime>,
}

impl TimingStudy {
    /// Returns the points in runs that differ in the number of servos only.
    pub(super) fn curves(&self) -> impl Iterator<Item = &[TimingPoint]> {
        self.points.chunk_by(TimingPoint::is_of_curve)
    }

    /// Returns the fastest and the slowest loop of the most servos.
    pub(super) fn headline(&self) -> String {
        let most = self.points.iter().filter(|it| it.rate_hz.is_some());
        let most = most.map(|it| it.servos).max().unwrap_or_default();
        let mut loops: Vec<(f64, &TimingPoint)> = self
            .points
            .iter()
            .filter(|it| it.servos == most)
            .filter_map(|it| Some((it.rate_hz?, it)))
            .collect();
        loops.sort_by(|(one, _), (other, _)| one.total_cmp(other));
        let text = |(rate, it): &(f64, &TimingPoint)| {
            let timer = 1e3 * it.timer_s;
            format!(
                "{rate:.1} Hz ({}, {} bit/s, timer {timer} ms)",
                it.read, it.baud
            )
        };
        let servos = if most == 1 { "servo" } else { "servos" };
        match &*loops {
            [] => "no loop".to_owned(),
            [only] => format!("{most} {servos}: {}", text(only)),
            [slowest, .., fastest] => {
                format!("{most} {servos}: {} to {}", text(slowest), text(fastest))
            }
        }
    }

    /// Returns the loops as comma-separated values.
    pub fn csv(&self) -> String {
        crate::csv::table(&self.points, "", &[])
    }

    /// Returns the study as JSON, with the machine it ran on and the command that repeats it.
    pub fn json(&self, machine: &Machine, command: &str) -> Value {
        let stated = self.stated.iter().map(|it| {
            let simulated = it.simulated.iter();
            let simulated =
                simulated.map(|(name, time)| ((*name).to_owned(), time.as_secs_f64().into()));
            json!({
                "source": it.source(),
                "conditions": it.conditions,
                "stated_ms": it.stated_ms,
                "return_delay_s": it.return_delay.as_secs_f64(),
                "simulated_s": simulated.collect::<serde_json::Map<_, _>>(),
            })
        });
        json!({
            "study": "timing",
            "machine": machine,
            "command": command,
            "model": self.model,
            "adapter": self.adapter,
            "return_delay_s": self.return_delay.as_secs_f64(),
            "transfers": self.transfers,
            "headline": self.headline(),
            "rows": self.points,
            "stated": stated.collect::<Vec<_>>(),
        })
    }
}
