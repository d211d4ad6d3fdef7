//! Comparison of the discontinuities of two runs and of their times.

use std::collections::BTreeMap;

use twinrig_runtime::{PlantEvent, PlantEventKind};

/// Differences between the events of a run and of its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EventErrors {
    /// Greatest time difference between corresponding events; `None` if none correspond, or if the
    /// numbers of events differ and the pairing is ambiguous \[s\].
    pub(crate) time_max_s: Option<f64>,
    /// Number of events of the run.
    pub(crate) count: usize,
    /// Number of events of the reference.
    pub(crate) expected: usize,
}

/// Compares the events of two runs, the n-th event of each part and kind with the n-th in the
/// reference. Returns `None` if neither run has events.
pub(crate) fn compare(run: &[PlantEvent], reference: &[PlantEvent]) -> Option<EventErrors> {
    if run.is_empty() && reference.is_empty() {
        return None;
    }
    let expected = by_part(reference);
    let mut time_max_s: Option<f64> = None;
    for (what, times) in by_part(run) {
        let others = expected.get(&what).map_or(&[][..], Vec::as_slice);
        for (a, b) in times.iter().zip(others) {
            let apart = (a - b).abs();
            time_max_s = Some(time_max_s.map_or(apart, |max| max.max(apart)));
        }
    }
    Some(EventErrors {
        time_max_s: time_max_s.filter(|_| run.len() == reference.len()),
        count: run.len(),
        expected: reference.len(),
    })
}

fn by_part(events: &[PlantEvent]) -> BTreeMap<(&str, PlantEventKind), Vec<f64>> {
    let mut times: BTreeMap<_, Vec<f64>> = BTreeMap::new();
    for event in events {
        let what = (event.part.as_str(), event.kind);
        times.entry(what).or_default().push(event.at_s);
    }
    times
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_paired_by_part_in_order_and_counted() {
        let event = |at_s, part: &str| PlantEvent {
            at_s,
            part: part.to_owned(),
            kind: PlantEventKind::Reached,
        };
        let reference = [event(1.0, "a"), event(2.0, "b"), event(3.0, "a")];
        let run = [event(1.25, "a"), event(2.5, "a"), event(9.0, "c")];
        let errors = compare(&run, &reference).unwrap();
        assert_eq!(errors.time_max_s, Some(0.5));
        assert_eq!((errors.count, errors.expected), (3, 3));
        assert_eq!(compare(&[], &[]), None);
    }
}
