//! Study of load filters: identification of both cells, tuning of the filters and their validation,
//! each on a run of its own (sections 4.3.2.2 and 4.3.2.3).

mod calibrate;
mod curves;
mod data;
mod distribution;
mod filter;
mod identify;
mod options;
mod printed;
pub(crate) mod recorder;
mod results;
mod settings_text;
mod track;
mod tune;
mod validate;
mod view;

pub use calibrate::{CalibrationRun, calibrate, calibration_text, samples_fingerprint};
pub use curves::{EstimateCurve, LoopPoint, VoltageCurve, VoltagePoint};
pub use data::{LoadRun, LoadSample, SteadyPart};
pub use distribution::Residuals;
pub use filter::FilterKind;
pub use identify::Identification;
pub use options::EstimateOptions;
pub use printed::{PrintedFigure, Verdict};
pub use results::EstimateStudy;
pub use tune::{SearchSize, TunedFilter};
pub use validate::{EstimatePoint, FilterRow};

use crate::budget::{Budget, Share, Weight};
use crate::error::StudyError;
use crate::incidents::Incidents;
use crate::measured::{Measuring, Parts};
use data::{Phase, Signals};
use validate::Estimates;

/// Subject of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimateInput {
    /// Name of the scenario.
    pub name: String,
    /// Path of the scenario file.
    pub file: String,
    /// Duration of a run \[s\].
    pub duration_s: f64,
    /// Seed of the first run; the others have the two next ones.
    pub seed: u64,
    /// Signal of the measured frequency, for the settings of F2.
    pub frequency_signal: String,
}

/// Records the samples of a sensor.
pub trait LoadRecorder {
    /// Returns the subject of the study.
    fn input(&self) -> &EstimateInput;

    /// Runs the bench with a seed.
    ///
    /// # Errors
    /// The reason of a run that cannot be built, or fails.
    fn record(&self, seed: u64) -> Result<LoadRun, String>;
}

/// Parameters of a study of load filters.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimatePlan {
    /// Size of the search of each filter.
    pub search: SearchSize,
    /// Time budget of the whole study; it ends searches early \[s\].
    pub budget_s: f64,
}

impl Default for EstimatePlan {
    fn default() -> Self {
        Self {
            search: SearchSize {
                particles: 20,
                iterations: 25,
            },
            budget_s: 200.0,
        }
    }
}

/// Least number of periods at a frequency. Maxima are those of complete periods, three of four.
const PERIODS: f64 = 4.0;
/// Least number of frequencies: an exponential has two parameters.
const FREQUENCIES: usize = 2;

/// Identifies both cells, tunes the filters and validates them.
///
/// The result is a function of the recorded runs and the seed, unless the budget ends a search.
///
/// # Errors
/// [`StudyError`] if a run fails or is unsuitable, an identification is impossible, or the observer
/// stopped the study.
pub fn estimate<'m>(
    recorder: &dyn LoadRecorder,
    plan: &EstimatePlan,
    measuring: impl Into<Measuring<'m>>,
) -> Result<EstimateStudy, StudyError> {
    let input = recorder.input();
    let mut left_out = Vec::new();
    let weights = [
        (Weight::Run, RUNS.len()),
        (Weight::Reference, FilterKind::ALL.len()),
    ];
    let budget = Budget::new(plan.budget_s, &weights);
    let incidents = Incidents::default();
    let mut measuring = measuring.into();
    let mut job = Job {
        recorder,
        parts: Parts::new(budget, &mut measuring, &incidents, &plan.search),
    };
    let identified = job.run(0, Phase::Zero, &mut left_out)?;
    let identification = identify::identify(&identified)?;
    let tuned_on = job.run(1, Phase::Causal, &mut left_out)?;
    let mut filters = Vec::new();
    for kind in FilterKind::ALL {
        filters.push(job.tune(kind, &identification, &tuned_on, plan.search)?);
    }
    let validated = job.run(2, Phase::Causal, &mut left_out)?;
    let (mut rows, mut estimates) = (Vec::new(), Vec::new());
    for filter in &filters {
        let found = Estimates::of(filter, &validated)?;
        rows.extend(found.rows(filter.kind.name(), &validated));
        estimates.extend(curves::estimates(filter.kind, &found, &validated));
    }
    Ok(EstimateStudy {
        starts: job.parts.finish()?,
        scenario: input.name.clone(),
        file: input.file.clone(),
        simulated_s: input.duration_s,
        seeds: RUNS.map(|run| seed(input, run.0)),
        frequency_signal: input.frequency_signal.clone(),
        search: plan.search,
        budget_s: plan.budget_s,
        loop_points: curves::loop_points(&identified, &identification),
        voltages: curves::voltages(&identified, &identification),
        identification,
        filters,
        rows,
        estimates,
        left_out,
    })
}

/// Runs: offset of the seed, and what they are for.
const RUNS: [(u64, &str); 3] = [(0, "identification"), (1, "tuning"), (2, "validation")];

fn seed(input: &EstimateInput, offset: u64) -> u64 {
    input.seed.wrapping_add(offset)
}

/// A running study.
struct Job<'a> {
    recorder: &'a dyn LoadRecorder,
    parts: Parts<'a>,
}

impl Job<'_> {
    /// Records a run and low-passes its channels; parts that are too short are left out.
    fn run(
        &mut self,
        number: usize,
        phase: Phase,
        left_out: &mut Vec<String>,
    ) -> Result<Signals, StudyError> {
        let (offset, purpose) = RUNS[number];
        // Its samples are many, and the same at each start.
        self.parts
            .begin(&format!("run for {purpose}"), Weight::Run)?;
        let seed = seed(self.recorder.input(), offset);
        let run = self.recorder.record(seed).map_err(StudyError::Run)?;
        self.parts.check_interrupt()?;
        let mut signals = Signals::new(&run, phase)?;
        let period_s = signals.period_s;
        let periods = |part: &data::Part| part.samples.len() as f64 * period_s * part.hz;
        signals.parts.retain(|part| {
            let enough = periods(part) >= PERIODS;
            if !enough {
                left_out.push(format!(
                    "{} Hz of the run for {purpose}: {:.1} periods are fewer than {PERIODS}",
                    part.hz,
                    periods(part),
                ));
            }
            enough
        });
        let found = signals.parts.len();
        if found < FREQUENCIES {
            return Err(StudyError::FewFrequencies {
                found,
                required: FREQUENCIES,
                periods: PERIODS,
            });
        }
        Ok(signals)
    }

    fn tune(
        &mut self,
        kind: FilterKind,
        identification: &Identification,
        signals: &Signals,
        size: SearchSize,
    ) -> Result<TunedFilter, StudyError> {
        let seed = seed(self.recorder.input(), RUNS[1].0);
        let content = (kind, identification, seed);
        let measure = |share: Share, report: &mut dyn FnMut(&str) -> bool| {
            let mut keep_running = |swarm: u64, iteration: usize| {
                let name = kind.name();
                report(&format!("{name}, swarm {swarm}, iteration {iteration}"))
                    && !share.deadline.passed()
            };
            tune::tune(kind, identification, signals, size, seed, &mut keep_running)
        };
        let (label, weight) = (kind.name(), Weight::Reference);
        self.parts
            .measure_and_report(label, weight, &content, measure)
    }
}
