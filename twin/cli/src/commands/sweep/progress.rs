//! Progress line of a sweep.

use std::fmt::Write as _;

use twinrig_experiment::SweepProgress;

use crate::progress::{Progress, bar};

/// Shows the number of runs of a sweep.
pub(crate) fn show(line: &mut Progress, progress: &SweepProgress) {
    line.show(|title, wall_s| runs_line(title, progress, wall_s));
}

/// Returns the line of a sweep:
/// `step-down  ████····  40 of 100  51.2 runs per second  1 s left  2 fail`.
fn runs_line(title: &str, progress: &SweepProgress, wall_s: f64) -> String {
    let SweepProgress {
        of,
        stored,
        ran,
        failed,
        workers,
    } = *progress;
    let done = stored + ran;
    let bar = bar(done as f64 / of.max(1) as f64);
    let rate = ran as f64 / wall_s;
    let left = if ran > 0 {
        format!("{:.0} s left", of.saturating_sub(done) as f64 / rate)
    } else {
        String::new()
    };
    let mut line =
        format!("{title}  {bar}  {done} of {of}  {rate:.1} runs per second  {left}  {failed} fail");
    if workers.machines.is_some() {
        let _ = write!(line, "  {workers}");
    }
    line
}

#[cfg(test)]
mod tests {
    use twinrig_campaign::engine::EngineStatus;

    use super::*;

    #[test]
    fn line_of_a_sweep_shows_rate_and_time_left() {
        let progress = SweepProgress {
            of: 100,
            stored: 25,
            ran: 25,
            failed: 3,
            workers: EngineStatus::default(),
        };
        let bar = format!("{}{}", "█".repeat(12), "·".repeat(12));
        assert_eq!(
            runs_line("step-down", &progress, 0.5),
            format!("step-down  {bar}  50 of 100  50.0 runs per second  1 s left  3 fail")
        );
        let workers = EngineStatus {
            machines: Some(1),
            waits_s: Some(290),
            ..EngineStatus::default()
        };
        let waiting = SweepProgress {
            workers,
            ..progress
        };
        let line = runs_line("step-down", &waiting, 0.5);
        assert!(line.ends_with("3 fail  waits for a slot, at most 290 s"));
    }
}
