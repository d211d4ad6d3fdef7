//! Acquisition of the tactile bench: a board with the two cards of the thesis, for two amplifier
//! voltages (16 bits, ±10 V) and the bridge of a reference cell (24 bits), at 1 kHz. The driver
//! maps the stamps of the board's clock to host time and passes every sample to the stages mounted
//! in it ([`Stage`]: a filter); an emulated board samples signals of the plant, with the noise, the
//! resolution, the range and the clock of a real one.
//!
//! The board sends without requests. A transfer returns the newest sample without waiting, unless
//! it is configured to wait for a fresh one ([`SampleChoice`]).
//!
//! ```
//! use twinrig_kernel::{BoardClock, LocalDuration};
//! use twinrig_tactile::Tactile;
//!
//! let mut bench = Tactile::new("tactile", "bench/force");
//! bench.zero = true;
//! bench.clock = BoardClock::new(LocalDuration::ZERO, 30_000)?; // + 30 ppm
//!
//! let driver = bench.driver()?; // host side of the wire
//! let node = bench.board()?; // device side
//! # let _ = (driver, node);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **Outputs**, below the signal of the measured force: `piezoresistive` \[V\], `piezoelectric`
//! \[V\], `reference` \[N\]; then those of the stages.
//!
//! **Diagnostics** of the driver:
//! - the outputs of the stages, and what these report;
//! - `samples`; `lost`: missing by their sequence; `stale`: repeated or late, and transfers without
//!   a fresh sample; `foreign`: messages of the other direction; `garbage`: bytes outside frames,
//!   those of damaged frames included;
//! - `restarts` of the board; `started_again`: commands to a silent board; `overruns`: samples
//!   before which the board dropped others;
//! - `saturated/piezoresistive`, `…/piezoelectric`, `…/reference`: samples out of range, the last
//!   one also beyond the nominal force of the cell;
//! - of the newest sample `clock/offset`: host time less board time \[s\]; `clock/rate`: relative
//!   error of the board's clock; `clock/residual`: delay beyond the least \[s\].
//!
//! Of the emulated board: `sent`; `overflows`: samples that it dropped; `clock_error` and
//! `clock_error_worst`: mapped less true time \[s\], reported once a second (in lockstep, where
//! simulated time is that of the host).
//!
//! **Limits.**
//! - The cards have no serial protocol: the frames are ASSUMED ([`protocol`]).
//! - *Mapped times* are later than the true ones by the smallest delay within 8 s that the driver
//!   does not know: a USB converter's, a scheduler's. On hardware with [`SampleChoice::Newest`],
//!   bytes are read at transfers only, so that the smallest delay can be as long as the control
//!   period; with [`SampleChoice::Fresh`] they are read when they arrive. Clocks that deviate by
//!   more than 0.1 % are not followed.
//! - *Aliasing.* The anti-aliasing filter of the cards is replaced by the mean of 1, 2 or 4
//!   conversions per sample. One: nothing is attenuated. Two and four at 1 kHz: a tone at 900 Hz
//!   appears at 100 Hz with 16 % and 12 % of its amplitude, one at 600 Hz at 400 Hz with 59 % and
//!   52 %; multiples of 1 kHz are removed, except those of 2 and 4 kHz.
//! - *Noise* is white and Gaussian; no drift, no cross-talk, no delay between channels. The zero is
//!   that of one sample, with its noise; the board keeps it at a reset (ASSUMED).
//! - *Reset:* frames that wait for the line at a reset are still sent.

mod acquisition;
mod assumed;
mod board;
mod clock_map;
mod config;
mod driver;
mod load_filter;
mod newest_sample;
pub mod protocol;
mod stage;

pub use acquisition::TactileAcquisition;
pub use board::{TactileBoard, TactileEmulation};
pub use clock_map::ClockMap;
pub use config::{CHANNELS, ReferenceCell, Tactile, TactileError, Unplugged};
pub use driver::TactileDriver;
pub use load_filter::{LoadFilter, LoadFilterConfig};
pub use stage::{Stage, TactileSample};
pub use twinrig_wire::{AnalogInput, SampleChoice};
