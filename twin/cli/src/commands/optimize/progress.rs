//! Progress line of an optimisation.

use std::fmt::Write as _;

use twinrig_experiment::OptimizationProgress;
use twinrig_report::number::precise;

use crate::progress::{Progress, bar};

/// Shows the generation of an optimisation.
pub(crate) fn show(line: &mut Progress, progress: &OptimizationProgress) {
    line.show(|title, wall_s| generation_line(title, progress, wall_s));
}

/// Returns the line of an optimisation:
/// `trot  ███····  generation 12 of 100  best 1.21 m/s  90000 runs an hour  42 s left`.
fn generation_line(title: &str, progress: &OptimizationProgress, wall_s: f64) -> String {
    let OptimizationProgress {
        generation,
        of,
        evaluations,
        points,
        done,
        ran,
        best,
        workers,
    } = progress;
    let all = evaluations + points * (of + 1).saturating_sub(*generation);
    let done = evaluations + done;
    let bar = bar(done as f64 / all.max(1) as f64);
    let best = best.as_ref().map_or(String::new(), |(value, unit)| {
        format!("  best {}", precise(*value, unit))
    });
    let mut line = format!("{title}  {bar}  generation {generation} of {of}{best}");
    if *ran > 0 {
        // Evaluations of earlier calls take no time.
        let per_run_s = wall_s / *ran as f64;
        let left_s = per_run_s * all.saturating_sub(done) as f64;
        let _ = write!(
            line,
            "  {:.0} runs an hour  {}",
            3600.0 / per_run_s,
            left(left_s)
        );
    }
    if workers.machines.is_some() {
        let _ = write!(line, "  {workers}");
    }
    line
}

/// Returns the time left: `42 s left`, `12 min left`, `3.4 h left`.
fn left(seconds: f64) -> String {
    if seconds < 120.0 {
        format!("{seconds:.0} s left")
    } else if seconds < 7200.0 {
        format!("{:.0} min left", seconds / 60.0)
    } else {
        format!("{:.1} h left", seconds / 3600.0)
    }
}

#[cfg(test)]
mod tests {
    use twinrig_campaign::engine::EngineStatus;

    use super::*;

    #[test]
    fn line_of_an_optimisation_shows_best_value_rate_and_time_left() {
        let progress = OptimizationProgress {
            generation: 4,
            of: 9,
            evaluations: 40,
            points: 10,
            done: 10,
            ran: 25,
            best: Some((0.963_95, "m/s".to_owned())),
            workers: EngineStatus::default(),
        };
        let bar = format!("{}{}", "█".repeat(12), "·".repeat(12));
        assert_eq!(
            generation_line("trot", &progress, 0.5),
            format!(
                "trot  {bar}  generation 4 of 9  best 0.96395 m/s  180000 runs an hour  1 s left"
            )
        );
        assert_eq!(
            [left(119.0), left(600.0), left(9000.0)],
            ["119 s left", "10 min left", "2.5 h left"]
        );
    }
}
