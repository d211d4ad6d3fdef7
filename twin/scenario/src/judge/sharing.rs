//! Statistics of the same samples, evaluated once for several expectations.

use std::collections::BTreeMap;

use super::meter::Meter;
use super::monitor::{Monitor, MonitorKind};
use crate::expect::Expectation;

/// Lets the first of the monitors that read the same samples evaluate the bounds of the others.
/// Returns for each monitor whether another one does.
pub(super) fn share(monitors: &mut [Monitor], expectations: &[Expectation]) -> Vec<bool> {
    let mut firsts = BTreeMap::new();
    let mut is_shared = vec![false; monitors.len()];
    for (index, expectation) in expectations.iter().enumerate() {
        let Monitor {
            window,
            channel,
            meter:
                MonitorKind::Signal(Meter::Always {
                    elements,
                    absolute,
                    limits,
                    ..
                }),
            ..
        } = &monitors[index]
        else {
            continue;
        };
        // A fall ends those claims that are of an upright robot.
        let ends_by_fall = expectation.claim.requires_upright_robot();
        let key = (
            *channel,
            window.after,
            window.before,
            *absolute,
            ends_by_fall,
            elements.clone(),
        );
        let limits = *limits;
        let first = *firsts.entry(key).or_insert(index);
        if first == index {
            continue;
        }
        if let MonitorKind::Signal(Meter::Always { others, .. }) = &mut monitors[first].meter {
            others.get_or_insert_default().push(index, &limits);
            is_shared[index] = true;
        }
    }
    for first in firsts.into_values() {
        if let MonitorKind::Signal(Meter::Always {
            others: Some(others),
            ..
        }) = &mut monitors[first].meter
        {
            others.sort();
        }
    }
    is_shared
}

/// Gives the statistics of the first monitors to those whose bounds they have evaluated.
pub(super) fn distribute(monitors: &mut [Monitor]) {
    for first in 0..monitors.len() {
        let samples = monitors[first].samples;
        let MonitorKind::Signal(Meter::Always {
            extremes, others, ..
        }) = &mut monitors[first].meter
        else {
            continue;
        };
        let (of_first, Some(others)) = (*extremes, others.take()) else {
            continue;
        };
        for (index, first_violation) in others.monitors {
            monitors[index].samples = samples;
            if let MonitorKind::Signal(Meter::Always { extremes, .. }) = &mut monitors[index].meter
            {
                *extremes = of_first;
                extremes.first_violation = first_violation;
            }
        }
    }
}
