//! Output streams and exit codes of commands.

use std::io::{BufWriter, ErrorKind, Write};

use anstream::adapter::strip_str;
use serde::Serialize;
use twinrig_document::{Warning, escaped};

use crate::error::TwinError;
use twinrig_report::text::harmless::harmless;
use twinrig_report::text::layout::laid_out;
use twinrig_report::text::width::fit_message;

/// Exit code: success.
pub(super) const SUCCESS: u8 = 0;
/// Exit code: negative result, such as a failed expectation or a difference between recordings.
pub(super) const NEGATIVE: u8 = 1;
/// Exit code: error.
pub(super) const FAILURE: u8 = 2;

/// Output streams of a command.
pub(super) struct Terminal<'a> {
    pub(super) out: &'a mut dyn Write,
    pub(super) err: &'a mut dyn Write,
    /// Whether standard output shows styles.
    pub(super) styles: bool,
    /// Columns that lines of standard output must fit; none: no limit.
    pub(super) columns: Option<usize>,
    /// Columns that lines of standard error must fit; none: no limit.
    pub(super) err_columns: Option<usize>,
    /// Whether to show progress and to handle interrupts.
    pub(super) interactive: bool,
    /// First error of writing to standard output.
    pub(super) write_error: Option<std::io::Error>,
    /// Command line that repeats the results.
    pub(super) command: String,
}

impl Terminal<'_> {
    /// Prints styled text with exactly one newline at its end.
    pub(super) fn print(&mut self, text: &str) {
        let text = laid_out(&harmless(text), self.columns);
        if self.styles {
            self.print_plain(&text);
        } else {
            self.print_plain(&strip_str(&text).to_string());
        }
    }

    pub(super) fn print_plain(&mut self, text: &str) {
        let written = writeln!(self.out, "{}", text.trim_end());
        self.keep_error(written);
    }

    pub(super) fn keep_error(&mut self, written: std::io::Result<()>) {
        if let Err(error) = written {
            self.write_error.get_or_insert(error);
        }
    }

    /// Flushes the output of a command with the exit code `code` and returns the final exit code. A
    /// write error is a failure, except for a pipe closed by its reader.
    pub(super) fn finish(&mut self, code: u8) -> u8 {
        let flushed = self.out.flush();
        self.keep_error(flushed);
        match self.write_error.take() {
            Some(error) if error.kind() != ErrorKind::BrokenPipe => {
                let _ = writeln!(self.err, "error: cannot write to standard output: {error}");
                FAILURE
            }
            _ => code,
        }
    }

    pub(super) fn print_json(&mut self, value: &impl Serialize) {
        let mut out = BufWriter::new(&mut *self.out);
        let written = match serde_json::to_writer(&mut out, value) {
            Err(error) if error.is_io() => Err(error.into()),
            // A part that cannot be read is an error of its owner.
            _ => writeln!(out),
        };
        let written = written.and_then(|()| out.flush());
        drop(out);
        self.keep_error(written);
    }

    /// Reports an error: as JSON on standard output, or as text on standard error.
    pub(super) fn report_error(&mut self, error: &TwinError, json: bool) {
        #[derive(Serialize)]
        struct Failure {
            error: String,
        }
        if json {
            let error = error.to_string();
            self.print_json(&Failure { error });
        } else {
            self.print_error(error);
        }
    }

    pub(super) fn print_error(&mut self, error: &TwinError) {
        self.print_message(&error.text(self.err_columns));
    }

    /// Prints text, which has no styles, to standard error.
    pub(super) fn print_message(&mut self, text: &str) {
        let text = escaped(text);
        let text = match self.err_columns {
            Some(columns) => fit_message(&text, columns),
            None => text,
        };
        let _ = writeln!(self.err, "{text}");
    }

    /// Prints warnings to standard error; the JSON report contains them, too.
    pub(super) fn warn<'w>(&mut self, warnings: impl IntoIterator<Item = &'w Warning>) {
        for warning in warnings {
            let text = warning.text(self.err_columns);
            self.print_message(&format!("{text}\n"));
        }
    }

    /// Prints a note to standard error.
    pub(super) fn note(&mut self, text: &str) {
        self.print_message(&format!("note: {text}"));
    }
}
