//! Common parts of the reports on cells.

use serde::Serialize;
use twinrig_scenario::Setting;
use twinrig_sensor::design::CellResponse;

/// Result of a command, for programs and for readers.
pub(super) trait CellReport: Serialize {
    /// Returns the lines of the report.
    fn lines(&self) -> Vec<String>;
}

/// Returns the settings of `--set`.
pub(super) fn settings(set: &[(String, String)]) -> Vec<Setting> {
    let setting = |(key, value): &(String, String)| Setting {
        origin: "--set".to_owned(),
        key: key.clone(),
        value: value.clone(),
    };
    set.iter().map(setting).collect()
}

/// Key of a response in JSON, with its unit.
pub(super) fn key(response: CellResponse) -> &'static str {
    match response {
        CellResponse::Sensitivity => "sensitivity_s_per_n",
        CellResponse::Base => "base_conductance_s",
        CellResponse::Saturation => "saturation_load_n",
    }
}

/// Formats a number with four significant digits.
pub(super) fn four(value: f64) -> String {
    let exponent = format!("{value:.3e}");
    let (_, power) = exponent.split_once('e').unwrap_or_default();
    match power.parse::<usize>() {
        Ok(power @ 0..=3) => format!("{value:.*}", 3 - power),
        Err(_) if power == "-1" => format!("{value:.4}"),
        _ => exponent,
    }
}
