//! Progress line of long runs and studies, on terminals only.
#![expect(
    clippy::disallowed_methods,
    reason = "the progress line is output for the user; no result depends on it"
)]

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use twinrig_document::escaped;

use twinrig_report::text::width::{error_columns, fit, width};
use twinrig_rig::run::observers::{RunObserver, RunProgress};

/// Time before the first update.
const INITIAL_DELAY: Duration = Duration::from_millis(400);
/// Minimum time between updates.
const UPDATE_PERIOD: Duration = Duration::from_millis(100);

/// Progress line of one run, study or sweep.
#[derive(Debug)]
pub struct Progress {
    title: String,
    started: Instant,
    updated: Option<Instant>,
    enabled: bool,
}

impl Progress {
    /// Creates a progress line; enabled if `requested` and standard error is a terminal.
    pub fn new(title: &str, requested: bool) -> Self {
        Self {
            title: escaped(title).replace('\n', " "),
            started: Instant::now(),
            updated: None,
            enabled: requested && std::io::stderr().is_terminal(),
        }
    }

    /// Updates the study to part `part` of `of`, described by `description`.
    pub fn part(&mut self, part: usize, of: usize, description: &str) {
        self.show(|title, wall_s| {
            let bar = bar(part as f64 / of.max(1) as f64);
            format!("{title}  {bar}  {part} of {of}  {wall_s:.0} s  {description}")
        });
    }

    /// Prints a note before the run.
    pub fn note(&self, text: &str) {
        if self.enabled {
            let text = escaped(&format!("note: {text}"));
            let text = error_columns().map_or(text.clone(), |most| fit(&text, most));
            let _ = writeln!(std::io::stderr(), "{text}");
        }
    }

    /// Shows the line of the title and the wall time \[s\], where an update is due.
    pub fn show(&mut self, line: impl FnOnce(&str, f64) -> String) {
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
            let line = shortened(&line(&self.title, wall.as_secs_f64()), error_columns());
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

/// Progress line of a run, after that of its reference run if it has one.
#[derive(Debug)]
pub struct RunLine {
    title: String,
    line: Option<Progress>,
    enabled: bool,
}

impl RunLine {
    /// Creates the line; enabled as that of [`Progress::new`].
    pub fn new(requested: bool) -> Self {
        Self {
            title: String::new(),
            line: None,
            enabled: requested,
        }
    }
}

impl RunObserver for RunLine {
    fn poll(&mut self, progress: &RunProgress<'_>) {
        let RunProgress { title, now, end } = *progress;
        if self.line.is_none() || self.title != title {
            // Clears the line of the reference run.
            self.line = None;
            title.clone_into(&mut self.title);
        }
        let enabled = self.enabled;
        let shown = self
            .line
            .get_or_insert_with(|| Progress::new(title, enabled));
        shown.show(|title, wall_s| line(title, now.as_secs_f64(), end.as_secs_f64(), wall_s));
    }

    fn note(&mut self, text: &str) {
        Progress::new("", self.enabled).note(text);
    }
}

/// Returns the line of a run: `trot  █████···············  5.0 of 20.0 s  412 × real time`.
fn line(title: &str, now_s: f64, end_s: f64, wall_s: f64) -> String {
    let bar = bar(if end_s > 0.0 { now_s / end_s } else { 1.0 });
    let speed = now_s / wall_s;
    format!("{title}  {bar}  {now_s:.1} of {end_s:.1} s  {speed:.0} × real time")
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

/// Returns a bar of fixed width.
pub(crate) fn bar(share: f64) -> String {
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
