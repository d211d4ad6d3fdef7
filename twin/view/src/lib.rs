//! Pages of runs: a self-contained HTML file with the robot in motion, its gait, its expectations,
//! its signals and its buses, over one slider of time. Two runs are side by side, aligned by their
//! footsteps.
//!
//! A recording keeps what its scenario asks for. The page shows more, since a run in virtual time
//! can be repeated: [`Run::open`] repeats it with all signals, all bytes and the expectations on
//! the way, and uses that if its fingerprint is the recorded one. Otherwise, and for runs on
//! hardware, the page has what was recorded.
//!
//! The file makes no request: data, styles and scripts are in it. Its numbers are rounded to what a
//! screen shows, which it says; exact ones are in the recording.
//!
//! # Modules
//!
//! | module | contents |
//! |---|---|
//! | `run` | a recording, repeated where that is possible |
//! | `columns`, `decimated` | numbers in a page |
//! | `figure` | poses, forces and ground over time |
//! | `gait` | footsteps and contacts |
//! | `incidents` | instants and intervals: pushes, faults, changes, events |
//! | `files` | lines of the input files in which two runs differ |
//! | `findings` | warnings, drives beside their commands |
//! | `judged` | expectations over time |
//! | `link` | links of tables to instants |
//! | `live` | poses of a run that goes on |
//! | `signals` | signals and energy balance to plot |
//! | `timing` | histograms of periods and transfers |
//! | `wires` | bytes around instants, decoded by the parts of their buses |
//! | `pair` | two runs aligned by their footsteps |
//! | `parting` | the difference by which they part, nearest to its cause |
//! | `picture` | the robot at an instant and the footsteps around, as SVG |
//! | `data`, `headline`, `sections` | data of the scripts, result, tables |
//! | `page` | the page of all of these |
//!
//! `script/` has the scripts of the page, `assets/` a library for plots, of others
//! (`docs/dependencies.md`).
//!
//! # Limits
//!
//! - Recorded runs only; it judges nothing itself.
//! - The scripts compute no physics: what they draw is in the data.

// Tests name the library as its users do.
#[cfg(test)]
extern crate self as twinrig_view;

mod columns;
mod data;
mod decimated;
mod figure;
mod files;
mod findings;
mod gait;
mod headline;
mod incidents;
mod judged;
mod link;
pub mod live;
mod page;
mod pair;
mod parting;
mod picture;
mod run;
mod sections;
mod signals;
#[cfg(test)]
mod tests;
mod timing;
mod wires;

pub use columns::packed;
pub use page::{Page, page};
pub use parting::{Parting, parting};
pub use picture::picture;
pub use run::Run;
