//! Tables of a study of footstep modulation for the terminal.

use std::path::PathBuf;

use twinrig_study::{
    CaseResult, Counting, DisplacementTable, LinearModel, ModelForm, ModulationStudy,
};

use twinrig_report::summary::Summary;
use twinrig_report::text::grid::{Cell, Grid, Left, Right, Side};
use twinrig_report::text::style::{GREEN, YELLOW};

/// Formats the results of a study and the names of its files.
pub fn text(study: &ModulationStudy, files: &[PathBuf]) -> String {
    let mut text = Summary::new(
        &study.input.name,
        "study of footstep modulation",
        study.headline(),
    );
    if let [case] = &*study.cases {
        for table in &case.tables {
            let name = format!("mean displacement by {} [mm]", table.counting.name());
            text.grid(&name, &means(study, table));
        }
    }
    text.grid("models of the displacement d of step n", &models(study));
    for case in &study.cases {
        if let Some(why) = &case.why {
            text.fact("no result", format!("{}: {why}", case.label()));
        }
        if let Some(first) = case.failed.first() {
            let failed = format!("{} of {}: {first}", case.failed.len(), case.label());
            text.fact("failed", failed);
        }
    }
    text.left_out(&study.input.left_out);
    text.finish(files)
}

/// Changes by steps; means against the change are marked.
fn means(study: &ModulationStudy, table: &DisplacementTable) -> Grid {
    let steps = study.plan.steps;
    let mut sides: Vec<Side> = vec![Right; steps + 1];
    sides[0] = Left;
    let mut grid = Grid::new(&sides);
    let head: Vec<String> = (1..=steps).map(|step| step.to_string()).collect();
    grid.header(&format!("Δ | {}", head.join(" | ")));
    for by in &study.plan.changes {
        let cells = (1..=steps).map(|step| {
            let cell = table.cell(*by, step).filter(|cell| cell.count > 0);
            cell.map_or(Cell::default(), |cell| {
                let text = format!("{:.1}", 1e3 * cell.mean_m);
                if cell.mean_m * by < 0.0 {
                    Cell::new(text, YELLOW)
                } else {
                    text.into()
                }
            })
        });
        let row: Vec<Cell> = std::iter::once(study.change_text(*by).into())
            .chain(cells)
            .collect();
        grid.row(row);
    }
    grid
}

fn models(study: &ModulationStudy) -> Grid {
    let mut sides = [Right; 13];
    sides[..4].fill(Left);
    let mut grid = Grid::new(&sides);
    grid.header(
        "gait | plant | factor | counted by | k, (k n + k₀) Δ | 95 % | k₀ | by geometry | R² \
         | R², k n Δ | first step with Δ | against Δ, at most | missing, fell",
    );
    let mut before = String::new();
    for case in &study.cases {
        for table in &case.tables {
            let label = case.label();
            let repeated = label == before;
            before = label;
            grid.row(model_cells(case, table, repeated));
        }
    }
    grid
}

fn model_cells(case: &CaseResult, table: &DisplacementTable, repeated: bool) -> [Cell; 13] {
    let named = |text: &str| {
        if repeated {
            String::new()
        } else {
            text.to_owned()
        }
    };
    let model = table.model(ModelForm::BilinearWithFirstStep);
    let number = |of: &dyn Fn(&LinearModel) -> String| model.map_or(String::new(), of);
    let interval = |model: &LinearModel| {
        model
            .interval
            .map_or(String::new(), |[low, high]| format!("{low:.2} … {high:.2}"))
    };
    let ideal = case.ideal.filter(|_| table.counting == Counting::Cycle);
    let ideal = ideal.map_or(String::new(), |ideal| format!("{:.2}", ideal.by_duty));
    let product = table.model(ModelForm::Bilinear);
    let product = product.map_or(String::new(), |model| format!("{:.3}", model.r_squared));
    let first = table.first_step;
    let first = first.map_or(String::new(), |share| {
        format!("{:.0} %", (100.0 * share).floor())
    });
    let style = if ModulationStudy::is_erratic(table) {
        YELLOW
    } else {
        GREEN
    };
    let opposite = Cell::new(format!("{:.1} mm", 1e3 * table.opposite_m()), style);
    [
        named(&case.case.gait).into(),
        named(&case.case.plant).into(),
        named(&case.case.factor).into(),
        table.counting.name().into(),
        number(&|model| format!("{:.2}", model.slope)).into(),
        number(&interval).into(),
        number(&|model| format!("{:.2}", model.second)).into(),
        ideal.into(),
        number(&|model| format!("{:.3}", model.r_squared)).into(),
        product.into(),
        first.into(),
        opposite,
        format!("{}, {}", table.missing(), case.fell).into(),
    ]
}
