//! A run that is watched and steered. A [`Session`] advances a rig in virtual time, seeks to any
//! earlier instant, and changes process variables on the way. A change in the past of a run begins
//! a [`Branch`], which the session writes as a scenario with a `[[change]]` for each act: `twin
//! run` of that file is the same run, bit for bit.
//!
//! ```
//! use twinrig_kernel::SimTime;
//! use twinrig_live::{Session, SNAPSHOT_BYTES};
//! use twinrig_rig::{Assembly, Registry};
//!
//! let registry = Registry::standard();
//! let text = "robot = 'cheetah-cub'\nduration = '0.2 s'\nplant = { model = 'massless' }\n\
//!             controller = { kind = 'stand', period = '2 ms' }";
//! let assembly = Assembly::builder(&registry).text("stand.toml", text, "".as_ref())?;
//! let mut session = Session::new(&assembly, SNAPSHOT_BYTES)?;
//! session.advance(SimTime::from_nanos(150_000_000), &mut ());
//! session.seek(SimTime::from_nanos(100_000_000), &mut ())?;
//! session.set("hip_height/fore", 0.13, None)?;
//! session.advance(assembly.end(), &mut ());
//! assert_eq!(session.branches().len(), 2);
//! assert!(session.text_of(1, "".as_ref())?.contains("[[change]]"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Modules
//!
//! | module | contents |
//! |---|---|
//! | `session` | time travel and changes of a rig |
//! | `snapshots` | saved states with a limit in memory |
//! | `branch` | the changes of a run, and its scenario |
//! | `watch` | fingerprint, judge and events on the way |
//! | `futures` | two branches, footstep by footstep |
//! | `sets` | named sets of values |
//! | `request` | requests of visitors |
//! | `live_run` | a run as visitors see it, in virtual time or on hardware |
//! | `tuning` | process variables that visitors set, save and recall |
//! | `control` | requests carried out in virtual time |
//! | `hardware` | requests carried out on hardware: variables alone |
//! | `files` | names of scenarios and recordings |
//! | `server` | visitors by WebSocket, and a page (feature `server`) |
//!
//! # Limits
//!
//! - A session reads no clock: who calls it decides how fast time passes. On hardware time goes on,
//!   and there is no past.
//! - A plant that does not save its state is advanced and changed, and has no past.

mod branch;
pub mod control;
mod error;
mod files;
mod futures;
pub mod hardware;
mod live_run;
pub mod request;
#[cfg(feature = "server")]
pub mod server;
mod session;
mod sets;
mod snapshots;
mod tuning;
mod watch;

pub use branch::{Act, Branch};
pub use error::LiveError;
pub use futures::{FootstepPair, Futures};
pub use session::{Ended, Session};
pub use snapshots::{Reach, SNAPSHOT_BYTES};
pub use watch::{Event, EventKind};
