use twinrig_runtime::Driver;

use super::session::{CLEAN, Course, Session};
use super::{Case, DeviceSetup, Violation};

const LAW: &str = "values_were_sent";
/// Six levels, and one more without damage, which a late request may still find.
const SLOTS: usize = 18;
const CLEAN_SLOTS: usize = 21;

/// Checks that the driver reports no value that no device has sent, and none that is older than the
/// last one, whatever happens to the bytes in both directions.
///
/// The values that are sent are those of an undisturbed run.
///
/// # Errors
/// [`Violation`] with the value.
///
/// # Panics
/// If the setup is not suitable: the undisturbed run fails, or its values do not tell the levels
/// apart.
pub fn values_were_sent<D: Driver>(setup: &DeviceSetup<D>, case: &Case) -> Result<(), Violation> {
    let clean = Course {
        slots: CLEAN_SLOTS,
        ..Course::default()
    };
    let clean = Session::open(setup, LAW, clean).finish()?;
    let sent = values_in_order(&clean);
    let damaged = Course {
        slots: SLOTS,
        damages: setup.damages(case),
        damaged_slots: CLEAN..SLOTS,
        ..Course::default()
    };
    let damaged = Session::open(setup, LAW, damaged).finish()?;
    let mut newest = vec![0; sent.len()];
    for transfer in &damaged.log.transfers {
        for (component, value) in transfer.values.iter().enumerate() {
            let sent = &sent[component];
            let fail = |what: &str| {
                let what = format!("output {component} has the value {value}, {what}");
                Err(Violation::new(LAW, transfer.at, what))
            };
            match sent.iter().position(|bits| *bits == value.to_bits()) {
                None => return fail("which was never sent"),
                Some(place) if place < newest[component] => {
                    let before = f64::from_bits(sent[newest[component]]);
                    return fail(&format!("which was sent before {before}, its last value"));
                }
                Some(place) => newest[component] = place,
            }
        }
    }
    Ok(())
}

/// Returns the distinct values of each output, in the order of their first appearance.
fn values_in_order<D: Driver>(clean: &Session<'_, D>) -> Vec<Vec<u64>> {
    let log = &clean.log;
    assert_eq!(
        log.ended.as_ref().map(|(_, end)| end),
        Some(&Ok(())),
        "the undisturbed run fails"
    );
    let first = log.first_values.iter().map(|(_, values)| values);
    let all = first.chain(log.transfers.iter().map(|transfer| &transfer.values));
    let mut sent: Vec<Vec<u64>> = vec![Vec::new(); clean.driver.to_process().len()];
    for values in all {
        for (known, value) in sent.iter_mut().zip(values) {
            if !known.contains(&value.to_bits()) {
                known.push(value.to_bits());
            }
        }
    }
    assert!(
        sent.is_empty() || sent.iter().any(|values| values.len() > 3),
        "the driver reports one value at several levels of the plant: choose other levels"
    );
    sent
}
