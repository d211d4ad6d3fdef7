//! Files of the result of an optimisation.

use std::path::{Path, PathBuf};

use twinrig_campaign::optimization::OptimizationResult;
use twinrig_campaign::sweep::Partition;
use twinrig_report::number::precise;
use twinrig_rig::scenario_text::ScenarioText;
use twinrig_scenario::Setting;

use super::evaluation_class;
use super::plan::OptimizationPlan;
use crate::error::Error;
use crate::sweep::files::replace;

/// File of the result.
const RESULT: &str = "optimization.json";

/// Writes `best.toml`, `history.csv`, `points.csv`, `optimization.json` and `report.html` into a
/// folder; returns their paths. The caller has the lock of the rows.
pub(super) fn write(
    plan: &OptimizationPlan<'_>,
    result: &OptimizationResult,
    folder: &Path,
) -> Result<Vec<PathBuf>, Error> {
    // Serialisation fails only for keys that are not strings.
    let json = serde_json::to_string_pretty(result).unwrap_or_default();
    let mut texts = vec![
        ("history.csv", result.history_csv()),
        ("points.csv", result.points_csv()),
        (RESULT, json + "\n"),
        ("report.html", crate::optimization_page(result).html()),
    ];
    texts.extend(best(plan, result, folder)?.map(|text| ("best.toml", text)));
    let written = texts.into_iter();
    written
        .map(|(name, text)| replace(folder.join(name), Partition::WHOLE, &text))
        .collect()
}

/// Refuses a folder that has the result of another search space, scenario or setting, which would
/// be overwritten: two spaces may have one name. A folder without a result is free.
pub(super) fn refuse_foreign(plan: &OptimizationPlan<'_>, folder: &Path) -> Result<(), Error> {
    let result = folder.join(RESULT);
    let Ok(text) = std::fs::read_to_string(&result) else {
        return Ok(());
    };
    let Ok(found) = serde_json::from_str::<serde_json::Value>(&text) else {
        return Ok(());
    };
    let foreign = |of: String| {
        Err(Error::ForeignResult {
            path: result.clone(),
            of,
        })
    };
    for (key, file) in [("space", &plan.space.file), ("file", &plan.runs.file)] {
        let other = found[key].as_str().unwrap_or_default();
        let path = |name: &str| std::fs::canonicalize(name).ok();
        if other != file && (path(other).is_none() || path(other) != path(file)) {
            return foreign(other.to_owned());
        }
    }
    if found["settings"] != serde_json::json!(plan.runs.base_pairs()) {
        return foreign("the same files with other settings".to_owned());
    }
    Ok(())
}

/// Returns the scenario with the settings of the best point; none if no point has a value of the
/// objective.
fn best(
    plan: &OptimizationPlan<'_>,
    result: &OptimizationResult,
    folder: &Path,
) -> Result<Option<String>, Error> {
    let Some(best) = result.best.as_ref() else {
        return Ok(None);
    };
    let Some(value) = best.evaluation.objective else {
        return Ok(None);
    };
    let values = result.dimensions.iter().zip(&best.point);
    let values = values.map(|(dimension, value)| Setting {
        origin: String::new(),
        key: dimension.key.clone(),
        value: value.toml.clone(),
    });
    let settings: Vec<Setting> = plan.set.iter().cloned().chain(values).collect();
    let header = [
        format!(
            "Best of {} evaluations of {} in the search space {}:",
            result.counts.evaluations, result.file, result.space
        ),
        format!(
            "{} {} = {}, {}, evaluation {}.",
            result.direction.word(),
            result.objective,
            precise(value, &result.unit),
            evaluation_class(&best.evaluation),
            best.number
        ),
        format!(
            "method {}, {} particles, {} iterations, seed {}",
            result.method.word(),
            result.particles,
            result.iterations,
            result.seed
        ),
    ];
    let scenario = ScenarioText {
        path: Path::new(&result.file),
        text: plan.document.text(),
        to: folder,
    };
    Ok(Some(scenario.with(&settings, &header)?))
}
