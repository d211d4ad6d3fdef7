//! Cells: values and their tone.

use std::fmt::Write as _;

use anstyle::Style;

use crate::number::{percent, percent_range};
use crate::text::style::{DIM, GREEN, RED, YELLOW};

/// Value of a cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) enum Value {
    #[default]
    Empty,
    Text(String),
    Code(String),
    /// Text and the place on the page that it leads to.
    Link(String, String),
    Number(f64),
    Share(f64),
    Interval(Interval),
}

/// Interval of a share, drawn on pages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Ends.
    pub ends: [f64; 2],
    /// Estimate, if there is one.
    pub share: Option<f64>,
    /// Required shares, least and greatest.
    pub bounds: [Option<f64>; 2],
}

impl Interval {
    /// Draws the interval on a scale from 0 to 1.
    pub(super) fn svg(&self) -> String {
        const WIDTH: f64 = 120.0;
        let x = |share: f64| 2.0 + (WIDTH - 4.0) * share.clamp(0.0, 1.0);
        let [low, high] = self.ends.map(x);
        let mut bounds = String::new();
        for at in self.bounds.into_iter().flatten().map(x) {
            // Writing to a string cannot fail.
            let _ = write!(bounds, "<polyline points=\"{at:.1},1 {at:.1},13\"/>");
        }
        let dot = self.share.map_or(String::new(), |share| {
            format!("<circle cx=\"{:.1}\" cy=\"7\" r=\"3.2\"/>", x(share))
        });
        format!(
            "<svg class=\"interval\" viewBox=\"0 0 {WIDTH} 14\" role=\"img\" aria-label=\"{}\">\
             <g class=\"c7\">{bounds}</g>\
             <g class=\"c0\"><polyline points=\"{low:.1},7 {high:.1},7\"/>{dot}</g></svg>",
            percent_range(self.ends)
        )
    }
}

/// Meaning of a value for the reader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// As expected.
    #[default]
    Plain,
    /// A success.
    Good,
    /// A failure, or the first of several.
    Bad,
    /// With a reservation.
    Doubtful,
    /// Of less interest.
    Faint,
}

/// Cell of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cell {
    pub(super) value: Value,
    pub(super) tone: Tone,
    pub(super) detail: String,
}

impl Tone {
    /// Returns the style of text.
    pub fn style(self) -> Style {
        match self {
            Self::Plain => Style::new(),
            Self::Good => GREEN,
            Self::Bad => RED,
            Self::Doubtful => YELLOW,
            Self::Faint => DIM,
        }
    }
}

impl Cell {
    /// Creates an empty cell.
    pub fn empty() -> Self {
        Self::default()
    }

    /// Creates a cell with a share: `82.5 %`.
    pub fn share(share: f64) -> Self {
        Value::Share(share).into()
    }

    /// Creates a cell with a text that is printed as code.
    pub fn code(text: impl Into<String>) -> Self {
        Value::Code(text.into()).into()
    }

    /// Creates a cell with a text that leads to a place on its page: `#t=0.41`.
    pub fn link(text: impl Into<String>, to: impl Into<String>) -> Self {
        Value::Link(text.into(), to.into()).into()
    }

    /// Sets the tone.
    #[must_use]
    pub fn with_tone(mut self, tone: Tone) -> Self {
        self.tone = tone;
        self
    }

    /// Adds a text that pages show below the value, and Markdown in parentheses.
    #[must_use]
    pub fn with_detail(mut self, detail: impl Into<String>) -> Self {
        self.detail = detail.into();
        self
    }

    pub(super) fn text(&self, number: impl Fn(f64) -> String) -> String {
        match &self.value {
            Value::Empty => String::new(),
            Value::Text(text) | Value::Code(text) | Value::Link(text, _) => text.clone(),
            Value::Number(value) => number(*value),
            Value::Share(share) => percent(*share),
            Value::Interval(interval) => percent_range(interval.ends),
        }
    }
}

impl From<Value> for Cell {
    fn from(value: Value) -> Self {
        Self {
            value,
            ..Self::default()
        }
    }
}

impl From<Interval> for Cell {
    fn from(interval: Interval) -> Self {
        Value::Interval(interval).into()
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Value::Text(text).into()
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Value::Number(number).into()
    }
}

/// A count, with all of its digits.
impl From<usize> for Cell {
    fn from(count: usize) -> Self {
        count.to_string().into()
    }
}

/// Nothing is an empty cell.
impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or_else(Self::default, Into::into)
    }
}
