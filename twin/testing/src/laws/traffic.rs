use std::collections::BTreeMap;

use twinrig_kernel::SimTime;
use twinrig_runtime::Driver;

use super::log::ending;
use super::session::{CLEAN, Course, Session};
use super::{Case, DeviceSetup, Traffic, Violation};

const LAW: &str = "traffic_adds_up";
/// Periods with damage, and after it.
const DAMAGED: usize = 10;
const AFTER: usize = 4;

/// Checks that nothing is lost, doubled or made up beyond the counters of the driver:
///
/// - on an undisturbed line it accepts every transmission of the devices, and counts no error;
/// - it never accepts more transmissions than have arrived intact;
/// - it counts an error for each one that it has not accepted;
/// - it counts something as discarded if a byte arrived with a wrong bit.
///
/// # Errors
/// [`Violation`] with the numbers.
pub fn traffic_adds_up<D: Driver>(setup: &DeviceSetup<D>, case: &Case) -> Result<(), Violation> {
    let course = Course {
        slots: CLEAN + DAMAGED + AFTER,
        ..Course::default()
    };
    let clean = Session::open(setup, LAW, course.clone()).finish()?;
    check_clean(&clean)?;
    let damaged = Course {
        damages: setup.damages(case),
        damaged_slots: CLEAN..CLEAN + DAMAGED,
        ..course
    };
    check_damaged(&Session::open(setup, LAW, damaged).finish()?)
}

/// Returns the transmissions of the devices after the first `from` bytes, of which `is_included`
/// holds: by their start and the number of bytes up to their end.
fn transmissions<D: Driver>(
    session: &Session<'_, D>,
    from: u64,
    is_included: impl Fn(SimTime, u64) -> bool,
) -> Vec<Vec<u8>> {
    let (mut end, mut found) = (0, Vec::new());
    for transmission in session.tap.transmissions().iter() {
        let start = end;
        end += transmission.bytes.len() as u64;
        if start >= from && is_included(transmission.start, end) {
            found.push(transmission.bytes.clone());
        }
    }
    found
}

/// Returns the number of those transmissions whose bytes are in a stream.
fn intact(transmissions: &[Vec<u8>], stream: &[u8]) -> u64 {
    let mut counts: BTreeMap<&[u8], u64> = BTreeMap::new();
    for transmission in transmissions {
        *counts.entry(transmission).or_default() += 1;
    }
    let found = |(bytes, count): (&[u8], u64)| {
        let found = stream
            .windows(bytes.len())
            .filter(|window| *window == bytes);
        count.min(found.count() as u64)
    };
    counts.into_iter().map(found).sum()
}

fn since(opened: Traffic, now: Traffic) -> Traffic {
    Traffic {
        accepted: now.accepted - opened.accepted,
        missing: now.missing - opened.missing,
        discarded: now.discarded - opened.discarded,
    }
}

fn check_clean<D: Driver>(session: &Session<'_, D>) -> Result<(), Violation> {
    let Some((from, opened)) = session.log.opened else {
        let ended = ending(session.log.ended.as_ref());
        return Err(session.violation(format!("on an undisturbed line, {ended}")));
    };
    for transfer in &session.log.transfers {
        let found = since(opened, transfer.traffic);
        let arrived = |_, end| end <= transfer.received;
        let expected = Traffic {
            accepted: transmissions(session, from, arrived).len() as u64,
            ..Traffic::default()
        };
        if found != expected {
            let what = format!("on an undisturbed line {found:?} instead of {expected:?}");
            return Err(Violation::new(LAW, transfer.at, what));
        }
    }
    Ok(())
}

fn check_damaged<D: Driver>(session: &Session<'_, D>) -> Result<(), Violation> {
    let last = session.log.transfers.last();
    let (Some((from, opened)), Some(last)) = (session.log.opened, last) else {
        return Ok(());
    };
    let found = since(opened, last.traffic);
    let arrived = transmissions(session, from, |_, end| end <= last.received).len() as u64;
    // Of transmissions that collide, a part arrives, so that numbers of bytes are no measure.
    let begun = transmissions(session, from, |start, _| start <= last.at);
    let intact = intact(&begun, &session.to_driver.passed);
    let fail = |what: String| Err(Violation::new(LAW, last.at, format!("{what}: {found:?}")));
    if found.accepted > intact {
        return fail(format!("only {intact} transmissions have arrived intact"));
    }
    if arrived.saturating_sub(found.accepted) > found.missing + found.discarded {
        return fail(format!(
            "{arrived} transmissions have arrived in whole or in part"
        ));
    }
    let wrong = session.to_driver.wrong;
    if wrong > 0 && found.discarded == 0 {
        return fail(format!("{wrong} bytes have arrived with wrong bits"));
    }
    Ok(())
}
