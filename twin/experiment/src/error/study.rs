use thiserror::Error;

/// Error that prevents a study. A failure of one part is a row of the study instead.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum StudyError {
    /// No plant is selected.
    #[error("there is no plant to study")]
    NoPlant,
    /// The duration is shorter than one sampling period.
    #[error("{duration} is too short to study: nothing shorter than {least} is compared")]
    TooShort {
        /// Requested duration.
        duration: twinrig_kernel::SimDuration,
        /// Least duration.
        least: twinrig_kernel::SimDuration,
    },
    /// The observer or an interrupt stopped the study.
    #[error("interrupted after {done} of {of} parts")]
    Interrupted {
        /// Number of parts begun.
        done: usize,
        /// Number of parts.
        of: usize,
    },
    /// An interrupt stopped a study that keeps its runs.
    #[error(
        "interrupted after {done} of {of} runs\n  = help: the same command continues the study"
    )]
    InterruptedRuns {
        /// Number of runs that are done.
        done: usize,
        /// Number of runs so far planned.
        of: usize,
    },
    /// The observer or an interrupt stopped a study that keeps its parts.
    #[error(
        "interrupted after {done} of {of} parts\n  = help: the same command continues the study"
    )]
    InterruptedParts {
        /// Number of parts begun.
        done: usize,
        /// Number of parts.
        of: usize,
    },
    /// The results of a study cannot be kept.
    #[error("{0}")]
    Store(String),
    /// No reference of a search completes the scenario.
    #[error(
        "no reference completes the scenario: {why}\n  = help: give more time by --budget, or \
         shorten the scenario by --set duration"
    )]
    NoReference {
        /// Reason against the last one that was tried.
        why: String,
    },
    /// The runs of the study could not be started.
    #[error("{0}")]
    Engine(String),
    /// The robot falls without a change.
    #[error(
        "the run without the change fell at {at_s:.2} s of {end_s} s\n  = help: choose an earlier \
         time by --after, or a gait that does not fall up to then"
    )]
    ReferenceFell {
        /// Time of the fall \[s\].
        at_s: f64,
        /// End of the run \[s\].
        end_s: f64,
    },
    /// The gait has too few footsteps to be studied.
    #[error(
        "{found} footsteps of leg {leg} after {after_s} s; {required} are the least\n  = help: \
         choose an earlier time by --after, fewer --steps, or a gait that keeps stepping"
    )]
    FewFootsteps {
        /// Name of the leg.
        leg: String,
        /// Time from which they are counted \[s\].
        after_s: f64,
        /// Number of footsteps.
        found: usize,
        /// Least number.
        required: usize,
    },
    /// A run of the bench cannot be built, or failed.
    #[error("{0}")]
    Run(String),
    /// Too few samples of the sensor were recorded.
    #[error("{found} samples were recorded; {required} are the least")]
    FewSamples {
        /// Number of samples.
        found: usize,
        /// Least number.
        required: usize,
    },
    /// Samples are missing between the recorded ones.
    #[error("samples are missing at {gaps} places; study a scenario without faults on the bus")]
    MissingSamples {
        /// Number of places.
        gaps: usize,
    },
    /// The force of the reference cell is beyond its range.
    #[error(
        "{samples} samples of the reference cell are out of its range; take a cam with less lift"
    )]
    ReferenceSaturated {
        /// Number of samples.
        samples: usize,
    },
    /// Too few frequencies were recorded for long enough.
    #[error(
        "frequencies that last long enough: {found}, of {required} at least; a part of a run lasts \
         from one second after a change of the frequency to the next change, and needs {periods} \
         periods"
    )]
    FewFrequencies {
        /// Number of frequencies.
        found: usize,
        /// Least number.
        required: usize,
        /// Least number of periods.
        periods: f64,
    },
    /// A filter or an identification failed.
    #[error(transparent)]
    Estimate(#[from] twinrig_estimate::EstimateError),
    /// A search failed.
    #[error(transparent)]
    Search(#[from] twinrig_campaign::search::SearchError),
}
