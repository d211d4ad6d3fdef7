//! Periods of a host's loop over a bus, predicted and judged by recordings.
//!
//! The tests make passages of docs/timing.md.

mod bus_loop;
mod recordings;
mod threads;

use std::fmt::Write;
use std::path::Path;
use std::sync::Mutex;

use twinrig_dynamixel::timing::{LoopTimes, Prediction, RETURN_DELAYS, SLACKS, predictions};
use twinrig_kernel::SimDuration;
use twinrig_testing::keys::check_passage;

/// Medians that the description of the recordings states.
const STATED: LoopTimes = LoopTimes {
    without_torque: SimDuration::from_micros(3_510),
    with_torque: SimDuration::from_micros(5_310),
};
/// Greatest deviation of a row that agrees.
const TOLERANCE: f64 = 0.03;

/// Bytes of the packets of five reads, 14 of each request and 11 of each answer besides its data.
const READS: u64 = 5 * (14 + 11) + 4 + 4 + 2 + 2 + 1;
/// Bytes of the packets of a write of four bytes.
const WRITE: u64 = 16 + 11;

fn ms(time: SimDuration) -> String {
    format!("{:.2}", time.as_secs_f64() * 1e3)
}

/// Returns the predictions as a table, with the return delays as columns.
fn table(rows: &[Prediction]) -> String {
    let mut text = String::from("| adapter | loop |");
    for delay in RETURN_DELAYS {
        let _ = write!(text, " {} µs |", delay.as_nanos() / 1000);
    }
    text += "\n|---|---|---|---|---|---|---|";
    for rows in rows.chunks(RETURN_DELAYS.len() * SLACKS.len()) {
        let adapter = rows[0].adapter;
        let delays = rows.chunks(SLACKS.len());
        let reads = delays.clone().map(|rows| ms(rows[0].times.without_torque));
        let all = delays.map(|rows| {
            let rows = rows.iter().map(|row| ms(row.times.with_torque));
            rows.collect::<Vec<_>>().join(" / ")
        });
        for (name, cells) in [("reads", reads.collect()), ("all", all.collect::<Vec<_>>())] {
            let _ = write!(text, "\n| `{adapter}` | {name} | {} |", cells.join(" | "));
        }
    }
    text
}

#[test]
fn predicted_periods_are_those_of_the_page() {
    let rows = predictions().unwrap();
    for row in rows.iter().filter(|row| row.adapter == "uart") {
        // Without USB: the bytes, the return delays, the delays of the host, and the sleep.
        let byte = SimDuration::from_micros(10);
        let LoopTimes { without_torque, .. } = row.times;
        let host = without_torque - (byte * READS + row.return_delay * 5);
        assert!((90..150).contains(&(host.as_nanos() / 1000)), "{row:?}");
        let sleep = SimDuration::from_millis(1) + row.slack;
        let bus = byte * WRITE + row.return_delay + sleep;
        let host = row.times.write_and_sleep() - bus;
        assert!((10..40).contains(&(host.as_nanos() / 1000)), "{row:?}");
    }
    check("predictions", &table(&rows));
    check("verdicts", &verdicts(&rows));
}

fn check(name: &str, passage: &str) {
    // Several tests write one page.
    static PAGE: Mutex<()> = Mutex::new(());
    let _page = PAGE.lock();
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/timing.md");
    check_passage(&page, name, passage);
}

/// Returns the row of each adapter with the least deviation from the stated medians, as a table.
fn verdicts(rows: &[Prediction]) -> String {
    let mut text = String::from(
        "| adapter | return delay | oversleep | reads | all | write and sleep | within 3 % |\n\
         |---|---|---|---|---|---|---|",
    );
    let greatest = |row: &&Prediction| {
        let deviations = row.deviations(&STATED);
        deviations
            .iter()
            .fold(0.0, |most: f64, it| most.max(it.abs()))
    };
    for rows in rows.chunks(RETURN_DELAYS.len() * SLACKS.len()) {
        let best = rows
            .iter()
            .min_by(|a, b| greatest(a).total_cmp(&greatest(b)));
        let best = best.unwrap();
        let percent = best
            .deviations(&STATED)
            .map(|it| format!("{:+.1} %", it * 100.0));
        let agreeing = rows.iter().filter(|row| row.agrees(&STATED, TOLERANCE));
        let _ = write!(
            text,
            "\n| `{}` | {} µs | {} µs | {} | {} of {} |",
            best.adapter,
            best.return_delay.as_nanos() / 1000,
            best.slack.as_nanos() / 1000,
            percent.join(" | "),
            agreeing.count(),
            rows.len()
        );
    }
    text
}
