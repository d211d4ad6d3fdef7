//! Times that users state in public threads, beside simulated ones.

use std::fmt::Write;

use twinrig_dynamixel::timing::stated_times;

use super::{check, ms};

#[test]
fn threads_state_times_beside_simulated_ones() {
    let mut text = String::from(
        "| issue | as stated | stated \\[ms\\] | return delay | simulated \\[ms\\] |\n|---|---|---|---|---|",
    );
    for time in stated_times().unwrap() {
        let simulated = time.simulated.iter().map(|(_, median)| ms(*median));
        let _ = write!(
            text,
            "\n| [{}]({}) | {} | {} | {} µs | {} |",
            time.issue,
            time.source(),
            time.conditions,
            time.stated_ms,
            time.return_delay.as_nanos() / 1000,
            simulated.collect::<Vec<_>>().join(" / ")
        );
    }
    check("threads", &text);
}
