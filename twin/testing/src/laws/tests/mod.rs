//! The laws of a driver and its board: a sound one passes by them, and each planted flaw is found.

mod kept;
mod toy;

use crate::laws::{self, DeviceSetup, Law, Traffic, Violation};
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;
use twinrig_kernel::SimDuration;

use toy::{ToyBoard, ToyDriver, ToyEmulation};

/// A flaw of a driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Flaw {
    IgnoresChecksum,
    AcceptsOtherAddresses,
    AcceptsOldAnswers,
    AcceptsDoubledAnswers,
    CountsTimeOutsAsAnswers,
    DoesNotCountTimeOuts,
    DoesNotCountDamage,
    LosesBytesBetweenPieces,
    CountsLooksAsTimeOuts,
    DoesNotSavePartialFrame,
    DoesNotSaveNumber,
    DoesNotSaveTimeOut,
    NeverResynchronises,
    KeepsAllFrames,
    TimeOutStaysDue,
    NoTimeOut,
    BytesPostponeTimeOut,
}

fn setup(flaw: Option<Flaw>) -> DeviceSetup<ToyDriver> {
    let driver = move || ToyDriver::new(flaw);
    let board = || vec![Box::new(ToyBoard::new(ToyEmulation::default())) as _];
    DeviceSetup::new(
        SimDuration::from_micros(87),
        toy::plant_ports(),
        driver,
        board,
    )
    .with_commands(|transfer, _| 0.001 * transfer as f64)
    .with_period(SimDuration::from_millis(10))
    .with_recovery(1)
    .with_deadline(SimDuration::from_millis(9))
    .with_numbered_answers()
    .with_foreign_frames(toy::foreign_answers())
    .with_traffic(|driver, _| {
        Traffic::of_diagnostics(driver, [&["accepted"], &["missing"], &["discarded"]])
    })
}

/// Returns the first violation of a law in some cases.
fn first_violation(law: Law<ToyDriver>, flaw: Option<Flaw>, cases: u32) -> Option<Violation> {
    let setup = setup(flaw);
    let mut runner = TestRunner::deterministic();
    (0..cases).find_map(|_| {
        let case = laws::cases().new_tree(&mut runner).unwrap();
        law(&setup, &case.current()).err()
    })
}

mod a_sound_driver {
    crate::laws!(super::setup(None));
}

#[test]
fn each_flaw_is_found_by_its_law() {
    use Flaw as F;
    let expected = [
        (F::IgnoresChecksum, "values_were_sent"),
        (F::AcceptsOtherAddresses, "values_were_sent"),
        (F::AcceptsOldAnswers, "values_were_sent"),
        (F::AcceptsDoubledAnswers, "traffic_adds_up"),
        (F::CountsTimeOutsAsAnswers, "traffic_adds_up"),
        (F::DoesNotCountTimeOuts, "traffic_adds_up"),
        (F::DoesNotCountDamage, "traffic_adds_up"),
        (F::LosesBytesBetweenPieces, "cuts_change_nothing"),
        (F::CountsLooksAsTimeOuts, "looks_change_nothing"),
        (F::DoesNotSavePartialFrame, "restores_in_mid_frame"),
        (F::DoesNotSaveNumber, "restores_in_mid_frame"),
        (F::DoesNotSaveTimeOut, "restores_in_mid_frame"),
        (F::NeverResynchronises, "recovers"),
        (F::KeepsAllFrames, "queues_stay_bounded"),
        (F::TimeOutStaysDue, "queues_stay_bounded"),
        (F::NoTimeOut, "meets_the_deadline"),
        (F::BytesPostponeTimeOut, "meets_the_deadline"),
    ];
    for (flaw, name) in expected {
        let mut laws = laws::all().into_iter();
        let (_, law) = laws.find(|(law, _)| *law == name).unwrap();
        let found = first_violation(law, Some(flaw), 64);
        let found = found.unwrap_or_else(|| panic!("{name} does not find {flaw:?}"));
        assert_eq!(found.law, name, "{flaw:?}: {found}");
    }
}
