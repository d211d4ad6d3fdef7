//! Periods of a host's loop over a bus, predicted.

use std::fmt::Write;
use std::path::Path;

use twinrig_dynamixel::timing::{LoopTimes, Prediction, RETURN_DELAYS, SLACKS, predictions};
use twinrig_kernel::SimDuration;
use twinrig_testing::keys::check_passage;

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
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/timing.md");
    check_passage(&page, "predictions", &table(&rows));
}
