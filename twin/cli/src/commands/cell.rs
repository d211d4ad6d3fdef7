//! Command `twin cell`: design of piezoresistive cells, calibration and comparison of drawn ones.

mod calibrate;
mod compare;
mod fit;
mod predict;
mod report;

use report::CellReport;

use super::{FAILURE, SUCCESS, Terminal};
use crate::args::{CellArgs, CellCommand};
use crate::error::TwinError;
use twinrig_rig::registry::Registry;

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

fn print(report: &impl CellReport, json: bool, terminal: &mut Terminal<'_>) {
    if json {
        terminal.print_json(report);
    } else {
        terminal.print(&report.lines().join("\n"));
    }
}
