//! Results of a study of coupling.

use serde::Serialize;
use serde_json::{Value, json};
use twinrig_kernel::SimDuration;
use twinrig_report::number::{grouped, grouped_factor, si};

use super::factory::{CouplingInput, CouplingMethod};
use super::plan::CouplingPlan;
use super::row::{CouplingKind, CouplingRow};
use crate::fit;
use crate::incidents;
use crate::machine::Machine;
use crate::measured::Starts;
use crate::plants::reference_note::ReferenceNote;
use crate::plants::row::Status;

/// Results of a study of coupling, without the machine it ran on.
#[derive(Clone, Debug, PartialEq)]
pub struct CouplingStudy {
    /// Name of the scenario.
    pub scenario: String,
    /// Path of the scenario file.
    pub file: String,
    /// Duration of the scenario \[s\].
    pub scene_s: f64,
    /// Simulated duration \[s\].
    pub simulated_s: f64,
    /// Sampling period of the comparison \[s\].
    pub grid_s: f64,
    /// Control period \[s\].
    pub period_s: f64,
    /// Names of the buses.
    pub buses: Vec<String>,
    /// Time budget \[s\].
    pub budget_s: f64,
    /// Reference of each plant.
    pub references: Vec<ReferenceNote>,
    /// Rows, one for each run.
    pub rows: Vec<CouplingRow>,
    /// Omitted plants and parts, each with the reason.
    pub left_out: Vec<String>,
    /// Starts of the program whose measurements it has.
    pub starts: Starts,
    /// Panics, each a bug in a part or in this crate. The affected rows have status `failed` and
    /// the same reason.
    pub panics: Vec<String>,
}

/// Order of convergence of a coupling with the step of its grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CouplingOrder {
    /// Plant.
    pub plant: String,
    /// Coupling method.
    pub method: CouplingMethod,
    /// Slope of log error over log step, by least squares over the steps whose error lies between
    /// the floor of the reference and saturation.
    pub order: f64,
    /// Number of steps used.
    pub points: usize,
}

/// Least ratio of an error to the floor of the reference for the fit of an order.
const ABOVE_FLOOR: f64 = 3.0;
/// Distance, in floors, between two runs with independent errors of one floor each.
const ON_FLOOR: f64 = std::f64::consts::SQRT_2;
/// Saturation: larger errors are excluded from the fit of an order \[m\].
const SATURATED_M: f64 = 1e-2;
/// Greatest distance at which a reference and its check are trusted \[m\]: contacts and encoder
/// quantisation in the closed loop make any two runs diverge.
pub(super) const NEAR_M: f64 = 1e-3;
/// Greatest error of the headline: half of the trusted distance between a reference and its check
/// \[m\].
const AIM_M: f64 = 0.5 * NEAR_M;

impl CouplingStudy {
    pub(crate) fn new(
        input: &CouplingInput,
        plan: &CouplingPlan,
        duration: SimDuration,
        observe: SimDuration,
    ) -> Self {
        let mut left_out = Vec::new();
        if input.buses.is_empty() {
            left_out.push(format!(
                "boards: the scenario has no bus; only the controller's transfers access the plant, every {}. A \
                 grid that divides that period is exact; the remaining errors are those of the plant's step",
                si(input.period.as_secs_f64(), "s")
            ));
        }
        Self {
            scenario: input.name.clone(),
            file: input.file.clone(),
            scene_s: input.duration.as_secs_f64(),
            simulated_s: duration.as_secs_f64(),
            grid_s: observe.as_secs_f64(),
            period_s: input.period.as_secs_f64(),
            buses: input.buses.clone(),
            budget_s: plan.budget_s,
            references: Vec::new(),
            rows: Vec::new(),
            left_out,
            starts: Starts::default(),
            panics: Vec::new(),
        }
    }

    /// Returns a description of the panics of the study, if there was any.
    pub fn error(&self) -> Option<String> {
        incidents::error(&self.panics)
    }

    /// Returns the plants, in order.
    pub fn plants(&self) -> Vec<&str> {
        self.references
            .iter()
            .map(|note| &*note.plant.name)
            .collect()
    }

    /// Returns the rows of a series, in order.
    pub fn series<'a>(
        &'a self,
        kind: CouplingKind,
        plant: &'a str,
        method: CouplingMethod,
    ) -> impl Iterator<Item = &'a CouplingRow> + 'a {
        self.rows
            .iter()
            .filter(move |row| (row.kind, row.plant.as_str(), row.method) == (kind, plant, method))
    }

    /// Returns the RMS disagreement of a plant's reference and its check \[m\].
    pub fn floor_of(&self, plant: &str) -> f64 {
        let mut notes = self.references.iter();
        let note = notes.find(|note| note.plant == plant);
        let check = note.and_then(|note| note.check.as_ref());
        check.map_or(0.0, |check| check.disagreement_rms_m)
    }

    /// Returns the rows that were truncated by the budget.
    pub fn cut(&self) -> impl Iterator<Item = &CouplingRow> {
        self.rows.iter().filter(|row| row.cut)
    }

    /// Returns the orders of the coupling alone, where the errors show one.
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

    /// Returns the logarithms of step and error of the coupling alone, for the fit of an order.
    fn logarithms(&self, plant: &str, method: CouplingMethod) -> Vec<(f64, f64)> {
        let floor = (ABOVE_FLOOR * self.floor_of(plant)).max(1e-15);
        self.series(CouplingKind::Alone, plant, method)
            .filter(|row| row.status == Status::Ok)
            .filter_map(|row| Some((row.step_s, row.error_rms_m?)))
            .filter(|&(_, error)| error > floor && error < SATURATED_M)
            .map(|(step, error)| (libm::log(step), libm::log(error)))
            .collect()
    }

    /// Returns the order of a coupling, if its errors show one.
    pub fn order(&self, plant: &str, method: CouplingMethod) -> Option<f64> {
        fit::order(&self.logarithms(plant, method)).ok()
    }

    /// Returns the order for a caption, or the reason why there is none.
    pub(crate) fn order_in_words(&self, plant: &str, method: CouplingMethod) -> String {
        match fit::order(&self.logarithms(plant, method)) {
            Ok(order) => format!("order {order:.1}"),
            Err(why) => format!("no slope ({})", why.about()),
        }
    }

    /// Returns a summary: the fewest steps within the aim on a grid and with exact coupling.
    pub fn headline(&self) -> String {
        let Some(plant) = self.plants().into_iter().next() else {
            return "There is no plant.".to_owned();
        };
        let aim = si(AIM_M, "m");
        let near = |method: CouplingMethod| {
            let rows = self.series(CouplingKind::Together, plant, method);
            rows.filter(|row| {
                row.status == Status::Ok && row.error_rms_m.is_some_and(|error| error <= AIM_M)
            })
        };
        let steps = |row: &&CouplingRow| row.steps.unwrap_or(u64::MAX);
        let grids = near(CouplingMethod::Grid).chain(near(CouplingMethod::GridHeld));
        let grid = grids.min_by_key(steps);
        // Where the boards access the plant more often than its step, several steps take the same
        // number of plant steps; the step of the grid is preferred.
        let other_step = |row: &&CouplingRow| grid.is_some_and(|grid| grid.step_s != row.step_s);
        let exact = near(CouplingMethod::Exact).min_by_key(|row| (steps(row), other_step(row)));
        match (exact, grid) {
            (Some(exact), Some(grid)) => format!(
                "On a grid of {} ({}) {plant} {}; with exact coupling, at steps of {} at most, it {}.",
                si(grid.step_s, "s"),
                grid.method.word(),
                self.performance(grid),
                si(exact.step_s, "s"),
                self.performance(exact),
            ),
            (Some(_), None) => {
                format!("No grid keeps the feet of {plant} within {aim} RMS; exact coupling does.")
            }
            _ => format!("No coupling keeps the feet of {plant} within {aim} RMS of a reference."),
        }
    }

    /// Returns steps, speed and error of a run, with the figures of the table.
    fn performance(&self, row: &CouplingRow) -> String {
        let speed = row.real_time_factor.map_or(String::new(), |factor| {
            format!(" at {} real time", grouped_factor(factor))
        });
        let floor = self.floor_of(&row.plant);
        let error = row.error_rms_m.unwrap_or_default();
        let floor_note = if floor > 0.0 && error <= ON_FLOOR * floor {
            format!(
                ", about the uncertainty of the reference ({})",
                si(floor, "m")
            )
        } else {
            String::new()
        };
        format!(
            "takes {} steps per second{speed} with an RMS error of the feet of {}{floor_note}",
            steps(row),
            si(error, "m"),
        )
    }

    /// Returns the study as JSON, with the machine it ran on and the command that repeats it.
    pub fn json(&self, machine: &Machine, command: &str) -> Value {
        json!({
            "study": "coupling",
            "scenario": self.scenario,
            "machine": self.starts.machine(machine),
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
            "starts": self.starts,
            "error": self.error(),
        })
    }

    /// Returns the rows as comma-separated values.
    pub fn csv(&self) -> String {
        crate::csv::table(&self.rows, "method", &["step_s"])
    }
}

fn steps(row: &CouplingRow) -> String {
    let steps = row.steps_per_simulated_s.unwrap_or_default();
    grouped(&format!("{steps:.0}"))
}
