//! Statistics of the displacements of a case, by one way of counting footsteps.

use serde::Serialize;

use super::fit::{LinearModel, ModelForm, Sample, correlation_squared};

/// Way of counting footsteps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Counting {
    /// One footstep for each cycle of the leg's oscillator.
    #[serde(rename = "cycle")]
    Cycle,
    /// Every touch-down, bounces included.
    #[serde(rename = "touch-down")]
    TouchDown,
}

impl Counting {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Cycle, Self::TouchDown];

    /// Returns the name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cycle => "cycle",
            Self::TouchDown => "touch-down",
        }
    }
}

/// Displacement of one footstep of a re-run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Displacement {
    /// How footsteps are counted.
    pub counting: Counting,
    /// Change of the variable.
    pub by: f64,
    /// Point of the gait cycle, from 0.
    pub point: usize,
    /// Index of the leg.
    pub leg: usize,
    /// Number of the footstep of this leg after the change, from 1.
    pub step: usize,
    /// Displacement along the heading; none if a run lacks the footstep \[m\].
    pub along_m: Option<f64>,
}

/// Displacements at one change and one footstep, over points and legs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DisplacementCell {
    /// Change of the variable.
    pub by: f64,
    /// Number of the footstep.
    pub step: usize,
    /// Number of displacements.
    pub count: usize,
    /// Footsteps that one of the runs lacks.
    pub missing: usize,
    /// Mean \[m\].
    pub mean_m: f64,
    /// Standard deviation \[m\].
    pub deviation_m: f64,
    /// Least and greatest \[m\].
    pub range_m: [f64; 2],
    /// Number of displacements in the direction of the change.
    pub with_change: usize,
}

/// Statistics of all displacements of a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DisplacementTable {
    /// How footsteps are counted.
    pub counting: Counting,
    /// Cells, by change and then by footstep.
    pub cells: Vec<DisplacementCell>,
    /// Squared correlation with the change, for each number of the footstep; none without spread.
    pub r_squared: Vec<Option<f64>>,
    /// Models over all footsteps.
    pub models: Vec<LinearModel>,
    /// Share of first footsteps displaced in the direction of the change; none without any.
    pub first_step: Option<f64>,
    /// Cell with the greatest mean displacement against the change; none if all means are with it.
    pub opposite: Option<DisplacementCell>,
}

impl DisplacementTable {
    pub(crate) fn new(counting: Counting, all: &[Displacement], changes: &[f64]) -> Self {
        let of: Vec<&Displacement> = all.iter().filter(|it| it.counting == counting).collect();
        let steps = of.iter().map(|it| it.step).max().unwrap_or(0);
        let cells: Vec<DisplacementCell> = changes
            .iter()
            .flat_map(|by| (1..=steps).map(move |step| (*by, step)))
            .map(|(by, step)| DisplacementCell::new(by, step, &of))
            .collect();
        let samples: Vec<Sample> = of
            .iter()
            .filter_map(|it| {
                Some(Sample {
                    by: it.by,
                    step: it.step,
                    point: it.point,
                    along_m: it.along_m?,
                })
            })
            .collect();
        let at = |step: usize| -> Vec<Sample> {
            let at = samples.iter().filter(|sample| sample.step == step);
            at.copied().collect()
        };
        let models = ModelForm::ALL.into_iter();
        Self {
            counting,
            r_squared: (1..=steps)
                .map(|step| correlation_squared(&at(step)))
                .collect(),
            models: models
                .filter_map(|form| LinearModel::fit(form, &samples))
                .collect(),
            first_step: first_step(&cells),
            opposite: opposite(&cells),
            cells,
        }
    }

    /// Returns the cell of a change and a footstep.
    pub fn cell(&self, by: f64, step: usize) -> Option<&DisplacementCell> {
        let mut cells = self.cells.iter();
        cells.find(|cell| cell.by == by && cell.step == step)
    }

    /// Returns the model of a form.
    pub fn model(&self, form: ModelForm) -> Option<&LinearModel> {
        self.models.iter().find(|model| model.form == form)
    }

    /// Returns the greatest mean displacement against the change; 0 if there is none \[m\].
    pub fn opposite_m(&self) -> f64 {
        self.opposite.map_or(0.0, |cell| cell.mean_m.abs())
    }

    /// Returns the number of footsteps that one of the runs lacks.
    pub fn missing(&self) -> usize {
        self.cells.iter().map(|cell| cell.missing).sum()
    }
}

impl DisplacementCell {
    fn new(by: f64, step: usize, all: &[&Displacement]) -> Self {
        let here = || all.iter().filter(|it| it.by == by && it.step == step);
        let values: Vec<f64> = here().filter_map(|it| it.along_m).collect();
        let count = values.len();
        let mean_m = values.iter().sum::<f64>() / count.max(1) as f64;
        let squares = values
            .iter()
            .map(|value| (value - mean_m) * (value - mean_m));
        let variance = squares.sum::<f64>() / count.saturating_sub(1).max(1) as f64;
        let (mut low, mut high) = (mean_m, mean_m);
        for value in &values {
            (low, high) = (low.min(*value), high.max(*value));
        }
        Self {
            by,
            step,
            count,
            missing: here().count() - count,
            mean_m,
            deviation_m: variance.sqrt(),
            range_m: [low, high],
            with_change: values.iter().filter(|value| *value * by > 0.0).count(),
        }
    }

    /// Returns the mean displacement against the change; negative if it is with the change \[m\].
    fn against_m(&self) -> f64 {
        if self.by < 0.0 {
            self.mean_m
        } else {
            -self.mean_m
        }
    }
}

fn first_step(cells: &[DisplacementCell]) -> Option<f64> {
    let first = cells.iter().filter(|cell| cell.step == 1 && cell.by != 0.0);
    let (mut with, mut of) = (0, 0);
    for cell in first {
        with += cell.with_change;
        of += cell.count;
    }
    (of > 0).then(|| with as f64 / of as f64)
}

fn opposite(cells: &[DisplacementCell]) -> Option<DisplacementCell> {
    let against = cells
        .iter()
        .filter(|cell| cell.by != 0.0 && cell.against_m() > 0.0);
    let greatest = against.max_by(|a, b| a.against_m().total_cmp(&b.against_m()));
    greatest.copied()
}
