//! Tables of a study of robustness for the terminal.

use std::path::PathBuf;

use twinrig_campaign::spread::EnsembleKind;
use twinrig_campaign::sweep::percent;
use twinrig_study::{RobustnessResult, RobustnessStudy, margin_text};

use crate::study::layout::StudyText;
use twinrig_report::text::grid::{Cell, Grid, Left, Right};
use twinrig_report::text::style::RED;

/// Formats the results of a study and the names of its files.
pub fn text(study: &RobustnessStudy, files: &[PathBuf]) -> String {
    let title = match &*study.results {
        [only] => only.case.scenario.clone(),
        all => format!("{} scenarios", all.len()),
    };
    let mut text = StudyText::new(&title, "study of robustness", String::new());
    for result in &study.results {
        let (scenario, plant) = (&result.case.scenario, &result.case.plant);
        text.table(&format!("{scenario} on {plant}"), &expectations(result));
        text.block(facts(study, result));
    }
    if study.results.len() > 1 {
        text.table("all scenarios", &summary(study));
    }
    text.finish(&study.left_out, files)
}

fn expectations(result: &RobustnessResult) -> Grid {
    let mut grid = Grid::new(&[Left, Right, Left, Right, Right, Right, Right, Left]);
    grid.header("expectation | holds | 95 % interval | least margin | median | greatest | not observed | changes at");
    for one in &result.expectations {
        let margins = one.margins.map(|it| [it.min, it.median, it.max]);
        let margins = margins.map(|them| them.map(|margin| margin_text(one, margin)));
        let [least, median, greatest] = margins.unwrap_or_default();
        let holds = format!("{} of {}", one.held, one.runs);
        grid.row([
            one.name.clone().into(),
            if one.held < one.runs {
                Cell::new(holds, RED)
            } else {
                holds.into()
            },
            format!(
                "{} … {}",
                percent(one.interval.low),
                percent(one.interval.high)
            )
            .into(),
            least.into(),
            median.into(),
            greatest.into(),
            match one.unobserved {
                0 => "".into(),
                count => count.to_string().into(),
            },
            one.changes_at
                .map_or(String::new(), |at| at.to_string())
                .into(),
        ]);
    }
    grid
}

/// Returns horizon, growth and crossing times of a case.
fn facts(study: &RobustnessStudy, result: &RobustnessResult) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(why) = &result.case.why_seeds {
        lines.push(format!("  the runs differ by their seed: {why}"));
    }
    let undetermined: Vec<&str> = result.undetermined().map(|it| &*it.name).collect();
    if !undetermined.is_empty() {
        let names = undetermined.join(", ");
        lines.push(format!("  changes with a perturbation of 1 ulp: {names}"));
    }
    if result.case.unit.is_none() {
        lines.push("  predictability horizon: no positions are observed".to_owned());
        return lines;
    }
    let by = match result.case.kind {
        EnsembleKind::Starts => "of runs 1 ulp apart",
        EnsembleKind::Seeds => "of runs with other seeds",
    };
    lines.push(format!(
        "  predictability horizon {by}, tolerance {}: {}",
        study.tolerance_text(result),
        result.horizon_text()
    ));
    lines.push(format!("  growth of distances: {}", result.growth_text()));
    lines
}

fn summary(study: &RobustnessStudy) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Right, Right, Left, Left]);
    grid.header("scenario | plant | hold in all runs | horizon | growth | changes at 1 ulp");
    for result in &study.results {
        let all = &result.expectations;
        let always = all.iter().filter(|it| it.held == it.runs).count();
        let undetermined: Vec<&str> = result.undetermined().map(|it| &*it.name).collect();
        grid.row([
            result.case.scenario.clone().into(),
            result.case.plant.clone().into(),
            format!("{always} of {}", all.len()).into(),
            result.horizon_text().into(),
            result.growth_text().into(),
            undetermined.join(", ").into(),
        ]);
    }
    grid
}
