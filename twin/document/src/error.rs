//! What is wrong with a document, shown so that a person can mend it.

use std::fmt;

use crate::source::Place;

/// One thing that is wrong: where, what, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The file, as it was named by whoever asked for it.
    pub file: String,
    /// Where in the file; absent where the file as a whole is meant (it cannot be read).
    pub place: Option<Place>,
    /// What is wrong.
    pub message: String,
    /// What would be right; may be empty.
    pub help: String,
}

impl Problem {
    /// A problem at a place.
    pub fn at(place: &Place, message: impl Into<String>, help: impl Into<String>) -> Self {
        Problem {
            file: place.source().name.clone(),
            place: Some(place.clone()),
            message: message.into(),
            help: help.into(),
        }
    }

    /// A problem of a file as a whole.
    pub fn of_file(
        file: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Problem {
            file: file.into(),
            place: None,
            message: message.into(),
            help: help.into(),
        }
    }
}

impl fmt::Display for Problem {
    /// ```text
    /// error: `12 Hz` is a frequency; `l1` wants a length
    ///  --> robots/mine.toml:7:6
    ///   |
    /// 7 | l1 = "12 Hz"
    ///   |      ^^^^^^^
    ///   = help: units that fit: m, cm, mm, um, km
    /// ```
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("error: ")?;
        self.write(f)
    }
}

impl Problem {
    /// What problems of one document are sorted by: line and column.
    fn order(&self) -> Option<(usize, usize)> {
        let place = self.place.as_ref()?;
        Some((place.line(), place.column()))
    }

    /// Message, place and help, without the severity in front.
    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        let Some(place) = &self.place else {
            write!(f, "\n --> {}", self.file)?;
            if !self.help.is_empty() {
                write!(f, "\n  = help: {}", self.help)?;
            }
            return Ok(());
        };
        let line = place.line().to_string();
        let margin = " ".repeat(line.len());
        // A tab stays a tab, so that the caret stands below what it means whatever a tab's width.
        let indent: String = place
            .before()
            .chars()
            .map(|c| if c == '\t' { '\t' } else { ' ' })
            .collect();
        let carets = "^".repeat(place.width());
        write!(
            f,
            "\n{margin}--> {}:{line}:{}\n{margin} |\n{line} | {}\n{margin} | {indent}{carets}",
            self.file,
            place.column(),
            place.line_text(),
        )?;
        if !self.help.is_empty() {
            write!(f, "\n{margin} = help: {}", self.help)?;
        }
        Ok(())
    }
}

/// Something that is accepted and most likely a mistake.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// A stable name of its kind, for programs.
    pub code: &'static str,
    /// Where, what, and the remedy.
    pub problem: Problem,
}

impl fmt::Display for Warning {
    /// As [`Problem`], with `warning[CODE]: ` in front.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "warning[{}]: ", self.code)?;
        self.problem.write(f)
    }
}

impl Warning {
    /// Sorts by place, as errors are sorted, and removes repetitions.
    pub(crate) fn sort(warnings: &mut Vec<Warning>) {
        warnings.sort_by_cached_key(|warning| warning.problem.order());
        warnings.dedup();
    }
}

/// Why a document was refused: everything that was found wrong with it, in the order of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DocumentError {
    /// Never empty.
    pub problems: Vec<Problem>,
}

impl DocumentError {
    /// The error of several problems, sorted by place.
    pub(crate) fn of(mut problems: Vec<Problem>) -> Self {
        problems.sort_by_cached_key(Problem::order);
        problems.dedup();
        DocumentError { problems }
    }
}

impl From<Problem> for DocumentError {
    fn from(problem: Problem) -> Self {
        DocumentError {
            problems: vec![problem],
        }
    }
}

impl fmt::Display for DocumentError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().enumerate() {
            if index > 0 {
                f.write_str("\n\n")?;
            }
            problem.fmt(f)?;
        }
        Ok(())
    }
}

impl std::error::Error for DocumentError {}
