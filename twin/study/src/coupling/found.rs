//! What a study of coupling found.

use serde::Serialize;
use serde_json::{Value, json};
use twinrig_kernel::SimDuration;

use super::CouplingPlan;
use super::factory::{CouplingMethod, RigScene};
use super::row::{CouplingKind, CouplingRow};
use crate::fit;
use crate::machine::Machine;
use crate::number::{grouped, grouped_factor, si};
use crate::panics;
use crate::reference::ReferenceNote;
use crate::row::Status;

/// What a study of coupling found, apart from the machine it ran on.
#[derive(Clone, Debug, PartialEq)]
pub struct CouplingStudy {
    /// What the scenario calls itself.
    pub scenario: String,
    /// Its file.
    pub file: String,
    /// How long the scene lasts \[s\].
    pub scene_s: f64,
    /// How much of it was simulated \[s\].
    pub simulated_s: f64,
    /// How often runs were compared \[s\].
    pub grid_s: f64,
    /// The control period \[s\].
    pub period_s: f64,
    /// Its buses.
    pub buses: Vec<String>,
    /// What it was allowed to take \[s\].
    pub budget_s: f64,
    /// What each plant is measured against.
    pub references: Vec<ReferenceNote>,
    /// What it found.
    pub rows: Vec<CouplingRow>,
    /// What was left out of it, and why.
    pub left_out: Vec<String>,
    /// What panicked: a bug in a part, or in this study. The rows that it befell have failed, and say so.
    pub panics: Vec<String>,
}

/// How fast the error of a coupling falls with the step of its grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CouplingOrder {
    /// The plant.
    pub plant: String,
    /// How it is coupled.
    pub method: CouplingMethod,
    /// The exponent, by least squares over the steps whose error is above the floor and below saturation.
    pub order: f64,
    /// So many steps.
    pub points: usize,
}

/// Errors so far above the floor of the reference show an order.
const ABOVE_FLOOR: f64 = 3.0;
/// A run that is as far from the truth as the reference may be, and not to the same side, is so many floors away from it.
const ON_FLOOR: f64 = std::f64::consts::SQRT_2;
/// Errors above this have nothing to do with an order any more \[m\].
const SATURATED_M: f64 = 1e-2;
/// What a headline is about: half of how far a reference and its check may be apart \[m\].
const AIM_M: f64 = 0.5 * super::NEAR_M;

impl CouplingStudy {
    pub(crate) fn new(
        scene: &RigScene,
        plan: &CouplingPlan,
        duration: SimDuration,
        observe: SimDuration,
    ) -> Self {
        let mut left_out = Vec::new();
        if scene.buses.is_empty() {
            left_out.push(format!(
                "boards: the scenario has no bus, so nobody meets the plant but the controller's transfers, every {}. A grid that \
                 divides that is exact; what is left of the errors is the plant's own step",
                si(scene.period.as_secs_f64(), "s")
            ));
        }
        Self {
            scenario: scene.name.clone(),
            file: scene.file.clone(),
            scene_s: scene.duration.as_secs_f64(),
            simulated_s: duration.as_secs_f64(),
            grid_s: observe.as_secs_f64(),
            period_s: scene.period.as_secs_f64(),
            buses: scene.buses.clone(),
            budget_s: plan.budget_s,
            references: Vec::new(),
            rows: Vec::new(),
            left_out,
            panics: Vec::new(),
        }
    }

    /// That something panicked, if so: the study is not what it should be.
    pub fn error(&self) -> Option<String> {
        panics::error(&self.panics)
    }

    /// The plants, in order.
    pub fn plants(&self) -> Vec<&str> {
        self.references
            .iter()
            .map(|note| note.plant.as_str())
            .collect()
    }

    /// The rows of a line, in order.
    pub fn line<'a>(
        &'a self,
        kind: CouplingKind,
        plant: &'a str,
        method: CouplingMethod,
    ) -> impl Iterator<Item = &'a CouplingRow> + 'a {
        self.rows
            .iter()
            .filter(move |row| (row.kind, row.plant.as_str(), row.method) == (kind, plant, method))
    }

    /// How far the reference of a plant and its check are apart \[m\].
    pub fn floor_of(&self, plant: &str) -> f64 {
        let mut notes = self.references.iter();
        let note = notes.find(|note| note.plant == plant);
        let check = note.and_then(|note| note.check.as_ref());
        check.map_or(0.0, |check| check.disagreement_rms_m)
    }

    /// What was cut because it would have taken too long.
    pub fn cut(&self) -> impl Iterator<Item = &CouplingRow> {
        self.rows.iter().filter(|row| row.cut)
    }

    /// The orders of coupling alone, where errors show one.
    pub fn orders(&self) -> Vec<CouplingOrder> {
        let mut orders = Vec::new();
        for plant in self.plants() {
            for method in [CouplingMethod::Grid, CouplingMethod::GridHeld] {
                let points = self.logarithms(plant, method);
                let order = fit::order(&points).ok();
                orders.extend(order.map(|order| CouplingOrder {
                    plant: plant.to_owned(),
                    method,
                    order,
                    points: points.len(),
                }));
            }
        }
        orders
    }

    /// Step and error of a coupling alone where they can show an order.
    fn logarithms(&self, plant: &str, method: CouplingMethod) -> Vec<(f64, f64)> {
        let floor = (ABOVE_FLOOR * self.floor_of(plant)).max(1e-15);
        self.line(CouplingKind::Alone, plant, method)
            .filter(|row| row.status == Status::Ok)
            .filter_map(|row| Some((row.step_s, row.error_rms_m?)))
            .filter(|&(_, error)| error > floor && error < SATURATED_M)
            .map(|(step, error)| (libm::log(step), libm::log(error)))
            .collect()
    }

    /// The order of a coupling, where its errors show one.
    pub fn order(&self, plant: &str, method: CouplingMethod) -> Option<f64> {
        fit::order(&self.logarithms(plant, method)).ok()
    }

    /// The same for a caption, or why they show none.
    pub(crate) fn order_in_words(&self, plant: &str, method: CouplingMethod) -> String {
        match fit::order(&self.logarithms(plant, method)) {
            Ok(order) => format!("order {order:.1}"),
            Err(why) => format!("no slope ({})", why.about()),
        }
    }

    /// What it found, in a sentence or two: the fewest steps on a grid that stay near enough, and with exact coupling.
    pub fn headline(&self) -> String {
        let Some(plant) = self.plants().into_iter().next() else {
            return "There is no plant.".to_owned();
        };
        let aim = si(AIM_M, "m");
        let near = |method: CouplingMethod| {
            let rows = self.line(CouplingKind::Together, plant, method);
            rows.filter(|row| {
                row.status == Status::Ok && row.error_rms_m.is_some_and(|error| error <= AIM_M)
            })
        };
        let steps = |row: &&CouplingRow| row.steps.unwrap_or(u64::MAX);
        let grids = near(CouplingMethod::Grid).chain(near(CouplingMethod::GridHeld));
        let grid = grids.min_by_key(steps);
        // Where boards meet the plant more often than its step has it, several steps come to the same: of those, the grid's.
        let other_step = |row: &&CouplingRow| grid.is_some_and(|grid| grid.step_s != row.step_s);
        let exact = near(CouplingMethod::Exact).min_by_key(|row| (steps(row), other_step(row)));
        match (exact, grid) {
            (Some(exact), Some(grid)) => format!(
                "On a grid of {} ({}) {plant} {}; with exact coupling, at steps of {} at most, it {}.",
                si(grid.step_s, "s"),
                grid.method.word(),
                self.does(grid),
                si(exact.step_s, "s"),
                self.does(exact),
            ),
            (Some(_), None) => {
                format!("No grid keeps the feet of {plant} within {aim} RMS; exact coupling does.")
            }
            _ => format!("Nothing keeps the feet of {plant} within {aim} RMS of a reference."),
        }
    }

    /// What a run takes and how near it is, in the figures of the table.
    fn does(&self, row: &CouplingRow) -> String {
        let speed = row.real_time_factor.map_or(String::new(), |factor| {
            format!(" at {} real time", grouped_factor(factor))
        });
        let floor = self.floor_of(&row.plant);
        let error = row.error_rms_m.unwrap_or_default();
        let sure = if floor > 0.0 && error <= ON_FLOOR * floor {
            format!(", about what the reference is sure of ({})", si(floor, "m"))
        } else {
            String::new()
        };
        format!(
            "takes {} steps a second{speed} and its feet are {} RMS from where they should be{sure}",
            steps(row),
            si(error, "m"),
        )
    }

    /// The study as JSON, with the machine it ran on and the command that repeats it.
    pub fn json(&self, machine: &Machine, command: &str) -> Value {
        json!({
            "study": "coupling",
            "scenario": self.scenario,
            "machine": machine,
            "reference": self.references.first(),
            "rows": self.rows,
            "file": self.file,
            "command": command,
            "simulated_s": self.simulated_s,
            "compared_every_s": self.grid_s,
            "control_period_s": self.period_s,
            "buses": self.buses,
            "budget_s": self.budget_s,
            "references": self.references,
            "orders": self.orders(),
            "left_out": self.left_out,
            "error": self.error(),
        })
    }

    /// The rows as comma-separated values.
    pub fn csv(&self) -> String {
        crate::csv::table(&self.rows, &["step_s"])
    }
}

fn steps(row: &CouplingRow) -> String {
    let steps = row.steps_per_simulated_s.unwrap_or_default();
    grouped(&format!("{steps:.0}"))
}
