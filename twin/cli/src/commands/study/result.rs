//! Results of studies of any kind.

use std::path::PathBuf;

use serde_json::json;
use twinrig_experiment::{
    CouplingStudy, EstimateStudy, FeedbackStudy, Machine, ModulationStudy, RobustnessStudy, Study,
    TransitionStudy, csv, radius_markdown, radius_page,
};

use crate::radius::{self, execute::RadiusOutcome};

/// Result of a study.
pub(super) enum StudyResult {
    Plants(Study),
    Coupling(CouplingStudy),
    Estimate(Box<EstimateStudy>),
    Modulation(ModulationStudy),
    Transition(TransitionStudy),
    Feedback(Box<FeedbackStudy>),
    Radius(Box<RadiusOutcome>),
    Robustness(RobustnessStudy, Vec<NamedRadius>),
}

/// Radii of a scenario of another study.
pub(super) struct NamedRadius {
    /// Name of the files.
    pub(super) name: String,
    pub(super) outcome: RadiusOutcome,
}

impl StudyResult {
    /// Returns the error of a study in which a part panicked, or that has no result.
    pub(super) fn error(&self) -> Option<String> {
        match self {
            Self::Plants(study) => study.error(),
            Self::Coupling(study) => study.error(),
            Self::Modulation(study) => study.error(),
            Self::Robustness(study, _) => study.error(),
            Self::Estimate(_) | Self::Transition(_) | Self::Feedback(_) | Self::Radius(_) => None,
        }
    }

    /// Returns whether the answer of a study is no.
    pub(super) fn is_negative(&self) -> bool {
        match self {
            Self::Feedback(study) => !study.void().is_empty(),
            Self::Radius(study) => study.result.fails_undisturbed(),
            _ => self
                .radii()
                .iter()
                .any(|it| it.outcome.result.fails_undisturbed()),
        }
    }

    /// Returns the radii of the scenarios of a study of another kind.
    pub(super) fn radii(&self) -> &[NamedRadius] {
        match self {
            Self::Robustness(_, radii) => radii,
            _ => &[],
        }
    }

    pub(super) fn json(&self, machine: &Machine, command: &str) -> serde_json::Value {
        match self {
            Self::Plants(study) => study.json(machine, command),
            Self::Coupling(study) => study.json(machine, command),
            Self::Estimate(study) => study.json(machine, command),
            Self::Modulation(study) => study.json(machine, command),
            Self::Transition(study) => study.json(machine, command),
            Self::Feedback(study) => study.json(machine, command),
            Self::Radius(study) => json!(study.result),
            Self::Robustness(study, radii) => with_radii(study.json(machine, command), radii),
        }
    }

    pub(super) fn html(&self, machine: &Machine, command: &str) -> String {
        match self {
            Self::Plants(study) => study.page(machine, command).html(),
            Self::Coupling(study) => study.page(machine, command).html(),
            Self::Estimate(study) => study.page(machine, command).html(),
            Self::Modulation(study) => study.page(machine, command).html(),
            Self::Transition(study) => study.page(machine, command).html(),
            Self::Feedback(study) => study.page(machine, command).html(),
            Self::Radius(study) => radius_page(&study.result).html(),
            Self::Robustness(study, _) => study.page(machine, command).html(),
        }
    }

    pub(super) fn csv(&self) -> String {
        match self {
            Self::Plants(study) => csv(&study.rows),
            Self::Coupling(study) => study.csv(),
            Self::Estimate(study) => study.csv(),
            Self::Modulation(study) => study.csv(),
            Self::Transition(study) => study.csv(),
            Self::Feedback(study) => study.csv(),
            Self::Radius(study) => study.result.csv(),
            Self::Robustness(study, _) => study.csv(),
        }
    }

    /// Returns the tables for documents in Markdown; none of most studies.
    pub(super) fn markdown(&self) -> Option<String> {
        match self {
            Self::Radius(study) => Some(radius_markdown(&study.result)),
            Self::Robustness(study, _) => Some(study.markdown()),
            _ => None,
        }
    }

    pub(super) fn text(&self, files: &[PathBuf]) -> String {
        match self {
            Self::Plants(study) => study.summary().finish(files),
            Self::Coupling(study) => study.summary().finish(files),
            Self::Estimate(study) => study.summary().finish(files),
            Self::Modulation(study) => study.summary().finish(files),
            Self::Transition(study) => study.summary().finish(files),
            Self::Feedback(study) => study.summary().finish(files),
            Self::Radius(study) => radius::table::text(study, files),
            Self::Robustness(study, radii) => robustness_text(study, radii, files),
        }
    }
}

/// Adds the radii, if there are any, to the object of a study.
fn with_radii(mut study: serde_json::Value, radii: &[NamedRadius]) -> serde_json::Value {
    if !radii.is_empty() {
        let results = radii.iter().map(|it| &it.outcome.result);
        study["radius"] = json!(results.collect::<Vec<_>>());
    }
    study
}

/// Formats ensembles and radii; the names of all files are at the end.
fn robustness_text(study: &RobustnessStudy, radii: &[NamedRadius], files: &[PathBuf]) -> String {
    let files_after = |part: usize| if part == radii.len() { files } else { &[] };
    let mut ensembles = study.summary();
    ensembles.left_out(&study.left_out);
    let ensembles = ensembles.finish(files_after(0));
    let radii = radii.iter().enumerate();
    let radii = radii.map(|(part, it)| radius::table::text(&it.outcome, files_after(part + 1)));
    let texts = std::iter::once(ensembles).chain(radii);
    let texts = texts.map(|text| text.trim_end().to_owned());
    texts.collect::<Vec<_>>().join("\n\n")
}
