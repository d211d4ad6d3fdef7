//! Results of a study of load filters.

use serde_json::{Value, json};
use twinrig_estimate::fit::Fitted;
use twinrig_estimate::{Decay, Sigmoid};

use super::curves::{EstimateCurve, LoopPoint, VoltageCurve};
use super::identify::Identification;
use super::settings_text;
use super::tune::{SearchSize, TunedFilter};
use super::validate::FilterRow;
use crate::machine::Machine;
use crate::measured::Starts;
use twinrig_report::number::plain;

/// Results of a study of load filters, without the machine it ran on.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimateStudy {
    /// Name of the scenario.
    pub scenario: String,
    /// Path of the scenario file.
    pub file: String,
    /// Duration of a run \[s\].
    pub simulated_s: f64,
    /// Seeds of the runs for identification, tuning and validation.
    pub seeds: [u64; 3],
    /// Signal of the measured frequency.
    pub frequency_signal: String,
    /// Size of the searches.
    pub search: SearchSize,
    /// Time budget \[s\].
    pub budget_s: f64,
    /// Models of both cells.
    pub identification: Identification,
    /// Tuned filters.
    pub filters: Vec<TunedFilter>,
    /// Results of the filters at each frequency, and over all.
    pub rows: Vec<FilterRow>,
    /// Points of figure 4.11.
    pub loop_points: Vec<LoopPoint>,
    /// Curves of figure 4.13.
    pub voltages: Vec<VoltageCurve>,
    /// Curves of figure 4.15.
    pub estimates: Vec<EstimateCurve>,
    /// Starts of the program whose searches it has.
    pub starts: Starts,
    /// Parts of runs that are left out, each with the reason.
    pub left_out: Vec<String>,
}

impl EstimateStudy {
    /// Returns the row of a filter at a frequency \[Hz\], or over all.
    pub fn row(&self, filter: &str, hz: Option<f64>) -> Option<&FilterRow> {
        let near = |row: &&FilterRow| match (row.hz, hz) {
            (Some(found), Some(hz)) => (found - hz).abs() <= 0.01 * hz,
            (found, hz) => found.is_none() && hz.is_none(),
        };
        let mut rows = self.rows.iter().filter(|row| row.filter == filter);
        rows.find(near)
    }

    /// Returns the names of the searches that the budget ended.
    pub fn cut(&self) -> impl Iterator<Item = &'static str> {
        let filters = self.filters.iter().filter(|filter| filter.truncated);
        filters.map(|filter| filter.kind.name())
    }

    /// Returns the tables `[bus.filter.NAME]` of all filters, for a scenario.
    pub fn settings(&self) -> String {
        let tables = self.filters.iter();
        let tables: Vec<String> = tables
            .map(|filter| settings_text::table(filter, &self.frequency_signal))
            .collect();
        tables.join("\n")
    }

    /// Returns a summary: what the thesis observed on its filter, and the errors of the best one.
    pub fn headline(&self) -> String {
        let mut fused: Vec<&FilterRow> = Vec::new();
        let mut single: Vec<&FilterRow> = Vec::new();
        for filter in &self.filters {
            let list = if filter.kind.is_fused() {
                &mut fused
            } else {
                &mut single
            };
            list.extend(self.row(filter.kind.name(), None));
        }
        let least = |rows: &[&FilterRow]| {
            let best = rows
                .iter()
                .min_by(|a, b| a.force_rmse_n.total_cmp(&b.force_rmse_n));
            best.map(|row| (row.filter, row.force_rmse_n))
        };
        let (Some((best, error)), Some((alone, other))) = (least(&fused), least(&single)) else {
            return "No filter was validated.".to_owned();
        };
        let errors = format!(
            "{best} estimates the force to {} N RMS, the better single cell ({alone}) to {} N.",
            plain(error),
            plain(other)
        );
        let sentences = std::iter::once(errors).chain(self.observations());
        sentences.collect::<Vec<_>>().join(" ")
    }

    /// Returns the study as JSON, with the machine it ran on and the command that repeats it.
    pub fn json(&self, machine: &Machine, command: &str) -> Value {
        json!({
            "study": "estimate",
            "scenario": self.scenario,
            "machine": self.starts.machine(machine),
            "identification": identification(&self.identification),
            "filters": self.filters.iter().map(filter).collect::<Vec<_>>(),
            "rows": self.rows,
            "thesis": self.printed(),
            "settings": self.settings(),
            "file": self.file,
            "command": command,
            "simulated_s": self.simulated_s,
            "seeds": self.seeds,
            "search": self.search,
            "budget_s": self.budget_s,
            "figure_4_11": self.loop_points,
            "figure_4_13": self.voltages,
            "figure_4_15": self.estimates,
            "left_out": self.left_out,
            "starts": self.starts,
        })
    }

    /// Returns the rows as comma-separated values.
    pub fn csv(&self) -> String {
        crate::csv::table(&self.rows, "filter", &["hz"])
    }
}

fn filter(filter: &TunedFilter) -> Value {
    json!({
        "filter": filter.kind.name(),
        "settings": filter.settings,
        "cost_before": filter.cost[0],
        "cost": filter.cost[1],
        "evaluations": filter.evaluations,
        "truncated": filter.truncated,
        "history": filter.history,
    })
}

fn identification(found: &Identification) -> Value {
    let sigmoid = |it: &Sigmoid| json!({ "a_v": it.a, "b_per_n": it.b, "c_n": it.c, "d_v": it.d });
    let decay = |it: &Fitted<Decay>| {
        let Decay { value, scale_hz } = it.model;
        json!({ "value": value, "scale_hz": scale_hz, "r_squared": it.r_squared })
    };
    let hysteresis = &found.hysteresis;
    let amplifier = &found.amplifier.model.amplifier;
    let planes = found.frequencies.iter().zip(&found.coefficients.runs);
    let planes: Vec<Value> = planes
        .map(|(hz, plane)| {
            json!({
                "hz": hz,
                "a_v_s_per_n": plane.model[0],
                "b_v_s2_per_n": plane.model[1],
                "offset_v": plane.model[2],
                "r_squared": plane.r_squared,
            })
        })
        .collect();
    json!({
        "hysteresis": {
            "loading": sigmoid(&hysteresis.model.loading),
            "unloading": sigmoid(&hysteresis.model.unloading),
            "switch_s_per_n": hysteresis.model.switch,
            "r_squared": hysteresis.r_squared,
            "residual_v": hysteresis.residual,
        },
        "rate_sensor": {
            "gain_v_s_per_n": found.rate_sensor.model[0],
            "offset_v": found.rate_sensor.model[1],
            "r_squared": found.rate_sensor.r_squared,
        },
        "coefficients": {
            "frequencies": planes,
            "r_squared": found.planes_r_squared,
            "rate": decay(&found.coefficients.rate),
            "acceleration": decay(&found.coefficients.acceleration),
            "exponentials_r_squared": found.exponentials_r_squared,
        },
        "amplifier": {
            "sensitivity_v_s_per_n": amplifier.sensitivity,
            "feedback_s": amplifier.feedback_s,
            "lag_s": amplifier.lag_s,
            "bias_v": found.amplifier.model.bias,
            "r_squared": found.amplifier.r_squared,
            "residual_v": found.amplifier.residual,
        },
        "residuals": found.residuals,
    })
}
