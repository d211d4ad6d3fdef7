//! Summary and page of a study of coupling.

#[cfg(test)]
mod tests;

use twinrig_report::html::plot::{Curve, EndedRun, Look, Mark, Plot, Point, Setting};
use twinrig_report::number::{fixed, grouped, grouped_factor, si};
use twinrig_report::page::{Block, Card, Figure, Page, Swatch, Term};
use twinrig_report::summary::Summary;
use twinrig_report::table::{Cell, Column, Table, Tone};

use super::factory::CouplingMethod;
use super::results::CouplingStudy;
use super::row::{CouplingKind, CouplingRow};
use crate::machine::Machine;
use crate::plants::row::Status;
use crate::plants::view::{LEAST_M, references, rows};
use crate::reproduction::{Budgeted, timed_reproduction};

impl CouplingStudy {
    /// Returns the summary.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new(&self.scenario, "study of coupling", self.headline());
        for plant in self.plants() {
            summary.table(plant, &steps(self, plant));
        }
        for order in self.orders() {
            let (plant, method) = (&order.plant, order.method.word());
            let (points, order) = (order.points, order.order);
            let text = format!("{plant} {method}: {order:.1}, coupling alone, of {points} steps");
            summary.fact("order", text);
        }
        for note in &self.references {
            let why = note.why.clone().unwrap_or_default();
            let apart = note.check.as_ref().map_or_else(String::new, |check| {
                format!("{} from its check; ", si(check.disagreement_rms_m, "m"))
            });
            let step = note.step_s;
            let step = step.map_or_else(String::new, |it| format!("exact at {}, ", si(it, "s")));
            summary.fact("reference", format!("{}: {step}{apart}{why}", note.plant));
        }
        let cut = self.cut().count();
        if cut > 0 {
            let budget_s = self.budget_s;
            let text = format!("{cut} runs were too slow for a budget of {budget_s} s");
            summary.fact("truncated", text);
        }
        for row in self.rows.iter().filter(|row| row.contradicts) {
            summary.fact("doubtful", doubtful(row));
        }
        self.starts.note(&mut summary);
        summary.left_out(&self.left_out);
        summary
    }

    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn page(&self, machine: &Machine, command: &str) -> Page {
        let mut blocks = vec![
            Block::Text(introduction(self)),
            Block::Cards(cards(self)),
            Block::heading("Error against run time"),
            Block::text(
                "The step of the plant is that of the grid; with exact coupling, a step ends at \
                 every instant at which a board accesses the plant.",
            ),
        ];
        blocks.extend(self.plants().into_iter().map(|plant| cost(self, plant)));
        blocks.push(Block::heading("The coupling alone"));
        blocks.push(Block::text(
            "The plant has the step of the reference, whatever the grid: the remaining error is \
             that of the coupling. Held commands act half a step late on average, an error of \
             first order; mean commands preserve the impulse, and their error is of second order.",
        ));
        blocks.extend(
            self.plants()
                .into_iter()
                .map(|plant| coupling_only(self, plant)),
        );
        blocks.extend([
            Block::heading("References"),
            Block::Table(references(&self.references)),
            Block::heading("All runs"),
            Block::Table(all(self)),
            Block::text(
                "Speed: simulated time over run time of the complete rig, the median of several \
                 runs without sampling. Fallbacks: steps for which another method or a shorter \
                 step was substituted.",
            ),
        ]);
        Page {
            kind: "Study of coupling".to_owned(),
            title: format!("Exact and grid coupling: {}", self.scenario),
            headline: self.headline(),
            blocks,
            terms: self.terms(machine, command),
        }
    }

    fn terms(&self, machine: &Machine, command: &str) -> Vec<Term> {
        let errors = "distance of the feet from their positions with exact coupling and a fine \
                      step of the plant, in the same closed loop";
        let mut definitions = vec![Term::text("error", errors)];
        definitions.extend(self.panics.iter().map(|panic| Term::text("panic", panic)));
        let budget = Budgeted {
            cut: self.cut().map(name).collect(),
            budget_s: self.budget_s,
        };
        timed_reproduction(
            machine,
            command,
            &self.file,
            definitions,
            &self.left_out,
            (&self.starts, &budget),
        )
    }
}

fn name(row: &CouplingRow) -> String {
    format!(
        "{} {} {}",
        row.plant,
        row.method.word(),
        si(row.step_s, "s")
    )
}

/// Returns a row that contradicts its neighbours.
fn doubtful(row: &CouplingRow) -> String {
    let (method, step) = (row.method.word(), si(row.step_s, "s"));
    let error = row.error_rms_m;
    let error = error.map_or(String::new(), |error| format!(": {}", si(error, "m")));
    let why = row.why.as_deref().unwrap_or_default();
    format!("{} {method} {step}{error}, {why}", row.plant)
}

fn introduction(study: &CouplingStudy) -> String {
    let boards = if study.buses.is_empty() {
        format!(
            "The scenario has no bus: only the controller's transfers access the plant, every \
             {}. A grid that divides this period is exact, and the remaining errors are due to \
             the step of the plant.",
            si(study.period_s, "s")
        )
    } else {
        format!(
            "Its boards sample and actuate at instants independent of the plant's steps: {}.",
            study.buses.join(", ")
        )
    };
    format!(
        "The complete rig, with controller, drivers and boards, is simulated for {} of the \
         scenario's {}; the positions of its feet are compared every {}. {boards}",
        si(study.simulated_s, "s"),
        si(study.scene_s, "s"),
        si(study.grid_s, "s"),
    )
}

fn cards(study: &CouplingStudy) -> Vec<Card> {
    let orders = study.orders().into_iter().map(|order| {
        Card::new(
            format!("order of {} with {}", order.method.word(), order.plant),
            format!("{:.1}", order.order),
            format!("from {} steps, coupling alone", order.points),
        )
    });
    let completed = || study.rows.iter().filter(|row| row.status == Status::Ok);
    let counters = |row: &&CouplingRow| row.counters_changed.iter().flatten().count();
    let changed = completed().filter(|row| counters(row) > 0).count();
    let (count, cut) = (study.rows.len(), study.cut().count());
    let completed = completed().count();
    let runs = [
        Card::new(
            "timing",
            changed.to_string(),
            "runs in which a counter of a driver or a board ended at another value than in \
                   the reference"
                .to_owned(),
        ),
        Card::new(
            "runs",
            count.to_string(),
            rows::outcome(completed, count - completed - cut, cut),
        ),
    ];
    orders.chain(runs).collect()
}

/// Returns the errors of exact coupling and of grids over the step, on a plant.
fn steps(study: &CouplingStudy, plant: &str) -> Table {
    let columns = CouplingMethod::ALL.into_iter().flat_map(|method| {
        [
            Column::number(format!("{}: RMS", method.word())),
            Column::number("steps/s"),
            Column::number("× real time"),
        ]
    });
    let step = std::iter::once(Column::number("step"));
    let columns = step.chain(columns).chain([Column::text("")]);
    let mut table = Table::new(columns);
    let of = |method| study.series(CouplingKind::Together, plant, method);
    for first in of(CouplingMethod::Exact) {
        let mut cells = vec![si(first.step_s, "s").into()];
        let mut changed = 0;
        for method in CouplingMethod::ALL {
            let row = of(method).find(|row| row.step_s == first.step_s);
            changed += row.map_or(0, |row| row.counters_changed.iter().flatten().count());
            cells.extend(row.map_or_else(|| [(); 3].map(|()| Cell::empty()), measured));
        }
        let note = (changed > 0).then(|| format!("{changed} counters differ"));
        cells.push(Cell::from(note).with_tone(Tone::Doubtful));
        table.row(cells);
    }
    table
}

/// Returns error, steps per second and speed of a run.
fn measured(row: &CouplingRow) -> [Cell; 3] {
    let error = match row.status {
        Status::Ok => row.error_rms_m.map(|error| si(error, "m")).into(),
        _ => Cell::from(row.word()).with_tone(rows::tone(row.status, row.cut)),
    };
    let steps = row.steps_per_simulated_s.map(|steps| fixed(steps, 0));
    let speed = row.real_time_factor.map(|factor| fixed(factor, 1));
    [error, steps.into(), speed.into()]
}

fn curve(
    study: &CouplingStudy,
    kind: CouplingKind,
    plant: &str,
    number: usize,
    x: impl Fn(&CouplingRow) -> Option<f64>,
) -> Curve {
    let method = CouplingMethod::ALL[number];
    let point = |row: &CouplingRow| {
        let error = row.error_rms_m.filter(|_| row.status == Status::Ok)?;
        Some(Point {
            x: x(row)?,
            y: error.max(LEAST_M),
            title: title(row),
            look: match (row.contradicts, row.at_floor) {
                (true, _) => Look::Doubtful,
                (false, true) => Look::Hollow,
                (false, false) => Look::Plain,
            },
        })
    };
    let ended = |row: &CouplingRow| {
        Some(EndedRun {
            x: x(row).filter(|_| row.status != Status::Ok)?,
            title: format!("{}: {}", row.word(), title(row)),
            cut: row.cut,
        })
    };
    let rows = study.series(kind, plant, method);
    let settings = rows.map(|row| Setting::of(point(row), || ended(row)));
    Curve::through(number, method == CouplingMethod::GridHeld, settings)
}

fn plot(
    study: &CouplingStudy,
    kind: CouplingKind,
    plant: &str,
    x_label: &str,
    x: &dyn Fn(&CouplingRow) -> Option<f64>,
) -> Plot {
    let curves = (0..CouplingMethod::ALL.len()).map(|number| curve(study, kind, plant, number, x));
    let floor = study.floor_of(plant);
    Plot {
        title: format!("error of the feet of {plant}"),
        width: 1080.0,
        height: 460.0,
        x_label: x_label.to_owned(),
        y_label: "distance of the feet, RMS  [m]".to_owned(),
        curves: curves.filter(|curve| !curve.is_empty()).collect(),
        marks: vec![Mark::Below(
            floor,
            format!(
                "disagreement of the reference and its check: {}",
                si(floor, "m")
            ),
        )],
        shared_y: Vec::new(),
        strip: "failed".to_owned(),
    }
}

fn figure(heading: &str, methods: &[usize], plot: &Plot, caption: String) -> Block {
    let entry = |&number: &usize| {
        let method = CouplingMethod::ALL[number];
        let swatch = match method {
            CouplingMethod::GridHeld => Swatch::Dashed(number),
            _ => Swatch::Curve(number),
        };
        (swatch, format!("{}: {}", method.word(), method.about()))
    };
    let legend = methods.iter().map(entry).collect();
    Block::Figure(
        Figure {
            heading: heading.to_owned(),
            legend,
            drawing: plot.drawing(),
            caption,
        }
        .with_marks(plot),
    )
}

fn cost(study: &CouplingStudy, plant: &str) -> Block {
    let x = |row: &CouplingRow| row.run_s_per_simulated_s.filter(|&cost| cost > 0.0);
    let plot = plot(
        study,
        CouplingKind::Together,
        plant,
        "run time of the whole rig per simulated second  [s/s]",
        &x,
    );
    let caption = "Lower left is better. A point is one step size, and a line connects the \
                   points from the longest step to the shortest. A longer step need not take \
                   less run time: steps too long for the contacts are replaced by shorter ones \
                   (see the table). Hover over a point for details.";
    figure(plant, &[0, 1, 2], &plot, caption.to_owned())
}

fn coupling_only(study: &CouplingStudy, plant: &str) -> Block {
    let plot = plot(
        study,
        CouplingKind::Alone,
        plant,
        "step of the grid  [s]",
        &|row| Some(row.step_s),
    );
    let order = |method| study.order_in_words(plant, method);
    let caption = format!(
        "The slope of a curve is its order: mean commands {}, held commands {}.",
        order(CouplingMethod::Grid),
        order(CouplingMethod::GridHeld)
    );
    figure(plant, &[1, 2], &plot, caption)
}

fn title(row: &CouplingRow) -> String {
    let mut parts = vec![name(row)];
    parts.extend(
        row.error_rms_m
            .map(|error| format!("foot {} RMS", si(error, "m"))),
    );
    parts.extend(
        row.real_time_factor
            .map(|factor| format!("{} real time", grouped_factor(factor))),
    );
    parts.extend(row.why.clone());
    parts.join("; ")
}

/// Returns the table of all runs.
fn all(study: &CouplingStudy) -> Table {
    let mut table = Table::new([
        Column::label("plant"),
        Column::text("coupling"),
        Column::number("step").in_unit("s"),
        Column::number("plant step").in_unit("s"),
        Column::status(""),
        Column::number("feet, RMS").in_unit("m"),
        Column::number("greatest").in_unit("m"),
        Column::number("trunk, RMS").in_unit("m"),
        Column::number("greatest").in_unit("m"),
        Column::number("steps per second"),
        Column::number("evaluations"),
        Column::number("fallbacks"),
        Column::number("time per step").in_unit("s"),
        Column::number("speed"),
        Column::text("counters that differ"),
        Column::reason(),
    ]);
    let series = |row: &CouplingRow| (row.plant.clone(), row.kind, row.method);
    let mut before = study.rows.first().map(series);
    for row in &study.rows {
        let changed = row.counters_changed.iter().flatten();
        let changed: Vec<String> = changed
            .map(|(name, there, here)| format!("{name}: {there} → {here}"))
            .collect();
        let per_second = row.steps_per_simulated_s;
        let per_second = per_second.map(|steps| grouped(&format!("{steps:.0}")));
        let tone = rows::tone(row.status, row.cut);
        table.row([
            row.plant.as_str().into(),
            row.method.word().into(),
            row.step_s.into(),
            row.plant_step_s.into(),
            Cell::from(row.word()).with_tone(tone),
            row.error_rms_m.into(),
            row.error_max_m.into(),
            row.trunk_error_rms_m.into(),
            row.trunk_error_max_m.into(),
            per_second.into(),
            rows::count(row.evaluations).into(),
            rows::count(row.fallbacks).into(),
            row.cost_per_step_s.into(),
            rows::factor(row.real_time_factor).into(),
            changed.join(", ").into(),
            row.why.clone().into(),
        ]);
        let now = Some(series(row));
        rows::mark(&mut table, before != now, row.status, row.cut);
        before = now;
    }
    table
}
