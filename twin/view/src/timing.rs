//! Histograms of the timing: period and computing time of the controller, duration of transfers.

use serde::Serialize;
use twinrig_kernel::SimTime;
use twinrig_record::{Recording, group_name};
use twinrig_runtime::Group;

/// Histogram of durations.
#[derive(Debug, PartialEq, Serialize)]
pub(crate) struct Histogram {
    title: String,
    /// Lower edge of the first bin, and width of a bin \[s\].
    from: f64,
    width: f64,
    counts: Vec<u64>,
    /// Least, median and greatest duration \[s\].
    least: f64,
    median: f64,
    greatest: f64,
}

/// Greatest number of bins.
const BINS: usize = 60;

impl Histogram {
    /// Returns the histogram of durations \[ns\]; none of fewer than two.
    fn of(title: &str, mut durations: Vec<u64>) -> Option<Self> {
        durations.sort_unstable();
        let (&least, &greatest) = (durations.first()?, durations.last()?);
        if durations.len() < 2 {
            return None;
        }
        // One bin of a microsecond if all are equal.
        let width = ((greatest - least) / BINS as u64 + 1).max(1000);
        let bin = |nanos: u64| usize::try_from((nanos - least) / width).unwrap_or(BINS);
        let mut counts = vec![0; bin(greatest) + 1];
        for &nanos in &durations {
            counts[bin(nanos)] += 1;
        }
        let seconds = |nanos: u64| nanos as f64 * 1e-9;
        Some(Self {
            title: title.to_owned(),
            from: seconds(least),
            width: seconds(width),
            counts,
            least: seconds(least),
            median: seconds(durations[durations.len() / 2]),
            greatest: seconds(greatest),
        })
    }
}

impl Histogram {
    /// Returns the title, and the least, median and greatest duration \[s\].
    pub(crate) fn row(&self) -> (&str, [f64; 3]) {
        (&self.title, [self.least, self.median, self.greatest])
    }
}

/// Returns the histograms of a recording.
pub(crate) fn timing(recording: &Recording) -> Vec<Histogram> {
    let times = |group| -> Vec<u64> {
        let group = recording.group(group_name(group));
        let samples = group.into_iter().flat_map(|group| recording.samples(group));
        samples.map(|sample| sample.time.as_nanos()).collect()
    };
    let ends = times(Group::ProcessOutputs);
    // A controller without inputs is known by its outputs.
    let begins = Some(times(Group::ProcessInputs)).filter(|begins| !begins.is_empty());
    let begins = begins.unwrap_or_else(|| ends.clone());
    let periods = begins.windows(2).map(|pair| pair[1] - pair[0]);
    let computing = begins.iter().zip(&ends);
    let computing = computing.filter_map(|(begin, end)| end.checked_sub(*begin));
    let mut all = vec![
        Histogram::of("period of the controller", periods.collect()),
        Histogram::of("computing time of the controller", computing.collect())
            .filter(|histogram| histogram.greatest > 0.0),
    ];
    let mut buses: Vec<String> = Vec::new();
    for trace in recording.traces() {
        let bus = bus_of(trace);
        if !buses.iter().any(|known| known == bus) {
            buses.push(bus.to_owned());
        }
    }
    for bus in buses {
        let traces = recording.traces().filter(|trace| bus_of(trace) == bus);
        let pieces = traces.flat_map(|trace| recording.bytes(trace).map(|(at, _)| at));
        let mut pieces: Vec<SimTime> = pieces.collect();
        pieces.sort_unstable();
        let title = format!("first to last byte of a control step on {bus}");
        all.push(Histogram::of(&title, transfers(&pieces, &begins)));
    }
    all.into_iter().flatten().collect()
}

/// Returns the bus of a trace `BUS/…`.
fn bus_of(trace: &str) -> &str {
    trace.split('/').next().unwrap_or(trace)
}

/// Returns the time from the first to the last of the `pieces` of each control step \[ns\].
fn transfers(pieces: &[SimTime], begins: &[u64]) -> Vec<u64> {
    let mut index = 0;
    let mut durations = Vec::new();
    for pair in begins.windows(2) {
        let mut within: Option<[u64; 2]> = None;
        while let Some(at) = pieces.get(index).map(|at| at.as_nanos()) {
            if at >= pair[1] {
                break;
            }
            index += 1;
            if at >= pair[0] {
                within = Some([within.map_or(at, |it| it[0]), at]);
            }
        }
        durations.extend(within.map(|[first, last]| last - first));
    }
    durations
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn histogram_has_each_duration_in_a_bin() {
        assert_eq!(Histogram::of("", vec![5]), None);
        let equal = Histogram::of("", vec![2_000_000; 7]).unwrap();
        assert_eq!((equal.counts, equal.median), (vec![7], 2e-3));
        let spread = Histogram::of("", (0..1000).map(|n| 7000 * n).collect()).unwrap();
        assert_eq!(spread.counts.iter().sum::<u64>(), 1000);
        assert!(spread.counts.len() <= BINS + 1);
        assert!((spread.greatest - 999.0 * 7e-6).abs() < 1e-12);
        let end = spread.from + spread.width * spread.counts.len() as f64;
        assert!(end > spread.greatest && end < spread.greatest + 2.0 * spread.width);
    }

    #[test]
    fn transfers_are_within_control_steps() {
        let pieces = [5, 11, 13, 18, 25, 31, 39].map(SimTime::from_nanos);
        // None in the last, open step.
        assert_eq!(transfers(&pieces, &[10, 20, 30, 40]), [7, 0, 8]);
        assert!(transfers(&[], &[10, 20]).is_empty());
    }
}
