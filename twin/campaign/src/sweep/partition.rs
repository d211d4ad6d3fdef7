//! Partitions of the points of a sweep.

use std::str::FromStr;

use serde::Serialize;

/// Every n-th point of a sweep, for one of n machines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Partition {
    /// Number of the partition, from 1.
    pub part: usize,
    /// Number of partitions.
    pub of: usize,
}

impl Partition {
    /// The only partition: all points.
    pub const WHOLE: Self = Self { part: 1, of: 1 };

    /// Returns whether the point `index`, from 0, belongs to the partition.
    pub fn contains(self, index: usize) -> bool {
        index % self.of == self.part - 1
    }

    /// Returns whether it is the only one.
    pub fn is_whole(self) -> bool {
        self == Self::WHOLE
    }

    /// Name of the file of its rows, without the ending.
    pub(super) fn file_stem(self) -> String {
        match self {
            Self::WHOLE => "all".to_owned(),
            Self { part, of } => format!("part-{part}-of-{of}"),
        }
    }
}

/// As on the command line: `2/3`.
impl std::fmt::Display for Partition {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.part, self.of)
    }
}

/// From `2/3`: the second of three.
impl FromStr for Partition {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/');
        let numbers = numbers.and_then(|(part, of)| Some((part.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((part, of)) if part >= 1 && part <= of => Ok(Self { part, of }),
            _ => Err("it is written i/n, with i from 1 to n: 2/3".to_owned()),
        }
    }
}
