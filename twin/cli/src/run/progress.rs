//! A line that says how far a long run or study is, on a terminal only.
#![expect(
    clippy::disallowed_methods,
    reason = "a person waits for it, and nothing else depends on it"
)]

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

/// Runs that end before this show nothing.
const QUIET: Duration = Duration::from_millis(400);
/// Time between two updates.
const PAUSE: Duration = Duration::from_millis(100);

/// The progress of one run or study.
#[derive(Debug)]
pub struct Progress {
    title: String,
    end_s: f64,
    started: Instant,
    shown: Option<Instant>,
    on: bool,
}

impl Progress {
    /// Of a run called `title` that ends at `end_s` of simulated time \[s\]; it shows something only if it is wanted and
    /// there is a terminal.
    pub fn new(title: &str, end_s: f64, wanted: bool) -> Self {
        Self {
            title: title.to_owned(),
            end_s,
            started: Instant::now(),
            shown: None,
            on: wanted && std::io::stderr().is_terminal(),
        }
    }

    /// Of a study called `title`.
    pub fn of_parts(title: &str, wanted: bool) -> Self {
        Self::new(title, 0.0, wanted)
    }

    /// Tells that the run has come to `now_s` \[s\].
    pub fn at(&mut self, now_s: f64) {
        let (title, end_s) = (self.title.clone(), self.end_s);
        self.show(|wall_s| line(&title, now_s, end_s, wall_s));
    }

    /// Tells that the study begins part `part` of `of`, which is `doing`.
    pub fn part(&mut self, part: usize, of: usize, doing: &str) {
        let title = self.title.clone();
        self.show(|wall_s| {
            let bar = bar(part as f64 / of.max(1) as f64);
            format!("{title}  {bar}  {part} of {of}  {wall_s:.0} s  {doing}")
        });
    }

    /// Tells something that one should know before the run.
    pub fn note(&self, text: &str) {
        if self.on {
            let _ = writeln!(std::io::stderr(), "note: {text}");
        }
    }

    fn show(&mut self, line: impl FnOnce(f64) -> String) {
        if !self.on {
            return;
        }
        let wall = self.started.elapsed();
        let due = match self.shown {
            None => wall >= QUIET,
            Some(last) => last.elapsed() >= PAUSE,
        };
        if due {
            self.shown = Some(Instant::now());
            let line = line(wall.as_secs_f64());
            let mut terminal = std::io::stderr().lock();
            // Whoever closed stderr does not want to know.
            let _ = write!(terminal, "\r\x1b[2K{line}").and_then(|()| terminal.flush());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.shown.is_some() {
            let mut terminal = std::io::stderr().lock();
            let _ = write!(terminal, "\r\x1b[2K").and_then(|()| terminal.flush());
        }
    }
}

/// `trot  [#####...............]  5.0 of 20.0 s  412 × real time`
fn line(title: &str, now_s: f64, end_s: f64, wall_s: f64) -> String {
    let bar = bar(if end_s > 0.0 { now_s / end_s } else { 1.0 });
    let speed = now_s / wall_s;
    format!("{title}  {bar}  {now_s:.1} of {end_s:.1} s  {speed:.0} × real time")
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
    use super::*;

    #[test]
    fn the_line_says_how_far_and_how_fast() {
        let bar = format!("{}{}", "█".repeat(6), "·".repeat(18));
        assert_eq!(
            line("trot", 5.0, 20.0, 0.0125),
            format!("trot  {bar}  5.0 of 20.0 s  400 × real time")
        );
    }
}
