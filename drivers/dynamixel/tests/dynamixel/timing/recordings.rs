//! The recordings are those of github.com/Rhoban/bam (Apache-2.0; commits af22604, d13c057 and
//! 7860487), in the folder that `SERVO_LOGS` names.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use serde_json::Value;
use twinrig_dynamixel::timing::{
    HostLoop, Prediction, adapters, ks_distance, percentile, predictions,
};
use twinrig_kernel::SimDuration;
use twinrig_runtime::Timing;
use twinrig_wire::UsbTiming;

use super::{STATED, TOLERANCE, check, ms};

/// Periods without and with torque.
type Periods = [Vec<SimDuration>; 2];

/// Returns the periods of all recordings of the XL330, in the order of their names.
fn recordings(folder: PathBuf) -> Vec<Periods> {
    let paths = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let is_xl330 = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy();
        name.starts_with("xl330")
    };
    let mut paths: Vec<_> = paths.filter(is_xl330).collect();
    paths.sort();
    let periods = |path: &PathBuf| {
        let log: Value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
        let mut periods = Periods::default();
        for pair in log["entries"].as_array().unwrap().windows(2) {
            let torque = [0, 1].map(|n| pair[n]["torque_enable"].as_bool().unwrap());
            let stamp = [0, 1].map(|n| pair[n]["timestamp"].as_f64().unwrap());
            let period = SimDuration::try_from_secs_f64(stamp[1] - stamp[0]).unwrap();
            if torque[0] == torque[1] {
                periods[usize::from(torque[0])].push(period);
            }
        }
        periods
    };
    paths.iter().map(periods).collect()
}

/// Delays of the host that are fitted: a share of the jitter of the adapter's preset, the time of
/// the program \[µs\], and the oversleep \[µs\].
#[derive(Clone, Copy, Debug)]
struct Host {
    jitter: u64,
    program: u64,
    oversleep: u64,
}

/// Steps of the share of the jitter.
const JITTER_STEPS: u64 = 4;

impl Host {
    /// Returns simulated periods for a row.
    fn periods(self, row: &Prediction, torque: bool, count: usize) -> Vec<SimDuration> {
        let mut all = adapters().into_iter();
        let usb = all.find(|adapter| adapter.name == row.adapter).unwrap().usb;
        let usb = UsbTiming {
            jitter: self.scaled(&usb.jitter),
            write_jitter: self.scaled(&usb.write_jitter),
            ..usb
        };
        let host = HostLoop {
            usb,
            return_delay: row.return_delay,
            sleep: torque.then(|| SimDuration::from_micros(1_000 + self.oversleep)),
            program: Timing::Constant(SimDuration::from_micros(self.program)),
            seed: 1,
        };
        host.periods(count).unwrap()
    }

    /// Scales the variable part of a delay.
    fn scaled(self, timing: &Timing) -> Timing {
        let scaled = |time: SimDuration| {
            SimDuration::from_nanos(time.as_nanos() * self.jitter / JITTER_STEPS)
        };
        match timing.clone() {
            Timing::Uniform { min, max } => Timing::Uniform {
                min,
                max: min + scaled(max - min),
            },
            Timing::Normal {
                mean,
                deviation,
                min,
                max,
            } => Timing::Normal {
                mean,
                deviation: scaled(deviation),
                min,
                max: min + scaled(max - min),
            },
            other => other,
        }
    }

    /// Fits the delays to periods, with a program of at least `program`: those without torque
    /// first, then the oversleep.
    fn fit(row: &Prediction, program: u64, recorded: &mut Periods) -> Self {
        let mut best = |hosts: Vec<Self>, torque: bool| {
            let rated = hosts.into_iter().map(|host| {
                let mut periods = host.periods(row, torque, 200);
                let distance = ks_distance(&mut periods, &mut recorded[usize::from(torque)]);
                (distance, host)
            });
            rated.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1
        };
        let programs = || (program..=program + 60).step_by(5);
        let delays = (0..=JITTER_STEPS).flat_map(|jitter| {
            programs().map(move |program| Self {
                jitter,
                program,
                oversleep: 0,
            })
        });
        let host = best(delays.collect(), false);
        let sleeps = (0..=200).step_by(10);
        let sleeps = sleeps.map(|oversleep| Self { oversleep, ..host });
        best(sleeps.collect(), true)
    }
}

/// Rows that are fitted besides those that agree, for comparison: adapter, return delay \[µs\] and
/// least time of the program \[µs\].
const OTHERS: [(&str, u64, u64); 2] = [("at-once", 0, 250), ("uart", 250, 140)];

/// Appends a line with the distances to both halves of the recordings.
fn line(
    text: &mut String,
    name: &str,
    torque: usize,
    periods: &mut Periods,
    halves: &mut [Periods; 2],
) {
    let periods = &mut periods[torque];
    let percentiles = [1, 50, 99].map(|percent| ms(percentile(periods, percent)));
    let [one, other] = halves
        .each_mut()
        .map(|half| ks_distance(periods, &mut half[torque]));
    let _ = write!(
        text,
        "\n| {name} | {} | {} | {one:.2} | {other:.2} |",
        ["reads", "all"][torque],
        percentiles.join(", ")
    );
}

/// Appends the lines of a row with delays of the host.
fn lines(text: &mut String, row: &Prediction, host: Host, what: &str, halves: &mut [Periods; 2]) {
    let name = format!(
        "`{}`, {} µs, {what}: jitter × {}, program {} µs, oversleep {} µs",
        row.adapter,
        row.return_delay.as_nanos() / 1000,
        host.jitter as f64 / JITTER_STEPS as f64,
        host.program,
        host.oversleep
    );
    let mut periods = [false, true].map(|torque| host.periods(row, torque, 1_000));
    for torque in [0, 1] {
        line(text, &name, torque, &mut periods, halves);
    }
}

/// Fits the delays of the host to every second recording, and compares with the others.
#[test]
fn agreeing_rows_are_judged_by_recordings() {
    let Some(folder) = std::env::var_os("SERVO_LOGS").map(PathBuf::from) else {
        eprintln!("skipped: no logs");
        return;
    };
    let recordings = recordings(folder);
    assert_eq!(recordings.len(), 10);
    let half = |first: usize| -> Periods {
        let logs = || recordings.iter().skip(first).step_by(2);
        [0, 1].map(|torque| logs().flat_map(|log| log[torque].clone()).collect())
    };
    let mut halves = [half(0), half(1)];
    let mut text = String::from(
        "| | loop | p1, p50, p99 \\[ms\\] | KS to the fitted half | KS to the other half |\n\
         |---|---|---|---|---|",
    );
    for torque in [0, 1] {
        line(
            &mut text,
            "recorded, other half",
            torque,
            &mut half(1),
            &mut halves,
        );
    }
    let rows = predictions().unwrap();
    for row in rows.iter().filter(|row| row.agrees(&STATED, TOLERANCE)) {
        let predicted = Host {
            jitter: JITTER_STEPS,
            program: 0,
            oversleep: row.slack.as_nanos() / 1000,
        };
        lines(&mut text, row, predicted, "predicted", &mut halves);
        let host = Host::fit(row, 0, &mut halves[0]);
        lines(&mut text, row, host, "fitted", &mut halves);
    }
    for (adapter, delay, program) in OTHERS {
        let delay = SimDuration::from_micros(delay);
        let row = rows
            .iter()
            .find(|row| row.adapter == adapter && row.return_delay == delay);
        let host = Host::fit(row.unwrap(), program, &mut halves[0]);
        lines(&mut text, row.unwrap(), host, "fitted", &mut halves);
    }
    check("recordings", &text);
}
