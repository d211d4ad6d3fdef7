//! All studies: the one list of them.

use clap::Subcommand;

use crate::coupling::CouplingOptions;
use crate::estimate::EstimateOptions;
use crate::feedback::FeedbackOptions;
use crate::gait_map::GaitMapOptions;
use crate::modulation::ModulationOptions;
use crate::options::request::StudyRequest;
use crate::plants::options::{PrecisionOptions, StabilityOptions};
use crate::radius::options::RadiusOptions;
use crate::robustness::options::RobustnessOptions;
use crate::timing::TimingOptions;
use crate::transition::TransitionOptions;

/// Declares the subcommands of `twin study`. The text of `--help` is that of the options.
macro_rules! studies {
    ($($study:ident: $options:ty),* $(,)?) => {
        /// Kind of study.
        #[derive(Clone, Debug, Subcommand)]
        #[expect(missing_docs, reason = "the options have the text of each study")]
        pub enum StudyCommand {
            $($study($options),)*
        }

        impl StudyCommand {
            /// Returns the options, which can do the study.
            pub fn request(&self) -> &dyn StudyRequest {
                match self {
                    $(Self::$study(options) => options,)*
                }
            }
        }
    };
}

studies! {
    Precision: PrecisionOptions,
    Stability: StabilityOptions,
    Coupling: CouplingOptions,
    Estimate: EstimateOptions,
    Modulation: ModulationOptions,
    Transition: TransitionOptions,
    Loads: FeedbackOptions,
    Gait: GaitMapOptions,
    Radius: RadiusOptions,
    Robustness: RobustnessOptions,
    Timing: TimingOptions,
}
