//! Command `twin cell`: design of piezoresistive cells.

mod fit;
mod predict;

use serde::Serialize;
use twinrig_sensor::design::CellResponse;

use super::{FAILURE, SUCCESS, Terminal};
use crate::args::{CellArgs, CellCommand};
use crate::error::TwinError;

/// Result of a command, for programs and for readers.
trait CellReport: Serialize {
    /// Returns the lines of the report.
    fn lines(&self) -> Vec<String>;
}

pub(super) fn cell(args: &CellArgs, terminal: &mut Terminal<'_>) -> u8 {
    let done = match &args.command {
        CellCommand::Fit(_) => {
            fit::FitReport::new().map(|report| print(&report, args.json(), terminal))
        }
        CellCommand::Predict(args) => {
            predict::PredictionReport::new(args).map(|report| print(&report, args.json, terminal))
        }
    };
    match done {
        Ok(()) => SUCCESS,
        Err(source) => {
            terminal.report_error(&TwinError::Cell { source }, args.json());
            FAILURE
        }
    }
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
