//! Page of a study of coupling.

use crate::coupling::{CouplingKind, CouplingMethod, CouplingRow, CouplingStudy};
use crate::machine::Machine;
use crate::row::Status;
use twinrig_report::number::{grouped, grouped_factor, method_setting, si};

use super::error_axis::LEAST_M;
use super::rows;
use super::{Page, card, figure, introduction, panicked, references};
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::marker::swatch;
use twinrig_report::html::plot::{Curve, Ended, Look, Mark, Plot, Point, Setting};
use twinrig_report::html::table::HtmlTable;

impl CouplingStudy {
    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn html(&self, machine: &Machine, command: &str) -> String {
        let errors = "distance of the feet from their positions with exact coupling and a fine \
                      step of the plant, in the same closed loop";
        let left_out = self.left_out.iter();
        let left_out = left_out.map(|left| ("left out".to_owned(), left.clone()));
        let mut terms = vec![("error".to_owned(), errors.to_owned())];
        terms.extend(left_out);
        terms.extend(panicked(&self.panics));
        Page {
            kind: "coupling",
            title: "Exact and grid coupling",
            scenario: &self.scenario,
            file: &self.file,
            headline: self.headline(),
            body: body(self),
            terms,
            cut: self.cut().map(name).collect(),
            budget_s: self.budget_s,
        }
        .html(machine, command)
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

fn body(study: &CouplingStudy) -> String {
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
    let mut out = introduction(&format!(
        "The complete rig, with controller, drivers and boards, is simulated for {} of the \
         scenario's {}; the positions of its feet are compared every {}. {boards}",
        si(study.simulated_s, "s"),
        si(study.scene_s, "s"),
        si(study.grid_s, "s"),
    ));
    out += &cards(study);
    out += "<h2>Error against run time</h2>\n";
    out += &paragraph(
        "The step of the plant is that of the grid; with exact coupling, a step ends at every \
         instant at which a board accesses the plant.",
    );
    for plant in study.plants() {
        out += &cost(study, plant);
    }
    out += "<h2>The coupling alone</h2>\n";
    out += &paragraph(
        "The plant has the step of the reference, whatever the grid: the remaining error is that \
         of the coupling. Held commands act half a step late on average, an error of first \
         order; mean commands preserve the impulse, and their error is of second order.",
    );
    for plant in study.plants() {
        out += &coupling_only(study, plant);
    }
    out += "<h2>References</h2>\n";
    out += &references(&study.references);
    out += "<h2>All runs</h2>\n";
    out += &all(study);
    out
}

fn cards(study: &CouplingStudy) -> String {
    let mut out = String::new();
    for order in study.orders() {
        let what = format!("order of {} with {}", order.method.word(), order.plant);
        out += &card(
            &what,
            &format!("{:.1}", order.order),
            &format!("from {} steps, coupling alone", order.points),
        );
    }
    let rows = || study.rows.iter().filter(|row| row.status == Status::Ok);
    let changed = rows().filter(|row| {
        row.counters_changed
            .as_ref()
            .is_some_and(|changed| !changed.is_empty())
    });
    let more = "runs in which a counter of a driver or a board ended at another value than in the \
         reference";
    let cut = study.cut().count();
    out += &card("timing", &changed.count().to_string(), more);
    out += &card(
        "runs",
        &study.rows.len().to_string(),
        &rows::outcome(rows().count(), study.rows.len() - rows().count() - cut, cut),
    );
    element("div", "cards", &out)
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
        Some(Ended {
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

fn entries(methods: &[usize]) -> Vec<(String, String)> {
    let entry = |&number: &usize| {
        let method = CouplingMethod::ALL[number];
        let dashed = method == CouplingMethod::GridHeld;
        (
            swatch(number, dashed),
            format!("{}: {}", method.word(), method.about()),
        )
    };
    methods.iter().map(entry).collect()
}

fn cost(study: &CouplingStudy, plant: &str) -> String {
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
    figure(plant, &entries(&[0, 1, 2]), &plot, caption)
}

fn coupling_only(study: &CouplingStudy, plant: &str) -> String {
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
    figure(plant, &entries(&[1, 2]), &plot, &caption)
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
fn all(study: &CouplingStudy) -> String {
    let mut table = HtmlTable::new(
        "plant | coupling | step | plant step | | feet, RMS | greatest | trunk, RMS | greatest \
         | steps per second | evaluations | fallbacks | time per step | speed \
         | counters that differ | why",
        5,
    );
    let mut before: Option<&CouplingRow> = None;
    for row in &study.rows {
        let series = |row: &CouplingRow| (row.plant.clone(), row.kind, row.method);
        let first = before.is_some_and(|before| series(before) != series(row));
        let changed = row.counters_changed.iter().flatten();
        let changed: Vec<String> = changed
            .map(|(name, there, here)| format!("{name}: {there} → {here}"))
            .collect();
        let per_second = row
            .steps_per_simulated_s
            .map(|steps| grouped(&format!("{steps:.0}")));
        table.row(
            rows::row_class(first, row.status, row.cut),
            vec![
                escaped(&row.plant),
                escaped(row.method.word()),
                method_setting(Some(row.step_s), None),
                method_setting(Some(row.plant_step_s), None),
                rows::tag(row.status, row.cut, row.word()),
                rows::length(row.error_rms_m),
                rows::length(row.error_max_m),
                rows::length(row.trunk_error_rms_m),
                rows::length(row.trunk_error_max_m),
                per_second.unwrap_or_default(),
                rows::count(row.evaluations),
                rows::count(row.fallbacks),
                rows::time(row.cost_per_step_s),
                rows::factor(row.real_time_factor),
                escaped(&changed.join(", ")),
                row.why
                    .as_ref()
                    .map_or(String::new(), |why| element("span", "why", &escaped(why))),
            ],
        );
        before = Some(row);
    }
    table.html()
        + &paragraph(
            "Speed: simulated time over run time of the complete rig, the median of several runs \
             without sampling. Fallbacks: steps for which another method or a shorter step was \
             substituted.",
        )
}
