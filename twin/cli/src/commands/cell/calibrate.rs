//! `twin cell calibrate`: the constants of a sensor for its filters.

use std::fs;
use std::path::Path;

use twinrig_estimate::Calibration;
use twinrig_experiment::{
    BenchRecorder, CalibrationRun, LoadRecorder, LoadRun, calibrate as identify, calibration_text,
    samples_fingerprint,
};
use twinrig_rig::error::Error;
use twinrig_rig::registry::Registry;

use super::report::settings;
use crate::args::CellCalibrateArgs;
use crate::commands::{Terminal, outputs};
use crate::error::TwinError;

/// Identifies the sensor and writes its calibration.
pub(super) fn calibrate(
    registry: &Registry,
    args: &CellCalibrateArgs,
    terminal: &mut Terminal<'_>,
) -> Result<(), TwinError> {
    if let Some(file) = &args.output {
        outputs::check_file(file)?;
    }
    let settings = settings(&args.set);
    let bench = BenchRecorder::new(registry, &args.scenario, &settings)?;
    let seed = bench.input().seed;
    let run = bench.recorded(seed)?;
    let found = constants(&args.scenario, &run)?;
    let source = CalibrationRun {
        scenario: bench.input().name.clone(),
        seed,
        cell: bench.cell(),
    };
    let text = calibration_text(&found, &source, &samples_fingerprint(&run));
    match &args.output {
        None => terminal.print(text.trim_end()),
        Some(file) => fs::write(file, &text).map_err(|source| {
            TwinError::from(Error::Write {
                path: file.clone(),
                source,
            })
        })?,
    }
    Ok(())
}

/// Identifies the constants from a run of a scenario.
pub(super) fn constants(scenario: &Path, run: &LoadRun) -> Result<Calibration, TwinError> {
    let found = identify(run);
    let file = scenario.display().to_string();
    found.map_err(|source| twinrig_experiment::Error::of_study(&file, source).into())
}
