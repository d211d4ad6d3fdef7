//! `twin cell predict`: predicted characteristic and amplifier output of a cell.

use serde::Serialize;
use twinrig_sensor::design::{
    AliasedReading, CellDesign, CellPrediction, CellResponse, Electrode, PredictionInterval,
};
use twinrig_sensor::{ResistanceAmplifier, SensorError};

use super::report::{CellReport, four, key};
use crate::args::{CellPredictArgs, ElectrodeName};
use twinrig_report::text::grid::{Cell, Grid, Left, Right};
use twinrig_report::text::style::{BOLD, DIM, YELLOW, styled};

/// Greatest load of the demands on a sensor of leg load (thesis, table 4.1) \[N\].
const DEMANDED: f64 = 20.0;

/// Predicted cell.
#[derive(Debug, Serialize)]
pub(super) struct PredictionReport {
    design: Design,
    coverage: f64,
    sensitivity_s_per_n: Interval,
    base_conductance_s: Interval,
    saturation_load_n: Interval,
    amplifier: Amplifier,
    /// Predictions of the same models with an interaction attributed to its alias.
    aliased: Vec<Reading>,
    warnings: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Design {
    r#type: &'static str,
    layers: u32,
    glue: bool,
    length_m: f64,
    width_m: f64,
}

#[derive(Debug, Serialize)]
struct Amplifier {
    feedback_ohm: f64,
    reference_v: f64,
    unloaded_v: Interval,
    at_20_n_v: Interval,
    saturated_v: Interval,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Interval {
    value: f64,
    low: f64,
    high: f64,
}

#[derive(Debug, Serialize)]
struct Reading {
    response: &'static str,
    effect: String,
    alias: String,
    value: f64,
}

impl From<PredictionInterval> for Interval {
    fn from(of: PredictionInterval) -> Self {
        Self {
            value: of.value,
            low: of.low,
            high: of.high,
        }
    }
}

impl From<&AliasedReading> for Reading {
    fn from(of: &AliasedReading) -> Self {
        Self {
            response: key(of.response),
            effect: of.effect.to_string(),
            alias: of.alias.to_string(),
            value: of.value,
        }
    }
}

impl PredictionReport {
    pub(super) fn new(args: &CellPredictArgs) -> Result<Self, SensorError> {
        let electrode = match args.electrode {
            ElectrodeName::A => Electrode::A,
            ElectrodeName::B => Electrode::B,
        };
        let design = CellDesign {
            electrode,
            layers: args.layers,
            glue: args.glue,
            length: args.length,
            width: args.width,
        };
        let prediction = CellPrediction::of(&design)?;
        let amplifier = ResistanceAmplifier {
            feedback: args.feedback,
            reference: args.reference,
            rail: f64::INFINITY,
        };
        let volts = |load| prediction.volts(&amplifier, load).into();
        Ok(Self {
            design: Design {
                r#type: match electrode {
                    Electrode::A => "A",
                    Electrode::B => "B",
                },
                layers: args.layers,
                glue: args.glue,
                length_m: args.length,
                width_m: args.width,
            },
            coverage: CellPrediction::COVERAGE,
            sensitivity_s_per_n: prediction.sensitivity.into(),
            base_conductance_s: prediction.base.into(),
            saturation_load_n: prediction.saturation.into(),
            amplifier: Amplifier {
                feedback_ohm: args.feedback,
                reference_v: args.reference,
                unloaded_v: volts(0.0),
                at_20_n_v: volts(DEMANDED),
                saturated_v: volts(f64::INFINITY),
            },
            aliased: prediction.readings.iter().map(Reading::from).collect(),
            warnings: prediction
                .departures
                .iter()
                .map(ToString::to_string)
                .collect(),
        })
    }

    fn title(&self) -> String {
        let of = &self.design;
        let glue = if of.glue { "glue" } else { "no glue" };
        let layers = if of.layers == 1 { "layer" } else { "layers" };
        let title = format!("type {}, {} {layers}, {glue}", of.r#type, of.layers);
        let [length, width] = [of.length_m, of.width_m].map(millimetres);
        let size = format!("length {length} mm, width {width} mm");
        format!("{}  {}", styled(BOLD, &title), styled(DIM, &size))
    }

    fn grid(&self) -> Grid {
        let mut grid = Grid::new(&[Left, Right, Right, Left, Left]);
        grid.header("| predicted | 95 % prediction interval ||");
        let responses = [
            (CellResponse::Sensitivity, self.sensitivity_s_per_n),
            (CellResponse::Base, self.base_conductance_s),
            (CellResponse::Saturation, self.saturation_load_n),
        ];
        for (response, interval) in responses {
            let alias = self.aliased.iter().find(|of| of.response == key(response));
            let alias = alias
                .map(|of| format!("{} if {} is really {}", four(of.value), of.effect, of.alias));
            grid.row(row(
                response.name(),
                interval,
                response.unit(),
                alias.unwrap_or_default(),
            ));
        }
        let outputs = [
            ("output without load", self.amplifier.unloaded_v),
            ("output at 20 N", self.amplifier.at_20_n_v),
            ("output, saturated", self.amplifier.saturated_v),
        ];
        for (name, interval) in outputs {
            grid.row(row(name, interval, "V", String::new()));
        }
        grid
    }
}

fn row(name: &str, of: Interval, unit: &'static str, note: String) -> [Cell; 5] {
    let ends = format!("{} … {}", four(of.low), four(of.high));
    [
        name.into(),
        Cell::new(four(of.value), BOLD),
        ends.into(),
        unit.into(),
        Cell::new(note, DIM),
    ]
}

/// Returns a length in millimetres, to the micrometre.
fn millimetres(length: f64) -> f64 {
    (length * 1e6).round() / 1e3
}

impl CellReport for PredictionReport {
    fn lines(&self) -> Vec<String> {
        let mut lines = vec![self.title(), String::new()];
        lines.extend(self.grid().lines(2));
        lines.push(String::new());
        for warning in &self.warnings {
            lines.push(format!("  {} {warning}", styled(YELLOW, "!")));
        }
        let amplifier = &self.amplifier;
        let notes = [
            format!(
                "amplifier of eq. 4.2 without a rail: feedback {} kΩ, reference {} mV",
                (amplifier.feedback_ohm * 1e3).round() / 1e6,
                (amplifier.reference_v * 1e6).round() / 1e3
            ),
            "intervals under load contain the output for all cells within joint intervals of the \
             three parameters"
                .to_owned(),
        ];
        lines.extend(notes.map(|note| format!("  {}", styled(DIM, &note))));
        let impossible = [self.sensitivity_s_per_n, self.saturation_load_n];
        if impossible.iter().any(|interval| interval.low < 0.0) {
            let note = "a negative sensitivity or saturation load is impossible; a linear model \
                        with normal errors does not exclude it";
            lines.push(format!("  {}", styled(DIM, note)));
        }
        lines
    }
}
