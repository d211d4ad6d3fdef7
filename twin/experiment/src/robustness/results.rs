//! Results of a study of robustness.

use serde::Serialize;
use serde_json::{Value, json};
use twinrig_campaign::spread::Magnitude;
use twinrig_campaign::spread::{EnsembleKind, ExpectationSpread, Member};
use twinrig_campaign::sweep::ExpectationVerdict;
use twinrig_campaign::sweep::SweepRow;
use twinrig_report::number::{plain, si};

use super::{Divergence, Growth, MemberRun, RobustnessCase, RobustnessPlan};
use crate::gait::run::median;
use crate::machine::Machine;
use crate::parallel::RunResult;

/// Perturbed run of an ensemble.
#[derive(Clone, Debug, PartialEq)]
pub struct EnsembleRun {
    /// Its perturbation, verdict and expectations.
    pub member: Member,
    /// Divergence from the unperturbed run.
    pub divergence: Divergence,
}

/// Results of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct RobustnessResult {
    /// Scenario and plant.
    pub case: RobustnessCase,
    /// Expectations over all runs.
    pub expectations: Vec<ExpectationSpread>,
    /// Perturbed runs, by magnitude.
    pub perturbed: Vec<EnsembleRun>,
    /// The unperturbed run.
    pub unperturbed: Member,
    /// Median time of a stride of the unperturbed run \[s\].
    pub stride_s: Option<f64>,
}

/// Growth rates of those runs of an ensemble whose distances grow exponentially.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GrowthRate {
    /// Median: the greatest Lyapunov exponent \[1/s\].
    pub per_second: f64,
    /// Least \[1/s\].
    pub least: f64,
    /// Greatest \[1/s\].
    pub greatest: f64,
    /// Median over a stride of the unperturbed run.
    pub per_stride: Option<f64>,
    /// Number of these runs.
    pub runs: usize,
}

impl RobustnessResult {
    /// Evaluates the runs of a case.
    ///
    /// # Errors
    /// The reason why there is no unperturbed run.
    pub(super) fn new(
        case: &RobustnessCase,
        runs: Vec<RunResult<MemberRun>>,
        plan: &RobustnessPlan,
    ) -> Result<Self, String> {
        let mut runs = runs.into_iter();
        let reference = runs.next().unwrap_or_else(|| Err("no run".to_owned()))?;
        if let Some(error) = reference.row.error {
            return Err(error);
        }
        let perturbed = plan.magnitudes().into_iter().zip(runs);
        let perturbed: Vec<EnsembleRun> = perturbed
            .map(|(magnitude, run)| {
                let run = run.unwrap_or_else(|why| MemberRun {
                    row: SweepRow::of_error(why),
                    trajectory: super::Trajectory::default(),
                    strides_s: Vec::new(),
                });
                let distances = reference.trajectory.distances(&run.trajectory);
                let ends = [reference.row.simulated_s, run.row.simulated_s];
                let parted_s = match ends {
                    [Some(a), Some(b)] if a != b => Some(a.min(b)),
                    _ => None,
                };
                EnsembleRun {
                    divergence: Divergence::of(distances, plan.tolerance, parted_s),
                    member: Member {
                        magnitude: (case.kind == EnsembleKind::Starts).then_some(magnitude),
                        row: run.row,
                    },
                }
            })
            .collect();
        let unperturbed = Member {
            magnitude: None,
            row: reference.row,
        };
        let perturbed_members = perturbed.iter().map(|run| run.member.clone());
        let members = std::iter::once(unperturbed.clone()).chain(perturbed_members);
        Ok(Self {
            case: case.clone(),
            expectations: ExpectationSpread::all(&members.collect::<Vec<_>>()),
            perturbed,
            unperturbed,
            stride_s: median(reference.strides_s),
        })
    }

    /// Returns the predictability horizon: the first time at which a run one unit in the last place
    /// away is beyond the tolerance; of different seeds, at which any run is. None: beyond the end
    /// \[s\].
    pub fn horizon_s(&self) -> Option<f64> {
        let of_seeds = self.case.kind == EnsembleKind::Seeds;
        let least =
            |run: &&EnsembleRun| of_seeds || run.member.magnitude == Some(Magnitude::LastPlace);
        let crossed = self.perturbed.iter().filter(least);
        crossed
            .filter_map(|run| run.divergence.crossed_s)
            .min_by(f64::total_cmp)
    }

    /// Returns the growth rate of the ensemble; none if the distances of fewer than half of the
    /// perturbed runs grow exponentially.
    pub fn growth(&self) -> Option<GrowthRate> {
        let rates = self.perturbed.iter();
        let mut rates: Vec<f64> = rates
            .filter_map(|run| run.divergence.growth.rate())
            .collect();
        if 2 * rates.len() < self.perturbed.len() {
            return None;
        }
        rates.sort_by(f64::total_cmp);
        let (&least, &greatest) = (rates.first()?, rates.last()?);
        let runs = rates.len();
        let per_second = median(rates)?;
        Some(GrowthRate {
            per_second,
            least,
            greatest,
            per_stride: self.stride_s.map(|stride_s| per_second * stride_s),
            runs,
        })
    }

    /// Returns the expectations whose verdict changes with one unit in the last place.
    pub fn undetermined(&self) -> impl Iterator<Item = &ExpectationSpread> {
        let all = self.expectations.iter();
        all.filter(|it| it.is_undetermined())
    }

    /// Returns the horizon as text: `7.52 s`, `beyond the end`.
    pub fn horizon_text(&self) -> String {
        match (self.horizon_s(), &self.case.unit) {
            (_, None) => "no positions observed".to_owned(),
            (Some(at_s), _) => format!("{} s", plain(at_s)),
            (None, _) => "beyond the end".to_owned(),
        }
    }

    /// Returns the growth rate as text: `1.2/s, 0.33 a stride`.
    pub fn growth_text(&self) -> String {
        let Some(growth) = self.growth() else {
            return "not exponential".to_owned();
        };
        let stride = growth.per_stride;
        let stride = stride.map_or(String::new(), |it| format!(", {} a stride", plain(it)));
        format!("{}/s{stride}", plain(growth.per_second))
    }

    fn json(&self) -> Value {
        let runs = self.perturbed.iter().map(|run| {
            json!({
                "magnitude": magnitude(run.member.magnitude),
                "verdict": run.member.row.verdict,
                "seed": run.member.row.seed,
                "fell_at_s": run.member.row.fell_at_s,
                "error": run.member.row.error,
                "crossed_s": run.divergence.crossed_s,
                "growth": run.divergence.growth,
            })
        });
        json!({
            "case": self.case,
            "expectations": self.expectations,
            "undetermined": self.undetermined().map(|it| &it.name).collect::<Vec<_>>(),
            "horizon_s": self.horizon_s(),
            "growth": self.growth(),
            "stride_s": self.stride_s,
            "runs": runs.collect::<Vec<_>>(),
        })
    }
}

fn magnitude(magnitude: Option<Magnitude>) -> Value {
    Magnitude::serialized(magnitude, serde_json::value::Serializer).unwrap_or_default()
}

/// Results of a study of robustness, without the machine it ran on.
#[derive(Clone, Debug, PartialEq)]
pub struct RobustnessStudy {
    /// Its parameters.
    pub plan: RobustnessPlan,
    /// Results of each case.
    pub results: Vec<RobustnessResult>,
    /// Parts that are left out, each with the reason.
    pub left_out: Vec<String>,
}

/// Row of the CSV file: an expectation in a run.
#[derive(Serialize)]
struct CsvRow<'a> {
    scenario: &'a str,
    plant: &'a str,
    run: usize,
    #[serde(serialize_with = "Magnitude::serialized")]
    magnitude: Option<Magnitude>,
    seed: Option<u64>,
    crossed_s: Option<f64>,
    expectation: &'a str,
    verdict: ExpectationVerdict,
    holds: bool,
    measured: Option<f64>,
    bound: Option<f64>,
    margin: Option<f64>,
    unit: &'a str,
    error: Option<&'a str>,
}

impl RobustnessStudy {
    /// Returns a summary that agrees with the tables.
    pub fn headline(&self) -> String {
        let sentences = self.results.iter().map(|result| {
            let (runs, of) = (self.plan.runs, result.expectations.len());
            let always = result.expectations.iter().filter(|it| it.held == it.runs);
            let (scenario, horizon) = (&result.case.scenario, result.horizon_text());
            let always = always.count();
            format!("{scenario}: {always} of {of} expectations hold in all {runs} runs, horizon {horizon}.")
        });
        sentences.collect::<Vec<_>>().join(" ")
    }

    /// Returns the first error of a perturbed run.
    pub fn error(&self) -> Option<String> {
        let runs = self.results.iter().flat_map(|result| {
            let of = &result.case.scenario;
            result.perturbed.iter().map(move |run| (of, run))
        });
        let mut errors = runs.filter_map(|(of, run)| Some((of, run.member.row.error.as_ref()?)));
        errors
            .next()
            .map(|(of, error)| format!("a perturbed run of {of} has an error: {error}"))
    }

    /// Returns the tolerance of trajectories in the unit of a case: `1 mm`, `1 mrad`.
    pub fn tolerance_text(&self, result: &RobustnessResult) -> String {
        si(
            self.plan.tolerance,
            result.case.unit.as_deref().unwrap_or("m"),
        )
    }

    /// Returns the study as JSON, with the machine it ran on and the command that repeats it.
    pub fn json(&self, machine: &Machine, command: &str) -> Value {
        json!({
            "study": "robustness",
            "machine": machine,
            "command": command,
            "runs": self.plan.runs,
            "tolerance": self.plan.tolerance,
            "headline": self.headline(),
            "results": self.results.iter().map(RobustnessResult::json).collect::<Vec<_>>(),
            "left_out": self.left_out,
        })
    }

    /// Returns the expectations of all runs as comma-separated values.
    pub fn csv(&self) -> String {
        let mut rows = Vec::new();
        for result in &self.results {
            let first = std::iter::once((&result.unperturbed, None));
            let others = result.perturbed.iter();
            let others = others.map(|run| (&run.member, run.divergence.crossed_s));
            for (run, (member, crossed_s)) in first.chain(others).enumerate() {
                rows.extend(member.row.expectations.iter().map(|one| CsvRow {
                    scenario: &result.case.scenario,
                    plant: &result.case.plant,
                    run,
                    magnitude: member.magnitude,
                    seed: member.row.seed,
                    crossed_s,
                    expectation: &one.name,
                    verdict: one.verdict,
                    holds: one.holds,
                    measured: one.measured,
                    bound: one.bound,
                    margin: one.margin,
                    unit: &one.unit,
                    error: member.row.error.as_deref(),
                }));
            }
        }
        crate::csv::table(&rows, "", &[])
    }
}

impl EnsembleRun {
    /// Returns the growth of its distance as text.
    pub fn growth_text(&self) -> String {
        match self.divergence.growth {
            Growth::Exponential { rate, .. } => format!("{}/s", plain(rate)),
            Growth::Power { exponent } => format!("as time to the power {}", plain(exponent)),
            Growth::None => "none".to_owned(),
        }
    }
}
