//! Results of studies of any kind.

use std::path::PathBuf;

use serde_json::json;
use twinrig_study::{
    CouplingStudy, EstimateStudy, FeedbackStudy, Machine, ModulationStudy, RobustnessStudy, Study,
    TransitionStudy, csv, html, radius_markdown, radius_page,
};

use crate::radius::{self, execute::RadiusOutcome};

use crate::study::{
    coupling_table, estimate_table, feedback_table, modulation_table, robustness_table, table,
    transition_table,
};

/// Result of a study.
pub(super) enum StudyResult {
    Plants(Study),
    Coupling(CouplingStudy),
    Estimate(Box<EstimateStudy>),
    Modulation(ModulationStudy),
    Transition(TransitionStudy),
    Feedback(Box<FeedbackStudy>),
    Radius(Box<RadiusOutcome>),
    Robustness(RobustnessStudy),
}

impl StudyResult {
    /// Returns the error of a study in which a part panicked, or that has no result.
    pub(super) fn error(&self) -> Option<String> {
        match self {
            Self::Plants(study) => study.error(),
            Self::Coupling(study) => study.error(),
            Self::Modulation(study) => study.error(),
            Self::Robustness(study) => study.error(),
            Self::Estimate(_) | Self::Transition(_) | Self::Feedback(_) | Self::Radius(_) => None,
        }
    }

    /// Returns whether the answer of a study is no.
    pub(super) fn is_negative(&self) -> bool {
        match self {
            Self::Feedback(study) => !study.void().is_empty(),
            Self::Radius(study) => study.result.fails_undisturbed(),
            _ => false,
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
            Self::Robustness(study) => study.json(machine, command),
        }
    }

    pub(super) fn html(&self, machine: &Machine, command: &str) -> String {
        match self {
            Self::Plants(study) => html(study, machine, command),
            Self::Coupling(study) => study.html(machine, command),
            Self::Estimate(study) => study.html(machine, command),
            Self::Modulation(study) => study.html(machine, command),
            Self::Transition(study) => study.html(machine, command),
            Self::Feedback(study) => study.html(machine, command),
            Self::Radius(study) => radius_page(&study.result),
            Self::Robustness(study) => study.html(machine, command),
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
            Self::Robustness(study) => study.csv(),
        }
    }

    /// Returns the tables for documents in Markdown; none of most studies.
    pub(super) fn markdown(&self) -> Option<String> {
        match self {
            Self::Radius(study) => Some(radius_markdown(&study.result)),
            Self::Robustness(study) => Some(study.markdown()),
            _ => None,
        }
    }

    pub(super) fn text(&self, files: &[PathBuf]) -> String {
        match self {
            Self::Plants(study) => table::text(study, files),
            Self::Coupling(study) => coupling_table::text(study, files),
            Self::Estimate(study) => estimate_table::text(study, files),
            Self::Modulation(study) => modulation_table::text(study, files),
            Self::Transition(study) => transition_table::text(study, files),
            Self::Feedback(study) => feedback_table::text(study, files),
            Self::Radius(study) => radius::table::text(study, files),
            Self::Robustness(study) => robustness_table::text(study, files),
        }
    }
}
