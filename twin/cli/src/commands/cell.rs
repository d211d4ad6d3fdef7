//! Command `twin cell`: design of piezoresistive cells, calibration and comparison of drawn ones.

mod calibrate;
mod compare;
mod fit;
mod predict;

use serde::Serialize;
use twinrig_scenario::Setting;
use twinrig_sensor::design::CellResponse;

use super::{FAILURE, SUCCESS, Terminal};
use crate::args::{CellArgs, CellCommand};
use crate::error::TwinError;
use twinrig_rig::registry::Registry;

/// Result of a command, for programs and for readers.
trait CellReport: Serialize {
    /// Returns the lines of the report.
    fn lines(&self) -> Vec<String>;
}

pub(super) fn cell(registry: &Registry, args: &CellArgs, terminal: &mut Terminal<'_>) -> u8 {
    let of_design = |source| TwinError::Cell { source };
    let done = match &args.command {
        CellCommand::Fit(_) => fit::FitReport::new()
            .map(|report| print(&report, args.json(), terminal))
            .map_err(of_design),
        CellCommand::Predict(args) => predict::PredictionReport::new(args)
            .map(|report| print(&report, args.json, terminal))
            .map_err(of_design),
        CellCommand::Calibrate(args) => calibrate::calibrate(registry, args, terminal),
        CellCommand::Compare(args) => {
            compare::compare(registry, args).map(|report| print(&report, args.json, terminal))
        }
    };
    match done {
        Ok(()) => SUCCESS,
        Err(error) => {
            terminal.report_error(&error, args.json());
            FAILURE
        }
    }
}

/// Returns the settings of `--set`.
fn settings(set: &[(String, String)]) -> Vec<Setting> {
    let setting = |(key, value): &(String, String)| Setting {
        origin: "--set".to_owned(),
        key: key.clone(),
        value: value.clone(),
    };
    set.iter().map(setting).collect()
}

fn print(report: &impl CellReport, json: bool, terminal: &mut Terminal<'_>) {
    if json {
        terminal.print_json(report);
    } else {
        terminal.print(&report.lines().join("\n"));
    }
}

/// Key of a response in JSON, with its unit.
fn key(response: CellResponse) -> &'static str {
    match response {
        CellResponse::Sensitivity => "sensitivity_s_per_n",
        CellResponse::Base => "base_conductance_s",
        CellResponse::Saturation => "saturation_load_n",
    }
}

/// Formats a number with four significant digits.
fn four(value: f64) -> String {
    let exponent = format!("{value:.3e}");
    let (_, power) = exponent.split_once('e').unwrap_or_default();
    match power.parse::<usize>() {
        Ok(power @ 0..=3) => format!("{value:.*}", 3 - power),
        Err(_) if power == "-1" => format!("{value:.4}"),
        _ => exponent,
    }
}
