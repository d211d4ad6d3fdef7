//! What a study found.

use serde::Serialize;
use serde_json::{Map, Value, json};
use twinrig_kernel::{SimDuration, SimTime};

use crate::factory::{PlantFactory, SetBy};
use crate::fit;
use crate::footsteps::Footstep;
use crate::machine::Machine;
use crate::panics;
use crate::reference::ReferenceNote;
use crate::row::{Line, Row, RowKind, Status};
use crate::transport::Transport;

/// Which study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StudyKind {
    /// Error against run time.
    Precision,
    /// The largest stable step.
    Stability,
}

impl StudyKind {
    /// Its name, as the command line has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Precision => "precision",
            Self::Stability => "stability",
        }
    }
}

/// What a study found, apart from the machine it ran on.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// Which study it is.
    pub kind: StudyKind,
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
    /// Whether commands were played.
    pub commanded: bool,
    /// Whether there is ground.
    pub ground: bool,
    /// What it was allowed to take \[s\].
    pub budget_s: f64,
    /// The plants whose segments have mass.
    pub massive: Vec<String>,
    /// Which plants solve the model of which by other means.
    pub solves: Vec<(String, String)>,
    /// What the methods are: plant, name, what sets it, and a line on it.
    pub abouts: Vec<(String, String, SetBy, String)>,
    /// What each plant is measured against.
    pub references: Vec<ReferenceNote>,
    /// What it found.
    pub rows: Vec<Row>,
    /// Which footsteps differ between models.
    pub footsteps: Vec<Footstep>,
    /// What walking costs in each plant.
    pub transports: Vec<Transport>,
    /// What the criteria are, as pairs of a name and a text.
    pub criteria: Vec<(String, String)>,
    /// What was left out of it, and why.
    pub left_out: Vec<String>,
    /// What panicked: a bug in a plant, or in this study. The rows that it befell have failed, and say so.
    pub panics: Vec<String>,
}

/// How fast the error of a method falls with its step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Order {
    /// Its plant.
    pub plant: String,
    /// Its name.
    pub method: String,
    /// The exponent, by least squares over the settings whose error is above the floor and below saturation.
    pub order: f64,
    /// So many settings.
    pub points: usize,
}

/// Errors so far above the floor of the reference show the order of a method.
const ABOVE_FLOOR: f64 = 10.0;
/// Errors above this have nothing to do with an order any more \[m\].
const SATURATED_M: f64 = 1e-2;

impl Study {
    pub(crate) fn new(
        kind: StudyKind,
        factory: &dyn PlantFactory,
        end: SimTime,
        grid: SimDuration,
    ) -> Self {
        let scene = factory.scene();
        let plants = factory.plants().iter();
        let massive = plants.clone().filter(|plant| plant.segment_masses);
        let solves = plants.filter_map(|plant| Some((plant.name.clone(), plant.model_of.clone()?)));
        Self {
            kind,
            scenario: scene.name.clone(),
            file: scene.file.clone(),
            scene_s: scene.duration.as_nanos() as f64 / 1e9,
            simulated_s: end.as_nanos() as f64 / 1e9,
            grid_s: grid.as_nanos() as f64 / 1e9,
            commanded: scene.commands.change(),
            ground: scene.ground,
            budget_s: 0.0,
            massive: massive.map(|plant| plant.name.clone()).collect(),
            solves: solves.collect(),
            abouts: abouts(factory),
            references: Vec::new(),
            rows: Vec::new(),
            footsteps: Vec::new(),
            transports: Vec::new(),
            criteria: Vec::new(),
            left_out: factory.left_out().to_vec(),
            panics: Vec::new(),
        }
    }

    /// The lines: plants and methods in the order of their rows.
    pub fn lines(&self) -> Vec<Line<'_>> {
        let mut lines = Vec::new();
        for row in &self.rows {
            let ours = matches!(row.kind, RowKind::Integration | RowKind::Stability);
            if ours && !lines.contains(&row.line()) {
                lines.push(row.line());
            }
        }
        lines
    }

    /// The lines with a number each, which is the same for a method whatever it is set by.
    pub(crate) fn numbered_lines(&self) -> Vec<(usize, Line<'_>)> {
        let mut methods: Vec<(&str, &str)> = Vec::new();
        let lines = self.lines().into_iter();
        lines
            .map(|line| {
                let method = (line.plant, line.method);
                let known = methods.iter().position(|&known| known == method);
                let number = known.unwrap_or_else(|| {
                    methods.push(method);
                    methods.len() - 1
                });
                (number, line)
            })
            .collect()
    }

    /// A line on the method of a line.
    pub(crate) fn about(&self, line: Line<'_>) -> &str {
        let known = self.abouts.iter().find(|(plant, method, set_by, _)| {
            (&**plant, &**method, *set_by) == (line.plant, line.method, line.set_by)
        });
        known.map_or("", |(.., about)| about)
    }

    /// What was cut because it would have taken too long.
    pub fn cut(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.cut)
    }

    /// The reference of the plant that others are measured against: the first whose segments have mass.
    pub fn reference(&self) -> Option<&ReferenceNote> {
        let massive = |note: &&ReferenceNote| self.massive.contains(&note.plant);
        let mut notes = self.references.iter();
        notes.clone().find(massive).or_else(|| notes.next())
    }

    /// The floor of a plant's errors \[m\].
    pub(crate) fn floor_of(&self, plant: &str) -> f64 {
        let note = self.references.iter().find(|note| note.plant == plant);
        let check = note.and_then(|note| note.check.as_ref());
        check.map_or(0.0, |check| check.disagreement_rms_m)
    }

    /// The floor of the reference that others are measured against \[m\].
    pub(crate) fn floor(&self) -> f64 {
        self.reference()
            .map_or(0.0, |note| self.floor_of(&note.plant))
    }

    /// The orders of the methods that step, where their errors show one.
    pub fn orders(&self) -> Vec<Order> {
        let lines = self.lines().into_iter();
        lines
            .filter_map(|line| {
                let floor = ABOVE_FLOOR * self.floor_of(line.plant);
                let rows = self.rows.iter().filter(|row| {
                    row.kind == RowKind::Integration
                        && row.status == Status::Ok
                        && row.line() == line
                });
                let points: Vec<(f64, f64)> = rows
                    .filter_map(|row| Some((row.step_s?, row.error_rms_m?)))
                    .filter(|&(_, error)| error > floor.max(1e-15) && error < SATURATED_M)
                    .map(|(step, error)| (libm::log(step), libm::log(error)))
                    .collect();
                let order = fit::order(&points).ok()?;
                Some(Order {
                    plant: line.plant.to_owned(),
                    method: line.method.to_owned(),
                    order,
                    points: points.len(),
                })
            })
            .collect()
    }

    /// That something panicked, if so: the study is not what it should be.
    pub fn error(&self) -> Option<String> {
        panics::error(&self.panics)
    }

    /// The study as JSON, with the machine it ran on and the command that repeats it.
    pub fn json(&self, machine: &Machine, command: &str) -> Value {
        let pairs = self.criteria.iter();
        let criteria: Map<String, Value> = pairs
            .map(|(name, text)| (name.clone(), text.as_str().into()))
            .collect();
        json!({
            "study": self.kind,
            "scenario": self.scenario,
            "machine": machine,
            "reference": self.reference(),
            "rows": self.rows,
            "file": self.file,
            "command": command,
            "simulated_s": self.simulated_s,
            "compared_every_s": self.grid_s,
            "commands_played": self.commanded,
            "budget_s": self.budget_s,
            "references": self.references,
            "orders": self.orders(),
            "footsteps": self.footsteps,
            "dominance": self.dominances(),
            "floors": self.floors(),
            "transport": self.transports,
            "stiffness": self.stiffnesses(),
            "criteria": criteria,
            "left_out": self.left_out,
            "error": self.error(),
        })
    }
}

/// The methods that are offered, and a line on each.
fn abouts(factory: &dyn PlantFactory) -> Vec<(String, String, SetBy, String)> {
    let plants = factory.plants().iter();
    let methods = plants.flat_map(|plant| plant.methods.iter().map(move |method| (plant, method)));
    methods
        .map(|(plant, method)| {
            let (plant, name) = (plant.name.clone(), method.name.clone());
            (plant, name, method.set_by, method.about.clone())
        })
        .collect()
}
