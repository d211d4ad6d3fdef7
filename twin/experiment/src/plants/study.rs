//! Results of a study of precision or stability.

use serde::Serialize;
use serde_json::{Map, Value, json};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_rig::PlantId;
use twinrig_rig::SettingKind;

use crate::csv;
use crate::fit;
use crate::incidents;
use crate::machine::Machine;
use crate::measured::Starts;
use crate::plants::contact::ContactResiduals;
use crate::plants::ensemble::Ensemble;
use crate::plants::factory::PlantFactory;
use crate::plants::footsteps::Footstep;
use crate::plants::reference_note::ReferenceNote;
use crate::plants::row::{Row, RowKind, Series, Status};
use crate::plants::transport::Transport;

/// Kind of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StudyKind {
    /// Error against run time.
    Precision,
    /// The largest stable step.
    Stability,
}

impl StudyKind {
    /// Returns the name used on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Precision => "precision",
            Self::Stability => "stability",
        }
    }
}

/// Results of a study, without the machine it ran on.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// Kind of the study.
    pub kind: StudyKind,
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
    /// Whether the commands change during the run.
    pub commanded: bool,
    /// Whether the feet can touch ground.
    pub ground: bool,
    /// Time budget \[s\].
    pub budget_s: f64,
    /// Plants whose leg segments have mass.
    pub massive: Vec<PlantId>,
    /// Pairs (plant, model): the plant solves the model of the other plant by a different engine.
    pub solves: Vec<(PlantId, String)>,
    /// Pairs (plant, peer): errors of the plant are compared with those of its peer, a similar
    /// model, each against its own reference.
    pub peers: Vec<(PlantId, String)>,
    /// Offered methods: plant, name, setting kind and description.
    pub abouts: Vec<(PlantId, String, SettingKind, String)>,
    /// Reference of each plant.
    pub references: Vec<ReferenceNote>,
    /// Rows, one for each run or search.
    pub rows: Vec<Row>,
    /// Differences of the touch-downs between models.
    pub footsteps: Vec<Footstep>,
    /// Cost of transport by plant and method.
    pub transports: Vec<Transport>,
    /// Contact of the feet by plant and method.
    pub contacts: Vec<ContactResiduals>,
    /// Ensembles of perturbed walks by plant.
    pub ensembles: Vec<Ensemble>,
    /// Definitions of the criteria: name and text.
    pub criteria: Vec<(String, String)>,
    /// Omitted plants and factors, each with the reason.
    pub left_out: Vec<String>,
    /// Starts of the program whose measurements it has.
    pub starts: Starts,
    /// Panics, each a bug in a plant or in this crate. The affected rows have status `failed` and
    /// the same reason.
    pub panics: Vec<String>,
}

/// Order of convergence of a method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Order {
    /// Plant.
    #[serde(flatten)]
    pub plant: PlantId,
    /// Method.
    pub method: String,
    /// Slope of log error over log step, by least squares over the settings whose error lies
    /// between the floor of the reference and saturation.
    pub order: f64,
    /// Number of settings used.
    pub points: usize,
}

/// Least ratio of an error to the floor of the reference for the fit of an order.
const ABOVE_FLOOR: f64 = 10.0;
/// Saturation: larger errors are excluded from the fit of an order \[m\].
const SATURATED_M: f64 = 1e-2;

impl Study {
    pub(crate) fn new(
        kind: StudyKind,
        factory: &dyn PlantFactory,
        end: SimTime,
        grid: SimDuration,
    ) -> Self {
        let input = factory.input();
        let plants = factory.plants().iter();
        let massive = plants.clone().filter(|plant| plant.segment_masses);
        let peers = plants
            .clone()
            .filter_map(|plant| Some((plant.plant.clone(), plant.peer.clone()?)));
        let solves =
            plants.filter_map(|plant| Some((plant.plant.clone(), plant.model_of.clone()?)));
        Self {
            kind,
            scenario: input.name.clone(),
            file: input.file.clone(),
            scene_s: input.duration.as_nanos() as f64 / 1e9,
            simulated_s: end.as_nanos() as f64 / 1e9,
            grid_s: grid.as_nanos() as f64 / 1e9,
            commanded: input.commands.change(),
            ground: input.ground,
            budget_s: 0.0,
            massive: massive.map(|plant| plant.plant.clone()).collect(),
            peers: peers.collect(),
            solves: solves.collect(),
            abouts: abouts(factory),
            references: Vec::new(),
            rows: Vec::new(),
            footsteps: Vec::new(),
            transports: Vec::new(),
            contacts: Vec::new(),
            ensembles: Vec::new(),
            criteria: Vec::new(),
            left_out: factory.left_out().to_vec(),
            starts: Starts::default(),
            panics: Vec::new(),
        }
    }

    /// Returns the series (plant, method, setting kind) in the order of their rows.
    pub fn series(&self) -> Vec<Series<'_>> {
        let mut all = Vec::new();
        for row in &self.rows {
            let ours = matches!(row.kind, RowKind::Integration | RowKind::Stability);
            if ours && !all.contains(&row.series()) {
                all.push(row.series());
            }
        }
        all
    }

    /// Returns the series, each with a number that all setting kinds of one method share.
    pub(crate) fn numbered_series(&self) -> Vec<(usize, Series<'_>)> {
        let mut methods: Vec<(&PlantId, &str)> = Vec::new();
        let all = self.series().into_iter();
        all.map(|series| {
            let method = (series.plant, series.method);
            let known = methods.iter().position(|&known| known == method);
            let number = known.unwrap_or_else(|| {
                methods.push(method);
                methods.len() - 1
            });
            (number, series)
        })
        .collect()
    }

    /// Returns the description of the method of a series.
    pub(crate) fn about(&self, series: Series<'_>) -> &str {
        let known = self.abouts.iter().find(|(plant, method, set_by, _)| {
            (plant, &**method, *set_by) == (series.plant, series.method, series.set_by)
        });
        known.map_or("", |(.., about)| about)
    }

    /// Returns the rows that were truncated by the budget.
    pub fn cut(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.cut)
    }

    /// Returns the reference of the base model: of the first plant whose segments have mass.
    pub fn reference(&self) -> Option<&ReferenceNote> {
        let massive = |note: &&ReferenceNote| self.massive.contains(&note.plant);
        let mut notes = self.references.iter();
        notes.clone().find(massive).or_else(|| notes.next())
    }

    /// Returns the floor of a plant's errors: the RMS disagreement of its reference and the check
    /// \[m\].
    pub fn floor_of(&self, plant: &PlantId) -> f64 {
        let note = self.references.iter().find(|note| note.plant == *plant);
        let check = note.and_then(|note| note.check.as_ref());
        check.map_or(0.0, |check| check.disagreement_rms_m)
    }

    /// Returns the floor of the reference of the base model \[m\].
    pub(crate) fn floor(&self) -> f64 {
        self.reference()
            .map_or(0.0, |note| self.floor_of(&note.plant))
    }

    /// Returns the orders of convergence of the fixed-step methods whose errors show one.
    pub fn orders(&self) -> Vec<Order> {
        let all = self.series().into_iter();
        all.filter_map(|series| {
            let floor = ABOVE_FLOOR * self.floor_of(series.plant);
            let rows = self.rows.iter().filter(|row| {
                row.kind == RowKind::Integration
                    && row.status == Status::Ok
                    && row.series() == series
            });
            let points: Vec<(f64, f64)> = rows
                .filter_map(|row| Some((row.step_s?, row.error_rms_m?)))
                .filter(|&(_, error)| error > floor.max(1e-15) && error < SATURATED_M)
                .map(|(step, error)| (libm::log(step), libm::log(error)))
                .collect();
            let order = fit::order(&points).ok()?;
            Some(Order {
                plant: series.plant.clone(),
                method: series.method.to_owned(),
                order,
                points: points.len(),
            })
        })
        .collect()
    }

    /// Returns a description of the panics of the study, if there was any.
    pub fn error(&self) -> Option<String> {
        incidents::error(&self.panics)
    }

    /// Returns the rows as CSV (RFC 4180), with the JSON keys as header; values that do not apply
    /// are empty.
    pub fn csv(&self) -> String {
        // The two keys that are omitted where they do not apply are adjacent.
        csv::table(&self.rows, "method", &["step_s", "tolerance"])
    }

    /// Returns the study as JSON, with the machine it ran on and the command that repeats it.
    pub fn json(&self, machine: &Machine, command: &str) -> Value {
        let pairs = self.criteria.iter();
        let criteria: Map<String, Value> = pairs
            .map(|(name, text)| (name.clone(), text.as_str().into()))
            .collect();
        json!({
            "study": self.kind,
            "scenario": self.scenario,
            "machine": self.starts.machine(machine),
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
            "tolerance_slopes": self.tolerance_slopes(),
            "footsteps": self.footsteps,
            "dominance": self.dominances(),
            "floors": self.floors(),
            "transport": self.transports,
            "contacts": self.contacts,
            "ensembles": self.ensembles,
            "ensembles_differ": self.ensemble_differences(),
            "stiffness": self.stiffnesses(),
            "error_control": self.error_control_trends(),
            "criteria": criteria,
            "left_out": self.left_out,
            "starts": self.starts,
            "error": self.error(),
        })
    }
}

/// Returns plant, name, setting kind and description of every offered method.
fn abouts(factory: &dyn PlantFactory) -> Vec<(PlantId, String, SettingKind, String)> {
    let plants = factory.plants().iter();
    let methods = plants.flat_map(|plant| plant.methods.iter().map(move |method| (plant, method)));
    methods
        .map(|(plant, method)| {
            let (plant, name) = (plant.plant.clone(), method.name.clone());
            (plant, name, method.set_by, method.about.clone())
        })
        .collect()
}
