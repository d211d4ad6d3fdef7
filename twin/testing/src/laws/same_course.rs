use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Driver;

use super::log::Mark;
use super::session::{Course, Session};
use super::turns::Turns;
use super::{Case, DeviceSetup, Violation};

const SLOTS: usize = 8;

/// Returns the course with the damage of a case, from the opening or the first transfer to the end
/// of closing: some drivers fail to open with much damage, and end.
fn damaged<D: Driver>(setup: &DeviceSetup<D>, case: &Case) -> Course {
    Course {
        slots: SLOTS,
        damages: setup.damages(case),
        damaged_slots: usize::from(!case.saved.is_multiple_of(4))..SLOTS + 1,
        ..Course::default()
    }
}

/// Checks that the same bytes at the same instants have the same effect in pieces of any lengths,
/// in the driver and in the devices: whole transmissions, and parts of them. What the driver writes
/// is read after all pieces of an instant.
///
/// # Errors
/// [`Violation`] with the first difference.
pub fn cuts_change_nothing<D: Driver>(
    setup: &DeviceSetup<D>,
    case: &Case,
) -> Result<(), Violation> {
    const LAW: &str = "cuts_change_nothing";
    let course = damaged(setup, case);
    let whole = Course {
        gathers: true,
        ..course.clone()
    };
    let whole = Session::open(setup, LAW, whole).finish()?;
    let lengths = case.pieces.iter().map(|length| u64::from(*length));
    let cut = Course {
        pieces: Some(Turns::new(lengths)),
        reads: Some(whole.log.reads.clone()),
        ..course
    };
    let cut = Session::open(setup, LAW, cut).finish()?;
    whole.log.compare(LAW, &cut.log, <(Mark, Mark)>::default())
}

/// Checks that it has no effect to look more often: to call [`Driver::handle_timeout`] before it is
/// due, to ask driver and devices for anything, to save their state, and to advance the devices at
/// further instants.
///
/// # Errors
/// [`Violation`] with the first difference.
pub fn looks_change_nothing<D: Driver>(
    setup: &DeviceSetup<D>,
    case: &Case,
) -> Result<(), Violation> {
    const LAW: &str = "looks_change_nothing";
    let course = damaged(setup, case);
    let seldom = Session::open(setup, LAW, course.clone()).finish()?;
    let permille = setup.period.as_nanos() / 1000;
    let times = case.looks.iter().map(|it| u64::from(*it) * permille + 1);
    let often = Course {
        looks: Some(Turns::new(times)),
        reads: Some(seldom.log.reads.clone()),
        ..course
    };
    let often = Session::open(setup, LAW, often).finish()?;
    seldom
        .log
        .compare(LAW, &often.log, <(Mark, Mark)>::default())
}

/// Checks that driver and devices, made anew and restored from states that were saved within a
/// transmission, go on with the same bytes, times, values and diagnostics.
///
/// # Errors
/// [`Violation`] with the first difference.
pub fn restores_in_mid_frame<D: Driver>(
    setup: &DeviceSetup<D>,
    case: &Case,
) -> Result<(), Violation> {
    const LAW: &str = "restores_in_mid_frame";
    let course = damaged(setup, case);
    let whole = Session::open(setup, LAW, course.clone()).finish()?;
    let Some(at) = instant_within_a_transmission(&whole, case, setup.byte_time) else {
        return Ok(());
    };
    let mut saved = Session::open(setup, LAW, course);
    saved.run_until(at)?;
    let restored = saved.restored()?;
    let mark = saved.log.mark();
    let bits = |values: &[f64]| values.iter().map(|it| it.to_bits()).collect::<Vec<_>>();
    let [ours, theirs] = [&saved, &restored].map(|session| session.driver.to_process());
    if bits(ours) != bits(theirs) {
        let what = format!("values {theirs:?} instead of {ours:?} right after restoring");
        return Err(restored.violation(what));
    }
    let (saved, restored) = (saved.finish()?, restored.finish()?);
    saved.log.compare(LAW, &restored.log, (mark, mark))
}

fn instant_within_a_transmission<D: Driver>(
    session: &Session<'_, D>,
    case: &Case,
    byte_time: SimDuration,
) -> Option<SimTime> {
    let transmissions = session.tap.transmissions();
    let received = transmissions.iter().map(|it| (it.start, it.bytes.len()));
    let written = session.log.written.iter();
    let written = written.map(|(at, bytes)| (*at, bytes.len()));
    let mut all: Vec<_> = received.chain(written).collect();
    all.sort_unstable();
    let (start, length) = all[usize::from(case.saved).checked_rem(all.len())?];
    let length = byte_time * length as u64;
    let into = length.as_nanos() * u64::from(case.saved_at) / 1000;
    Some(start + SimDuration::from_nanos(into))
}
