//! Studies of plants: how precise each of their methods is for the time it takes ([`precision`]), and how long its steps may
//! be before it is unstable or wrong ([`stability`]). A study knows plants only by [`twinrig_runtime::Plant`] and gets them
//! from a [`PlantFactory`]; what cannot be built, gives up, panics or takes too long is a row of it like any other. A third lets whole rigs
//! run, boards included, and asks what it does to them if plant and boards meet on a grid only ([`coupling()`]). Two studies of
//! one build find the same but for run times, unless a budget cuts something.
//!
//! ```
//! use twinrig_study::{PrecisionPlan, Study, StudyError, PlantFactory, precision};
//!
//! fn coarse(workshop: &dyn PlantFactory) -> Result<Study, StudyError> {
//!     let plan = PrecisionPlan { budget_s: 10.0, ..PrecisionPlan::default() };
//!     let study = precision(workshop, &plan, &mut ())?;
//!     for order in study.orders() {
//!         println!("{} {}: order {:.1}", order.plant, order.method, order.order);
//!     }
//!     Ok(study)
//! }
//! ```
//!
//! What it does not do: it reads no scenario, knows no robot and no particular plant, and writes no file. It looks at a clock
//! for run times and budgets only.

mod budget;
mod commands;
mod coupling;
mod criteria;
mod csv;
mod dominance;
#[cfg(test)]
mod dominance_tests;
mod error;
mod events;
mod factory;
mod fit;
mod floors;
mod footsteps;
mod headline;
mod html;
mod machine;
mod models;
mod number;
mod outliers;
#[cfg(test)]
mod page_tests;
mod panics;
mod plant_run;
mod precision;
mod progress;
mod reference;
mod row;
mod search;
mod shared;
mod stability;
mod stiffness;
mod stopwatch;
mod study;
mod sweep;
mod thesis;
mod trace;
mod transport;
mod trial;

pub use commands::{Commands, Tape, Tapped};
pub use coupling::{
    CouplingChoice, CouplingKind, CouplingMethod, CouplingOrder, CouplingPlan, CouplingRow,
    CouplingStudy, RigFactory, RigScene, RigVariant, coupling,
};
pub use csv::csv;
pub use dominance::{Comparison, Competitor, Dominance};
pub use error::StudyError;
pub use factory::{
    MethodOffer, MethodSetting, PlantFactory, PlantOffer, Scales, Scene, SetBy, Variant,
};
pub use floors::Floor;
pub use footsteps::{Footstep, WALK};
pub use html::html;
pub use machine::Machine;
pub use number::si as brief;
pub use precision::{PrecisionPlan, precision};
pub use progress::ProgressObserver;
pub use reference::{CheckNote, ReferenceNote};
pub use row::{CLOCKED, Line, Row, RowKind, Status};
pub use stability::{StabilityPlan, stability};
pub use stiffness::StiffnessTrend;
pub use study::{Order, Study, StudyKind};
pub use sweep::Factor;
pub use thesis::{FIGURES, Like, ThesisFigure};
pub use transport::{Cost, STROLL, Transport};
