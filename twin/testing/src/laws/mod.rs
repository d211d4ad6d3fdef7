//! Laws that hold for every driver with its devices: one call each in a `proptest!`, or all of them
//! by [`laws!`](crate::laws!).
//!
//! A [`DeviceSetup`] makes a driver and its devices ([`twinrig_wire::Node`]) anew for each run.
//! They are connected by a line in virtual time, to a plant whose outputs rise in steps of known
//! values. Between driver and line is a cable that damages bytes in both directions as a [`Case`]
//! has it: wrong bits, lost, doubled and inserted bytes, delays, foreign frames and old ones.
//!
//! | law | |
//! |---|---|
//! | [`values_were_sent`] | no value is accepted that was not sent, and none older than the last |
//! | [`traffic_adds_up`] | nothing is lost, doubled or made up beyond the counters |
//! | [`cuts_change_nothing`] | the pieces in which a stream is received have no effect |
//! | [`looks_change_nothing`] | calls more often than necessary have no effect |
//! | [`restores_in_mid_frame`] | a state saved anywhere continues as the original does |
//! | [`recovers`] | some periods after the last damage everything is as if it had never been |
//! | [`queues_stay_bounded`] | neither states nor transmissions grow under a flood |
//! | [`meets_the_deadline`] | opening, transfers and closing end, whatever is on the line |
//!
//! ```
//! use serde::{Deserialize, Serialize};
//! use std::ops::Range;
//! use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
//! use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, WiringError};
//! use twinrig_testing::laws::{self, DeviceSetup};
//! use twinrig_wire::{
//!     Emulation, FrameCounts, FrameError, FrameFormat, FrameMatch, FrameOutcome, FramedDriver,
//!     FramedMessage, FramedNode, Pacing, Protocol, RequestKind, TrafficError, TxQueue, crc16,
//! };
//!
//! const PERIOD: SimDuration = SimDuration::from_millis(10);
//! const FORMAT: FrameFormat = FrameFormat {
//!     length: |front| match front {
//!         [] => FrameMatch::Missing(6),
//!         [0xa5, ..] => FrameMatch::Frame(6),
//!         _ => FrameMatch::Garbage,
//!     },
//!     checksum: |content| crc16(content).to_le_bytes(),
//! };
//!
//! /// A request, or the answer with the same number: a distance in millimetres.
//! struct Frame(u8, u16);
//! impl FramedMessage for Frame {
//!     fn match_frame(front: &[u8]) -> FrameMatch { FORMAT.match_frame(front) }
//!     fn decode(frame: &[u8]) -> Result<Self, FrameError> {
//!         let &[_, number, high, low] = FORMAT.content(frame)? else {
//!             return Err(FrameError::Length);
//!         };
//!         Ok(Self(number, u16::from_be_bytes([high, low])))
//!     }
//!     fn encode(&self, bytes: &mut Vec<u8>) {
//!         let [high, low] = self.1.to_be_bytes();
//!         FORMAT.encode(bytes, |bytes| bytes.extend([0xa5, self.0, high, low]));
//!     }
//! }
//!
//! struct Ranger;
//! #[derive(Default, Serialize, Deserialize)]
//! struct State { number: u8, metres: [f64; 1], answers: u64, lost: u64 }
//! impl Protocol for Ranger {
//!     type State = State;
//!     type Message = Frame;
//!     fn initial(&self) -> State { State::default() }
//!     fn name(&self) -> &str { "ranger" }
//!     fn ports(&self) -> Vec<Port> { vec![Port::output("ranger/distance", Unit::Meter, 1)] }
//!     fn request(
//!         &self, state: &mut State, _: RequestKind, _: &[f64], request: &mut Vec<u8>,
//!     ) -> Option<SimDuration> {
//!         state.number = state.number.wrapping_add(1);
//!         Frame(state.number, 0).encode(request);
//!         Some(SimDuration::from_millis(5))
//!     }
//!     fn handle_message(
//!         &self, state: &mut State, kind: Option<RequestKind>, answer: Frame,
//!     ) -> FrameOutcome {
//!         if kind.is_none() || answer.0 != state.number {
//!             return FrameOutcome::Incomplete;
//!         }
//!         state.answers += 1;
//!         state.metres = [f64::from(answer.1) / 1e3];
//!         FrameOutcome::Complete
//!     }
//!     fn time_out(&self, state: &mut State, _: RequestKind) { state.lost += 1; }
//!     fn open_failure(&self, _: &State) -> String { "no answer: check the cable".to_owned() }
//!     fn to_process<'s>(&self, state: &'s State) -> &'s [f64] { &state.metres }
//!     fn pacing(&self) -> Option<Pacing> { Some(Pacing::Requests(PERIOD)) }
//!     fn counts(&self, state: &State) -> FrameCounts {
//!         FrameCounts::new(state.answers, &[(TrafficError::NoAnswer, state.lost)])
//!     }
//! }
//!
//! #[derive(Default)]
//! struct Sensor(Range<usize>);
//! impl Emulation for Sensor {
//!     type State = ();
//!     type Message = Frame;
//!     fn initial(&self) {}
//!     fn name(&self) -> &str { "ranger" }
//!     fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
//!         self.0 = plant.find(owner, &Port::input("distance", Unit::Meter, 1))?;
//!         Ok(())
//!     }
//!     fn handle_message(
//!         &self, _: &mut (), now: SimTime, request: Frame, plant: &mut dyn PlantAccess,
//!         tx: &mut TxQueue,
//!     ) -> Result<(), TaskError> {
//!         let metres = plant.sample(self.0.clone())?[0];
//!         tx.send(now, &Frame(request.0, (metres * 1e3).round() as u16));
//!         Ok(())
//!     }
//! }
//!
//! fn setup() -> DeviceSetup<FramedDriver<Ranger>> {
//!     DeviceSetup::new(
//!         SimDuration::from_micros(87),
//!         vec![Port::output("distance", Unit::Meter, 1)],
//!         || FramedDriver::new(Ranger),
//!         || vec![Box::new(FramedNode::new(Sensor::default()))],
//!     )
//!     .with_deadline(SimDuration::from_millis(15))
//!     .with_transfer_deadline(SimDuration::from_millis(5))
//!     .with_numbered_answers()
//! }
//!
//! // In a test: `twinrig_testing::laws!(setup());`, or some of them by their names.
//! # use twinrig_testing::laws::proptest::{prelude::*, proptest};
//! # let config = || ProptestConfig { failure_persistence: None, ..laws::config() };
//! proptest!(config(), |(case in laws::cases())| {
//!     laws::values_were_sent(&setup(), &case)?;
//!     laws::traffic_adds_up(&setup(), &case)?;
//!     laws::recovers(&setup(), &case)?;
//!     laws::meets_the_deadline(&setup(), &case)?;
//! });
//! ```
//!
//! A [`Violation`] names the law, the instant and the values. The cases are drawn by proptest,
//! which finds a smallest one. [`config`] keeps the seeds of failures in a folder `regressions/`
//! beside the test, from which they are replayed first.
//!
//! Out of scope: collisions and damage between the devices of one bus, which
//! [`twinrig_wire::Faulty`] and [`twinrig_wire::FaultyNode`] model; the duration of a transfer.

mod cable;
mod case;
mod case_ranges;
mod damage;
mod inserted_frame;
mod log;
mod probe;
mod recovery;
mod regressions;
mod resources;
mod same_course;
mod session;
mod setup;
mod stairs;
#[cfg(test)]
mod tests;
mod traffic;
mod turns;
mod values;
mod violation;

use twinrig_runtime::Driver;

pub use case::{Case, cases};
pub use case_ranges::{CASE_RANGES, CaseRanges, DrawnKind, ListRanges};
pub use damage::{Damage, DamageKind, Detection};
pub use recovery::recovers;
pub use regressions::config;
pub use resources::{meets_the_deadline, queues_stay_bounded};
pub use same_course::{cuts_change_nothing, looks_change_nothing, restores_in_mid_frame};
pub use setup::{DeviceSetup, Nodes, Traffic};
pub use traffic::traffic_adds_up;
pub use values::values_were_sent;
pub use violation::Violation;

#[doc(hidden)]
pub use proptest;

/// A law.
pub type Law<D> = fn(&DeviceSetup<D>, &Case) -> Result<(), Violation>;

/// Returns all laws with their names.
pub fn all<D: Driver>() -> [(&'static str, Law<D>); 8] {
    [
        ("values_were_sent", values_were_sent),
        ("traffic_adds_up", traffic_adds_up),
        ("cuts_change_nothing", cuts_change_nothing),
        ("looks_change_nothing", looks_change_nothing),
        ("restores_in_mid_frame", restores_in_mid_frame),
        ("recovers", recovers),
        ("queues_stay_bounded", queues_stay_bounded),
        ("meets_the_deadline", meets_the_deadline),
    ]
}

/// Tests of a driver and its devices, one for each law: `laws!(setup())`. Of some laws only:
/// `laws!(setup(); values_were_sent, recovers)`.
///
/// The setup is a [`DeviceSetup`], made anew for each case. Two setups in one file are in modules
/// of their own.
#[macro_export]
macro_rules! laws {
    ($setup:expr) => {
        $crate::laws!(
            $setup;
            values_were_sent, traffic_adds_up, cuts_change_nothing, looks_change_nothing,
            restores_in_mid_frame, recovers, queues_stay_bounded, meets_the_deadline
        );
    };
    ($setup:expr; $($law:ident),*) => {
        $crate::laws::proptest::proptest! {
            #![proptest_config($crate::laws::config())]
            $(
                #[test]
                fn $law(case in $crate::laws::cases()) {
                    $crate::laws::$law(&$setup, &case)?;
                }
            )*
        }
    };
}
