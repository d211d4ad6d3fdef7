//! Calibration of a sensor: the constants of its filters, from one recorded run.

use std::fmt::Write as _;

use twinrig_estimate::fit::{self, ForceSample};
use twinrig_estimate::{Calibration, Hysteresis};
use twinrig_record::{Digest, Fingerprint};

use super::data::{LoadRun, Phase, Signals};
use super::identify::identify;
use super::settings_text::{number, quantity, sigmoid};
use crate::error::StudyError;

/// Where a calibration comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationRun {
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of the run.
    pub seed: u64,
    /// Number of the drawn cell; `None`: the design, or a real cell.
    pub cell: Option<u64>,
}

/// Cut-off frequency of the low-pass filter of the piezoresistive identification \[Hz\]. ASSUMED.
/// Behind that of 10 Hz the corners of a saturated voltage are round, and the filters do without
/// it.
const CUTOFF: f64 = 100.0;

/// Identifies both cells from a run of a bench, in which the frequency of the load changes.
///
/// Creep is identified only if it changes in the course of the run: a minute at least.
///
/// # Errors
/// [`StudyError`] if the run is unsuitable or an identification is impossible.
pub fn calibrate(run: &LoadRun) -> Result<Calibration, StudyError> {
    let smooth = Signals::new(run, Phase::Zero)?;
    let found = identify(&smooth)?;
    let signals = Signals::below(run, Phase::Zero, CUTOFF)?;
    let sample = |i: usize| ForceSample {
        force: signals.force[i],
        rate: signals.rate[i],
        voltage: signals.volts[0][i],
    };
    let samples: Vec<ForceSample> = (0..signals.force.len()).map(sample).collect();
    let mut counts = vec![false; samples.len()];
    for i in signals.steady() {
        counts[i] = !signals.saturated[i][0];
    }
    let counted: Vec<ForceSample> = samples
        .iter()
        .zip(&counts)
        .filter_map(|(it, &counts)| counts.then_some(*it))
        .collect();
    let still = fit::hysteresis(&counted, None)?;
    let creep = fit::creep(signals.period_s, &samples, &counts)?;
    let calibration = Calibration {
        hysteresis: still.model,
        hysteresis_residual: still.residual,
        creep: creep.model,
        creep_residual: creep.residual,
        rate_gain: found.rate_sensor.model[0],
        rate: found.coefficients.rate.model,
        acceleration: found.coefficients.acceleration.model,
        amplifier: found.amplifier.model.amplifier,
        amplifier_residual: found.amplifier.residual,
    };
    calibration.check()?;
    Ok(calibration)
}

/// Returns the fingerprint of the samples of a run: their times, voltages and reference forces.
pub fn samples_fingerprint(run: &LoadRun) -> Digest {
    let mut fingerprint = Fingerprint::new();
    for it in &run.samples {
        fingerprint.sample(it.at_ns, 0, &[it.volts[0], it.volts[1], it.reference]);
    }
    fingerprint.digest()
}

/// Returns the file of a calibration, which filters of scenarios name.
pub fn calibration_text(found: &Calibration, source: &CalibrationRun, samples: &Digest) -> String {
    let mut text = String::from(
        "# Constants of the cells of a tactile sensor as `twin cell calibrate` identified them from a\n\
         # run against the reference cell. Filters name this file: `calibration = \"NAME\"`.\n\n",
    );
    // Writing to a `String` cannot fail.
    let _ = writeln!(text, "[run]");
    let _ = writeln!(text, "scenario = {:?}", source.scenario);
    let _ = writeln!(text, "seed = {}", source.seed);
    if let Some(cell) = source.cell {
        let _ = writeln!(text, "cell = {cell}");
    }
    let _ = writeln!(
        text,
        "fingerprint = \"{samples}\"            # of its samples"
    );
    let _ = writeln!(
        text,
        "\n# Over the whole run, creep included: F1, F2 and F3.\n[piezoresistive]"
    );
    text += &hysteresis(&found.hysteresis);
    let residual = quantity(found.hysteresis_residual, "V");
    let _ = writeln!(text, "residual = {residual}");
    let _ = writeln!(
        text,
        "\n# At the first sample; (voltage - floor) rises by a share of per_newton \
         [1/N] times the load: F4.\n[piezoresistive.creep]"
    );
    text += &hysteresis(&found.creep.hysteresis);
    let _ = writeln!(text, "floor = {}", quantity(found.creep.floor, "V"));
    let _ = writeln!(text, "per_newton = {}", number(found.creep.per_newton));
    let _ = writeln!(text, "time = {}", quantity(found.creep.time_s, "s"));
    let residual = quantity(found.creep_residual, "V");
    let _ = writeln!(text, "residual = {residual}");
    let _ = writeln!(
        text,
        "\n# rate_gain: F1; rate, acceleration: F2; the others: F3 and F4."
    );
    text += &piezoelectric(found);
    text
}

fn hysteresis(response: &Hysteresis) -> String {
    format!(
        "loading = {}\nunloading = {}\nswitch = {}\n",
        sigmoid(&response.loading),
        sigmoid(&response.unloading),
        quantity(1.0 / response.switch, "N/s"),
    )
}

fn piezoelectric(found: &Calibration) -> String {
    let decay = |decay: &twinrig_estimate::Decay| {
        let scale = quantity(decay.scale_hz, "Hz");
        format!("{{ value = {}, scale = {scale} }}", number(decay.value))
    };
    format!(
        "[piezoelectric]\nrate_gain = {}\nrate = {}\nacceleration = {}\ngain = {}\n\
         amplifier_time = {}\nsilicone_time = {}\nresidual = {}\n",
        quantity(found.rate_gain, "V·s/N"),
        decay(&found.rate),
        decay(&found.acceleration),
        quantity(-found.amplifier.sensitivity, "V·s/N"),
        quantity(1e3 * found.amplifier.feedback_s, "ms"),
        quantity(1e3 * found.amplifier.lag_s, "ms"),
        quantity(found.amplifier_residual, "V"),
    )
}
