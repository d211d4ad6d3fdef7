//! Studies of plants: precision, the error of each method against its run time, and stability, the
//! largest stable and accurate step of each method.

pub(crate) mod builder;
pub(crate) mod commands;
pub(crate) mod contact;
mod criteria;
mod differences;
pub(crate) mod dominance;
#[cfg(test)]
pub(crate) mod dominance_tests;
pub(crate) mod ensemble;
pub(crate) mod ensemble_difference;
pub(crate) mod error_control;
mod events;
pub(crate) mod factor;
pub(crate) mod factory;
pub(crate) mod floors;
pub(crate) mod footsteps;
mod frame;
mod headline;
mod models;
pub(crate) mod options;
mod outliers;
#[cfg(test)]
mod page_tests;
mod plant_run;
pub(crate) mod precision;
mod precision_job;
pub(crate) mod precision_plan;
mod reference;
pub(crate) mod reference_note;
mod references;
pub(crate) mod row;
pub(crate) mod scaled;
mod search;
pub(crate) mod selection;
pub(crate) mod stability;
mod stability_job;
pub(crate) mod stability_plan;
mod stencil;
pub(crate) mod stiffness;
pub(crate) mod study;
pub(crate) mod thesis;
pub(crate) mod tolerance;
pub(crate) mod trace;
pub(crate) mod transport;
mod trial;
pub(crate) mod view;
