//! Page of a study of footstep modulation.

use twinrig_kernel::Unit;

use crate::machine::Machine;
use crate::modulation::{
    CaseResult, Counting, DisplacementCell, DisplacementTable, LinearModel, ModelForm,
    ModulationStudy,
};
use twinrig_report::number::plain;

use super::{card, document, drawing, introduction, reproduction};
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::line_plot::{LinePlot, Series, Shape};
use twinrig_report::html::marker::COLOURS;
use twinrig_report::html::marker::swatch;
use twinrig_report::html::surface::Surface;
use twinrig_report::html::table::HtmlTable;

impl ModulationStudy {
    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn html(&self, machine: &Machine, command: &str) -> String {
        let mut terms = vec![
            (
                "displacement".to_owned(),
                "position of a footstep along the heading of its leg in the reference run, minus \
                 that of the same footstep there"
                    .to_owned(),
            ),
            (
                "by cycle".to_owned(),
                "one footstep for each leg and cycle: the contact with the largest impulse; the \
                 cycle follows from the period of the leg"
                    .to_owned(),
            ),
            (
                "by touch-down".to_owned(),
                "every contact counts, bounces included".to_owned(),
            ),
            (
                "by geometry".to_owned(),
                "k = 1/d and k₀ = ½ − 1/(2 d) for feet that stand still while they move by the \
                 step length relative to the trunk, in the share d of the cycle that is commanded, or \
                 measured where none is commanded"
                    .to_owned(),
            ),
        ];
        let why = self.cases.iter().filter_map(|case| {
            let why = case.why.as_ref()?;
            Some(("no result".to_owned(), format!("{}: {why}", case.label())))
        });
        terms.extend(why);
        let left_out = self.input.left_out.iter();
        terms.extend(left_out.map(|left| ("left out".to_owned(), left.clone())));
        let title = format!("Footsteps after a change of {}", self.input.variable);
        document(
            "Study of footstep modulation",
            &format!("{title}: {}", self.input.name),
            &self.headline(),
            &(body(self) + &reproduction(machine, command, &self.input.files, &terms)),
        )
    }

    /// Returns a change as a number for an axis: millimetres for a length.
    fn axis_change(&self, by: f64) -> f64 {
        if self.input.unit == Unit::Meter {
            1e3 * by
        } else {
            by
        }
    }

    fn axis_label(&self) -> String {
        match self.input.unit {
            Unit::Meter => "Δ  [mm]".to_owned(),
            Unit::One => "Δ".to_owned(),
            unit => format!("Δ  [{}]", unit.symbol()),
        }
    }
}

fn body(study: &ModulationStudy) -> String {
    let mut out = introduction(&format!(
        "{} changes by each of {} amounts at each of {} points of the gait cycle; {} footsteps of \
         each leg are compared with the run without the change (thesis, section 3.2.5, figures \
         3.5 and 3.8).",
        study.input.variable,
        study.plan.changes.len(),
        study.plan.points,
        study.plan.steps
    ));
    let results: Vec<&CaseResult> = study.cases.iter().filter(|it| it.why.is_none()).collect();
    if let [case] = results[..] {
        out += &cards(case);
    }
    out += "<h2>Models of the displacement</h2>\n";
    out += &models(study);
    for case in results {
        let mut details = element("h2", "", &escaped(&case.label()));
        let surfaces: String = case.tables.iter().map(|it| surface(study, it)).collect();
        details += &element("div", "pair", &surfaces);
        let lines: String = case.tables.iter().map(|it| lines(study, it)).collect();
        details += &element("div", "pair", &lines);
        for table in &case.tables {
            details += &means(study, table);
        }
        out += &details;
    }
    out
}

fn cards(case: &CaseResult) -> String {
    let mut out = String::new();
    for table in &case.tables {
        let Some(model) = table.model(ModelForm::BilinearWithFirstStep) else {
            continue;
        };
        out += &card(
            &format!("by {}: displacement per step", table.counting.name()),
            &format!("{:.2} Δ", model.slope),
            &format!("R² {:.3}", model.r_squared),
        );
        out += &card(
            &format!("by {}: first step with Δ", table.counting.name()),
            &table.first_step.map_or(String::new(), percent),
            &format!("greatest mean against Δ {:.1} mm", 1e3 * table.opposite_m()),
        );
    }
    element("div", "cards", &out)
}

fn percent(share: f64) -> String {
    format!("{:.0} %", (100.0 * share).floor())
}

fn models(study: &ModulationStudy) -> String {
    let mut table = HtmlTable::new(
        "gait | plant | factor | counted by | k | 95 % | k₀ | k by geometry | k₀ by geometry \
         | stride over step | R², (k n + k₀) Δ | R², k n Δ | R², k n Δ + c | first step with Δ \
         | greatest mean against Δ | missing | fell | of",
        4,
    );
    let mut before = String::new();
    for case in &study.cases {
        for of in &case.tables {
            let label = case.label();
            let class = if label == before { "" } else { "first" };
            before = label;
            table.row(class, model_cells(study, case, of));
        }
    }
    table.html()
}

fn model_cells(
    study: &ModulationStudy,
    case: &CaseResult,
    table: &DisplacementTable,
) -> Vec<String> {
    let model = table.model(ModelForm::BilinearWithFirstStep);
    let number = |of: &dyn Fn(&LinearModel) -> String| model.map_or(String::new(), of);
    let r_squared = |form: ModelForm| {
        let model = table.model(form);
        model.map_or(String::new(), |model| format!("{:.3}", model.r_squared))
    };
    let geometry = |value: Option<f64>| value.map_or(String::new(), |it| format!("{it:.2}"));
    let opposite = table.opposite.map_or_else(
        || "0".to_owned(),
        |cell| {
            format!(
                "{:.1} mm at step {}, {}",
                1e3 * table.opposite_m(),
                cell.step,
                study.change_text(cell.by)
            )
        },
    );
    let tag = if ModulationStudy::is_erratic(table) {
        "tag bad"
    } else {
        "tag ok"
    };
    vec![
        element("b", "", &escaped(&case.case.gait)),
        escaped(&case.case.plant),
        escaped(&case.case.factor),
        table.counting.name().to_owned(),
        number(&|it| format!("{:.3}", it.slope)),
        number(&|it| {
            let interval = it.interval;
            interval.map_or(String::new(), |[low, high]| format!("{low:.2}–{high:.2}"))
        }),
        number(&|it| format!("{:.2}", it.second)),
        geometry(case.ideal.map(|it| it.by_duty)),
        geometry(case.ideal.map(|it| it.first_step)),
        geometry(case.ideal.map(|it| it.by_stride)),
        r_squared(ModelForm::BilinearWithFirstStep),
        r_squared(ModelForm::Bilinear),
        r_squared(ModelForm::BilinearWithConstant),
        table.first_step.map_or(String::new(), percent),
        element("span", tag, &escaped(&opposite)),
        table.missing().to_string(),
        case.fell.to_string(),
        case.runs.to_string(),
    ]
}

fn surface(study: &ModulationStudy, table: &DisplacementTable) -> String {
    let height = |by: f64, step: usize| {
        let cell = table.cell(by, step).filter(|cell| cell.count > 0);
        cell.map_or(f64::NAN, |cell| 1e3 * cell.mean_m)
    };
    let mut changes = study.plan.changes.clone();
    changes.sort_by(f64::total_cmp);
    changes.dedup();
    let steps = 1..=study.plan.steps;
    let rows = changes.iter();
    let rows = rows.map(|by| steps.clone().map(|step| height(*by, step)).collect());
    let surface = Surface {
        title: format!("mean displacement by {}", table.counting.name()),
        labels: [
            study.axis_label(),
            "footstep".to_owned(),
            "mean displacement  [mm]".to_owned(),
        ],
        heights: rows.collect(),
        first: changes
            .iter()
            .map(|by| {
                let value = study.axis_change(*by);
                (value, plain(value))
            })
            .collect(),
        second: steps.map(|step| (step as f64, step.to_string())).collect(),
    };
    let heading = format!("Mean displacement by {}", table.counting.name());
    let caption = match table.counting {
        Counting::Cycle => "Blue: backwards; orange: forwards. Means over points and legs.",
        Counting::TouchDown => "The same, every touch-down counted.",
    };
    drawing(&heading, &[], &surface.svg(), caption)
}

fn lines(study: &ModulationStudy, table: &DisplacementTable) -> String {
    let mut series = Vec::new();
    let mut entries = Vec::new();
    for (number, by) in study.plan.changes.iter().enumerate() {
        let steps = 1..=study.plan.steps;
        let cells = steps.filter_map(|step| table.cell(*by, step));
        let cells: Vec<&DisplacementCell> = cells.filter(|cell| cell.count > 0).collect();
        // Beside each other, so that the deviations can be told apart.
        let count = study.plan.changes.len() as f64;
        let aside = 0.5 * (number as f64 / count - 0.5);
        let x = |cell: &DisplacementCell| cell.step as f64 + aside;
        let errors = cells.iter().map(|cell| {
            let [mean, deviation] = [cell.mean_m, cell.deviation_m].map(|it| 1e3 * it);
            [x(cell), mean - deviation, mean + deviation]
        });
        let line = cells.iter().map(|cell| [x(cell), 1e3 * cell.mean_m]);
        // Colours recur.
        let dashed = number >= COLOURS;
        let line = line.collect();
        let line = if dashed {
            Shape::Dashed(line)
        } else {
            Shape::Line(line)
        };
        let shapes = [Shape::Errors(errors.collect()), line];
        series.extend(shapes.map(|shape| Series { number, shape }));
        entries.push((swatch(number, dashed), study.change_text(*by)));
    }
    let plot = LinePlot {
        title: format!("displacement by {}", table.counting.name()),
        width: 540.0,
        height: 340.0,
        x_label: "footstep after the change".to_owned(),
        y_label: "displacement  [mm]".to_owned(),
        series,
    };
    let heading = format!("Mean and standard deviation by {}", table.counting.name());
    drawing(&heading, &entries, &plot.svg(), "")
}

fn means(study: &ModulationStudy, table: &DisplacementTable) -> String {
    let steps: Vec<String> = (1..=study.plan.steps).map(|it| it.to_string()).collect();
    let mut out = HtmlTable::new(&format!("Δ | {}", steps.join(" | ")), 1);
    for by in &study.plan.changes {
        let cells = (1..=study.plan.steps).map(|step| {
            let cell = table.cell(*by, step).filter(|cell| cell.count > 0);
            cell.map_or(String::new(), |cell| {
                let [mean, deviation] = [cell.mean_m, cell.deviation_m].map(|it| 1e3 * it);
                format!("{mean:.1} ± {deviation:.1}")
            })
        });
        let row = std::iter::once(study.change_text(*by)).chain(cells);
        out.row("", row.collect());
    }
    let r_squared = table.r_squared.iter();
    let r_squared = r_squared.map(|it| it.map_or(String::new(), |it| format!("{it:.3}")));
    let row = std::iter::once("R² on Δ".to_owned()).chain(r_squared);
    out.row("first", row.collect());
    let text = format!(
        "Displacement by {} [mm]: mean and standard deviation over points and legs.",
        table.counting.name()
    );
    paragraph(&text) + &out.html()
}
