use twinrig_runtime::Driver;

use super::log::{Transfer, ending};
use super::session::{CLEAN, Course, Session};
use super::{Case, DeviceSetup, Violation};

const LAW: &str = "recovers";
/// Periods with damage.
const DAMAGED: usize = 8;
/// Periods until the last late byte has arrived.
const LATE: usize = 2;
/// Periods that are compared.
const COMPARED: usize = 5;

/// Checks that the driver survives damage in its transfers, and that, some periods after the last
/// damage ([`DeviceSetup::with_recovery`]), its values are those of an undisturbed run, and it
/// accepts as much and counts no further error.
///
/// # Errors
/// [`Violation`] with what differs.
pub fn recovers<D: Driver>(setup: &DeviceSetup<D>, case: &Case) -> Result<(), Violation> {
    let recovered = CLEAN + DAMAGED + LATE + setup.recovery;
    let course = Course {
        slots: recovered + COMPARED,
        ..Course::default()
    };
    let clean = Session::open(setup, LAW, course.clone()).finish()?;
    let damaged = Course {
        damages: setup.damages(case),
        damaged_slots: CLEAN..CLEAN + DAMAGED,
        ..course
    };
    let damaged = Session::open(setup, LAW, damaged).finish()?;
    if damaged.log.ended != clean.log.ended {
        let [found, expected] = [&damaged, &clean].map(|it| ending(it.log.ended.as_ref()));
        return Err(damaged.violation(format!("{found}; undisturbed, {expected}")));
    }
    let of = |transfers: &[Transfer], slot| -> Option<Transfer> {
        transfers
            .iter()
            .find(|transfer| transfer.slot == slot)
            .cloned()
    };
    for slot in recovered + 1..recovered + COMPARED {
        let [ours, theirs] = [&clean.log, &damaged.log]
            .map(|log| Some((of(&log.transfers, slot - 1)?, of(&log.transfers, slot)?)));
        match (ours, theirs) {
            (Some(ours), Some(theirs)) => compare(&ours, &theirs)?,
            (None, _) => {}
            (Some((_, ours)), None) => {
                let what = format!("it has no transfer in period {slot}");
                return Err(Violation::new(LAW, ours.at, what));
            }
        }
    }
    Ok(())
}

/// Compares two transfers in a row with those of an undisturbed run.
fn compare(ours: &(Transfer, Transfer), theirs: &(Transfer, Transfer)) -> Result<(), Violation> {
    let at = theirs.1.at;
    let bits = |values: &[f64]| values.iter().map(|it| it.to_bits()).collect::<Vec<_>>();
    let (expected, found) = (&ours.1.values, &theirs.1.values);
    if bits(expected) != bits(found) {
        let what = format!("values {found:?} instead of {expected:?}");
        return Err(Violation::new(LAW, at, what));
    }
    let change = |(before, after): &(Transfer, Transfer)| {
        let (before, after) = (before.traffic, after.traffic);
        [
            after.accepted - before.accepted,
            after.missing - before.missing,
            after.discarded - before.discarded,
        ]
    };
    let (expected, found) = (change(ours), change(theirs));
    if expected == found {
        return Ok(());
    }
    let what = format!(
        "in a period {found:?} frames are accepted, missing and discarded instead of {expected:?}"
    );
    Err(Violation::new(LAW, at, what))
}
