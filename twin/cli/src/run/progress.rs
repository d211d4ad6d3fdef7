//! Progress line of long runs and studies, on terminals only.
#![expect(
    clippy::disallowed_methods,
    reason = "the progress line is output for the user; no result depends on it"
)]

use std::fmt::Write as _;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use twinrig_document::escaped;

use crate::optimize::execute::OptimizationProgress;
use crate::optimize::table::value_and_unit;
use crate::report::width::{error_columns, fit, width};
use crate::sweep::execute::SweepProgress;

/// Time before the first update.
const INITIAL_DELAY: Duration = Duration::from_millis(400);
/// Minimum time between updates.
const UPDATE_PERIOD: Duration = Duration::from_millis(100);

/// Progress line of one run or study.
#[derive(Debug)]
pub struct Progress {
    title: String,
    end_s: f64,
    started: Instant,
    updated: Option<Instant>,
    enabled: bool,
}

impl Progress {
    /// Creates the progress line of a run with the end time `end_s` \[s\]; enabled if `requested`
    /// and standard error is a terminal.
    pub fn new(title: &str, end_s: f64, requested: bool) -> Self {
        Self {
            title: escaped(title).replace('\n', " "),
            end_s,
            started: Instant::now(),
            updated: None,
            enabled: requested && std::io::stderr().is_terminal(),
        }
    }

    /// Creates the progress line of a study.
    pub fn of_parts(title: &str, requested: bool) -> Self {
        Self::new(title, 0.0, requested)
    }

    /// Updates the simulated time of the run to `now_s` \[s\].
    pub fn at(&mut self, now_s: f64) {
        let (title, end_s) = (self.title.clone(), self.end_s);
        self.show(|wall_s| line(&title, now_s, end_s, wall_s));
    }

    /// Updates the study to part `part` of `of`, described by `description`.
    pub fn part(&mut self, part: usize, of: usize, description: &str) {
        let title = self.title.clone();
        self.show(|wall_s| {
            let bar = bar(part as f64 / of.max(1) as f64);
            format!("{title}  {bar}  {part} of {of}  {wall_s:.0} s  {description}")
        });
    }

    /// Updates the number of runs of a sweep.
    pub fn runs(&mut self, progress: &SweepProgress) {
        let (title, progress) = (self.title.clone(), *progress);
        self.show(|wall_s| runs_line(&title, &progress, wall_s));
    }

    /// Updates the generation of an optimisation.
    pub fn generation(&mut self, progress: &OptimizationProgress) {
        let (title, progress) = (self.title.clone(), progress.clone());
        self.show(|wall_s| generation_line(&title, &progress, wall_s));
    }

    /// Prints a note before the run.
    pub fn note(&self, text: &str) {
        if self.enabled {
            let text = escaped(&format!("note: {text}"));
            let text = error_columns().map_or(text.clone(), |most| fit(&text, most));
            let _ = writeln!(std::io::stderr(), "{text}");
        }
    }

    fn show(&mut self, line: impl FnOnce(f64) -> String) {
        if !self.enabled {
            return;
        }
        let wall = self.started.elapsed();
        let is_due = match self.updated {
            None => wall >= INITIAL_DELAY,
            Some(last) => last.elapsed() >= UPDATE_PERIOD,
        };
        if is_due {
            self.updated = Some(Instant::now());
            let line = shortened(&line(wall.as_secs_f64()), error_columns());
            let mut terminal = std::io::stderr().lock();
            // Errors on a closed standard error are ignored.
            let _ = write!(terminal, "\r\x1b[2K{line}").and_then(|()| terminal.flush());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.updated.is_some() {
            let mut terminal = std::io::stderr().lock();
            let _ = write!(terminal, "\r\x1b[2K").and_then(|()| terminal.flush());
        }
    }
}

/// Returns the line of a run: `trot  █████···············  5.0 of 20.0 s  412 × real time`.
fn line(title: &str, now_s: f64, end_s: f64, wall_s: f64) -> String {
    let bar = bar(if end_s > 0.0 { now_s / end_s } else { 1.0 });
    let speed = now_s / wall_s;
    format!("{title}  {bar}  {now_s:.1} of {end_s:.1} s  {speed:.0} × real time")
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
        format!("  best {}", value_and_unit(*value, unit))
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

/// Returns the parts of a progress line that fit: one that is broken could not be overwritten. The
/// bar is left out first, then parts at the end.
fn shortened(line: &str, columns: Option<usize>) -> String {
    // The last column stays free: some terminals begin a new line there.
    let most = columns.map_or(usize::MAX, |columns| columns - 1);
    let mut parts: Vec<&str> = line.split("  ").filter(|part| !part.is_empty()).collect();
    if width(line) <= most {
        return line.to_owned();
    }
    parts.retain(|part| !part.starts_with(['█', '·']));
    while parts.len() > 1 && width(&parts.join("  ")) > most {
        parts.pop();
    }
    let mut line = parts.join("  ");
    while width(&line) > most {
        line.pop();
    }
    line
}

fn bar(share: f64) -> String {
    const WIDTH: usize = 24;
    let full = (1..=WIDTH)
        .filter(|&n| n as f64 <= share * WIDTH as f64)
        .count();
    "█".repeat(full) + &"·".repeat(WIDTH - full)
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

    #[test]
    fn progress_fits_the_terminal() {
        let full = line("trot", 5.0, 20.0, 0.0125);
        assert_eq!(shortened(&full, None), full);
        assert_eq!(shortened(&full, Some(80)), full);
        let short = "trot  5.0 of 20.0 s  400 × real time";
        assert_eq!(shortened(&full, Some(40)), short);
        let named = line(&"脚".repeat(30), 5.0, 20.0, 0.0125);
        assert_eq!(width(&shortened(&named, Some(40))), 38);
    }

    #[test]
    fn line_shows_progress_and_speed() {
        let bar = format!("{}{}", "█".repeat(6), "·".repeat(18));
        assert_eq!(
            line("trot", 5.0, 20.0, 0.0125),
            format!("trot  {bar}  5.0 of 20.0 s  400 × real time")
        );
    }
}
