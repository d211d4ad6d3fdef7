//! Problems of a document, with position and remedy.

use std::fmt;

use annotate_snippets::{
    AnnotationKind, Level, Origin, Renderer, Snippet, Title, normalize_untrusted_str,
};

use crate::source::Place;
use crate::visible::{escaped, visible};

/// A value with its position.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed<T> {
    /// The value.
    pub value: T,
    /// Its position, for errors that are detected after the document is read.
    pub place: Place,
}

impl<T> Placed<T> {
    /// Returns an error at the position of the value.
    pub fn error(&self, message: impl Into<String>, help: impl Into<String>) -> DocumentError {
        Problem::at(&self.place, message, help).into()
    }
}

/// A problem: position, description and remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Name of the file as passed by the caller.
    pub file: String,
    /// Position in the file; absent if the problem concerns the file as a whole (it cannot be
    /// read).
    pub place: Option<Place>,
    /// Description of the problem.
    pub message: String,
    /// Remedy; may be empty.
    pub help: String,
    /// Dotted path of the key, if the problem is that its table has none of that name.
    pub unknown_key: Option<String>,
}

impl Problem {
    /// A problem at a place.
    pub fn at(place: &Place, message: impl Into<String>, help: impl Into<String>) -> Self {
        Problem {
            file: place.source().name.clone(),
            place: Some(place.clone()),
            message: visible(&message.into()),
            help: visible(&help.into()),
            unknown_key: None,
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
            message: visible(&message.into()),
            help: visible(&help.into()),
            unknown_key: None,
        }
    }
}

impl fmt::Display for Problem {
    /// ```text
    /// error: `12 Hz` is a frequency; expected a length
    ///  --> robots/mine.toml:7:6
    ///   |
    /// 7 | l1 = "12 Hz"
    ///   |      ^^^^^^^
    ///   |
    ///   = help: units that fit: m, cm, mm, um, km
    /// ```
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text(None))
    }
}

impl Problem {
    /// Sort key of the problems of one document: line and offset. The column would be counted.
    fn order(&self) -> Option<(usize, usize)> {
        let place = self.place.as_ref()?;
        Some((place.line(), place.start()))
    }

    fn text(&self, columns: Option<usize>) -> String {
        self.rendered(Level::ERROR.primary_title(&self.message), columns)
    }

    /// Returns title, position and help; the excerpt fits `columns` if there is a limit.
    fn rendered(&self, title: Title<'_>, columns: Option<usize>) -> String {
        let file = escaped(&self.file);
        let mut report = match &self.place {
            None => title.element(Origin::path(&file)),
            Some(place) => title.element(
                // The line alone: a file with thousands of problems is not searched for each.
                Snippet::source(place.line_text())
                    .path(&file)
                    .line_start(place.line())
                    .annotation(AnnotationKind::Primary.span(place.in_line())),
            ),
        };
        if !self.help.is_empty() {
            report = report.element(Level::HELP.message(normalize_untrusted_str(&self.help)));
        }
        let plain = Renderer::plain();
        let renderer = match columns {
            Some(columns) => plain.term_width(columns),
            None => plain,
        };
        renderer.render(&[report])
    }
}

/// An accepted value that is probably a mistake.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Stable name of the kind of warning, for programs.
    pub code: &'static str,
    /// Position, description and remedy.
    pub problem: Problem,
}

impl fmt::Display for Warning {
    /// As [`Problem`], preceded by `warning[CODE]: `.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text(None))
    }
}

impl Warning {
    /// Returns the text of [`Display`](fmt::Display), with an excerpt of the file that fits
    /// `columns` if there is a limit. Messages and remedies are not broken.
    pub fn text(&self, columns: Option<usize>) -> String {
        let title = Level::WARNING.primary_title(&self.problem.message);
        self.problem.rendered(title.id(self.code), columns)
    }

    /// Sorts by position, as errors are sorted, and removes duplicates.
    pub(crate) fn sort(warnings: &mut Vec<Warning>) {
        warnings.sort_by_cached_key(|warning| warning.problem.order());
        warnings.dedup();
    }
}

/// Problems of a document that are printed; a program finds all of them in
/// [`DocumentError::problems`].
const SHOWN_MOST: usize = 20;

/// All problems of a rejected document, in the order of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DocumentError {
    /// Problems; never empty.
    pub problems: Vec<Problem>,
}

impl DocumentError {
    /// Creates the error of several problems, sorted by position.
    pub(crate) fn of(mut problems: Vec<Problem>) -> Self {
        problems.sort_by_cached_key(Problem::order);
        problems.dedup();
        DocumentError { problems }
    }

    /// Returns the text of [`Display`](fmt::Display), with excerpts of the file that fit `columns`
    /// if there is a limit. Messages and remedies are not broken.
    pub fn text(&self, columns: Option<usize>) -> String {
        let shown = self.problems.iter().take(SHOWN_MOST);
        let mut texts: Vec<String> = shown.map(|problem| problem.text(columns)).collect();
        match self.problems.len().saturating_sub(SHOWN_MOST) {
            0 => {}
            more => texts.push(format!("and {more} more problems")),
        }
        texts.join("\n\n")
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
        f.write_str(&self.text(None))
    }
}

impl std::error::Error for DocumentError {}
