//! Laws that hold for every driver with its devices: one call each in a `proptest!`, or all of them
//! by [`laws!`](crate::laws!).
//!
//! A [`DeviceSetup`] makes a driver and its devices ([`twinrig_wire::Node`]) anew for each run. They
//! are connected by a line in virtual time, to a plant whose outputs rise in steps of known values.
//! Between driver and line is a cable that damages bytes in both directions as a [`Case`] has it:
//! wrong bits, lost, doubled and inserted bytes, delays, foreign frames and old ones.
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
//! A [`Violation`] names the law, the instant and the values. The cases are drawn by proptest, which
//! finds a smallest one. [`config`] keeps the seeds of failures in a folder `regressions/` beside
//! the test, from which they are replayed first.
//!
//! Out of scope: collisions and damage between the devices of one bus, which
//! [`twinrig_wire::Faulty`] and [`twinrig_wire::FaultyNode`] model; the duration of a transfer.

mod cable;
mod case;
mod log;
mod probe;
mod recovery;
mod regressions;
mod resources;
mod same_course;
mod session;
mod setup;
mod stairs;
mod traffic;
mod turns;
mod values;
mod violation;

pub use case::{Case, Damage, DamageKind, Detection, cases};
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

/// Tests of a driver and its devices, one for each law: `laws!(setup())`. Of some laws only:
/// `laws!(setup(); values_were_sent, recovers)`.
///
/// The setup is a [`DeviceSetup`], made anew for each case. Two setups in one file are in modules of
/// their own.
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
