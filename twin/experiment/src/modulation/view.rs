//! Summary and page of a study of footstep modulation.

#[cfg(test)]
mod tests;

use twinrig_kernel::Unit;
use twinrig_report::html::line_plot::{AxisLabel, LinePlot, Series, Shape};
use twinrig_report::html::marker::COLOURS;
use twinrig_report::html::surface::Surface;
use twinrig_report::number::{fixed, plain};
use twinrig_report::page::{Block, Card, Figure, Page, Swatch, Term};
use twinrig_report::summary::Summary;
use twinrig_report::table::{Cell, Column, Table, Tone};

use super::fit::{LinearModel, ModelForm};
use super::results::{CaseResult, ModulationStudy};
use super::table::{Counting, DisplacementCell, DisplacementTable};
use crate::machine::Machine;
use crate::reproduction::reproduction;

impl ModulationStudy {
    /// Returns the summary.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new(
            &self.input.name,
            "study of footstep modulation",
            self.headline(),
        );
        if let [case] = &*self.cases {
            for table in &case.tables {
                let name = table.counting.name();
                let heading = format!("mean displacement by {name} [mm]");
                summary.table(&heading, &means(self, table, false));
            }
        }
        summary.table("models of the displacement d of step n", &models(self));
        for case in &self.cases {
            if let Some(why) = &case.why {
                summary.fact("no result", format!("{}: {why}", case.label()));
            }
            if let Some(first) = case.failed.first() {
                let failed = format!("{} of {}: {first}", case.failed.len(), case.label());
                summary.fact("failed", failed);
            }
        }
        summary.left_out(&self.input.left_out);
        summary
    }

    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn page(&self, machine: &Machine, command: &str) -> Page {
        let input = &self.input;
        let mut blocks = vec![Block::Text(format!(
            "{} changes by each of {} amounts at each of {} points of the gait cycle; {} footsteps \
             of each leg are compared with the run without the change (thesis, section 3.2.5, \
             figures 3.5 and 3.8).",
            input.variable,
            self.plan.changes.len(),
            self.plan.points,
            self.plan.steps
        ))];
        let results: Vec<&CaseResult> = self.cases.iter().filter(|it| it.why.is_none()).collect();
        if let [case] = results[..] {
            blocks.push(Block::Cards(cards(case)));
        }
        blocks.push(Block::heading("Models of the displacement"));
        blocks.push(Block::Table(models(self)));
        for case in results {
            blocks.push(Block::Heading(case.label()));
            let surfaces = case.tables.iter().map(|it| surface(self, it));
            blocks.push(Block::Figures(surfaces.collect()));
            let plots = case.tables.iter().map(|it| lines(self, it));
            blocks.push(Block::Figures(plots.collect()));
            for table in &case.tables {
                blocks.push(Block::Text(format!(
                    "Displacement by {} [mm]: mean and standard deviation over points and legs.",
                    table.counting.name()
                )));
                blocks.push(Block::Table(means(self, table, true)));
            }
        }
        let title = format!("Footsteps after a change of {}", input.variable);
        Page {
            kind: "Study of footstep modulation".to_owned(),
            title: format!("{title}: {}", input.name),
            headline: self.headline(),
            blocks,
            terms: reproduction(
                machine,
                command,
                &input.files,
                self.terms(),
                &input.left_out,
            ),
        }
    }

    fn terms(&self) -> Vec<Term> {
        let definitions = [
            (
                "displacement",
                "position of a footstep along the heading of its leg in the reference run, minus \
                 that of the same footstep there",
            ),
            (
                "by cycle",
                "one footstep for each leg and cycle: the contact with the largest impulse; the \
                 cycle follows from the period of the leg",
            ),
            ("by touch-down", "every contact counts, bounces included"),
            (
                "by geometry",
                "k = 1/d and k₀ = ½ − 1/(2 d) for feet that stand still while they move by the \
                 step length relative to the trunk, in the share d of the cycle that is commanded, or \
                 measured where none is commanded",
            ),
        ];
        let definitions = definitions.map(|(name, text)| Term::text(name, text));
        let why = self.cases.iter().filter_map(|case| {
            let why = case.why.as_ref()?;
            Some(Term::text("no result", format!("{}: {why}", case.label())))
        });
        definitions.into_iter().chain(why).collect()
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

fn cards(case: &CaseResult) -> Vec<Card> {
    let of_table = |table: &DisplacementTable| {
        let model = table.model(ModelForm::BilinearWithFirstStep)?;
        let name = table.counting.name();
        Some([
            Card::new(
                format!("by {name}: displacement per step"),
                format!("{:.2} Δ", model.slope),
                format!("R² {:.3}", model.r_squared),
            ),
            Card::new(
                format!("by {name}: first step with Δ"),
                table.first_step.map_or(String::new(), percent),
                format!("greatest mean against Δ {:.1} mm", 1e3 * table.opposite_m()),
            ),
        ])
    };
    case.tables.iter().filter_map(of_table).flatten().collect()
}

/// Returns a share as a whole number of percent, rounded down.
fn percent(share: f64) -> String {
    format!("{:.0} %", (100.0 * share).floor())
}

/// Returns the models of the displacement d of step n.
fn models(study: &ModulationStudy) -> Table {
    let mut table = Table::new([
        Column::label("gait"),
        Column::text("plant"),
        Column::text("factor"),
        Column::text("counted by"),
        Column::number("k, (k n + k₀) Δ").with_places(3),
        Column::number("95 %"),
        Column::number("k₀").with_places(2),
        Column::number("k by geometry").with_places(2),
        Column::number("k₀ by geometry")
            .with_places(2)
            .only_on_pages(),
        Column::number("stride over step")
            .with_places(2)
            .only_on_pages(),
        Column::number("R²").with_places(3),
        Column::number("R², k n Δ").with_places(3),
        Column::number("R², k n Δ + c")
            .with_places(3)
            .only_on_pages(),
        Column::number("first step with Δ"),
        Column::number("greatest mean against Δ"),
        Column::number("missing"),
        Column::number("fell"),
        Column::number("of").only_on_pages(),
    ]);
    let mut before = String::new();
    for case in &study.cases {
        for of in &case.tables {
            table.row(model_cells(study, case, of));
            let label = case.label();
            if label != before {
                table.begin_group();
            }
            before = label;
        }
    }
    table
}

fn model_cells(
    study: &ModulationStudy,
    case: &CaseResult,
    table: &DisplacementTable,
) -> [Cell; 18] {
    let model = table.model(ModelForm::BilinearWithFirstStep);
    let interval = |model: &LinearModel| {
        let [low, high] = model.interval?;
        Some(format!("{} … {}", fixed(low, 2), fixed(high, 2)))
    };
    let r_squared = |form: ModelForm| Cell::from(table.model(form).map(|it| it.r_squared));
    let opposite = table.opposite.map_or("0".to_owned(), |cell| {
        let change = study.change_text(cell.by);
        format!(
            "{:.1} mm at step {}, {change}",
            1e3 * table.opposite_m(),
            cell.step
        )
    });
    let tone = if ModulationStudy::is_erratic(table) {
        Tone::Doubtful
    } else {
        Tone::Good
    };
    [
        case.case.gait.clone().into(),
        case.case.plant.clone().into(),
        case.case.factor.clone().into(),
        table.counting.name().into(),
        model.map(|it| it.slope).into(),
        model.and_then(interval).into(),
        model.map(|it| it.second).into(),
        case.ideal.map(|it| it.by_duty).into(),
        case.ideal.map(|it| it.first_step).into(),
        case.ideal.map(|it| it.by_stride).into(),
        r_squared(ModelForm::BilinearWithFirstStep),
        r_squared(ModelForm::Bilinear),
        r_squared(ModelForm::BilinearWithConstant),
        table.first_step.map(percent).into(),
        Cell::from(opposite).with_tone(tone),
        table.missing().into(),
        case.fell.into(),
        case.runs.into(),
    ]
}

fn surface(study: &ModulationStudy, table: &DisplacementTable) -> Figure {
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
    let caption = match table.counting {
        Counting::Cycle => "Blue: backwards; orange: forwards. Means over points and legs.",
        Counting::TouchDown => "The same, every touch-down counted.",
    };
    Figure {
        heading: format!("Mean displacement by {}", table.counting.name()),
        drawing: surface.drawing(),
        caption: caption.to_owned(),
        ..Figure::default()
    }
}

fn lines(study: &ModulationStudy, table: &DisplacementTable) -> Figure {
    let mut series = Vec::new();
    let mut legend = Vec::new();
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
        let swatch = if dashed {
            Swatch::Dashed(number)
        } else {
            Swatch::Curve(number)
        };
        legend.push((swatch, study.change_text(*by)));
    }
    let plot = LinePlot {
        title: format!("displacement by {}", table.counting.name()),
        width: 540.0,
        height: 340.0,
        x: AxisLabel::number("footstep after the change"),
        y: AxisLabel::in_unit("displacement", "mm"),
        series,
    };
    Figure {
        heading: format!("Mean and standard deviation by {}", table.counting.name()),
        legend,
        drawing: plot.drawing(),
        caption: String::new(),
    }
}

/// Returns changes by steps \[mm\]; means against the change are doubtful.
fn means(study: &ModulationStudy, table: &DisplacementTable, with_deviation: bool) -> Table {
    let steps = 1..=study.plan.steps;
    let heads = steps.clone().map(|step| Column::number(step.to_string()));
    let mut out = Table::new(std::iter::once(Column::label("Δ")).chain(heads));
    for by in &study.plan.changes {
        let cells = steps.clone().map(|step| {
            let cell = table.cell(*by, step).filter(|cell| cell.count > 0);
            cell.map_or_else(Cell::empty, |cell| {
                let [mean, deviation] =
                    [cell.mean_m, cell.deviation_m].map(|it| fixed(1e3 * it, 1));
                let text = if with_deviation {
                    format!("{mean} ± {deviation}")
                } else {
                    mean
                };
                let is_against = cell.mean_m * by < 0.0;
                let tone = if is_against {
                    Tone::Doubtful
                } else {
                    Tone::Plain
                };
                Cell::from(text).with_tone(tone)
            })
        });
        out.row(std::iter::once(study.change_text(*by).into()).chain(cells));
    }
    let r_squared = table.r_squared.iter();
    let r_squared = r_squared.map(|it| Cell::from(it.map(|it| fixed(it, 3))));
    out.row(std::iter::once("R² on Δ".into()).chain(r_squared));
    out.begin_group();
    out
}
