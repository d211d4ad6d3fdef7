//! Starts of the program whose measurements a study has.

use serde::Serialize;
use twinrig_report::summary::Summary;

use crate::machine::Machine;

/// Start of the program.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Start {
    /// Number, which rows have; from 1.
    pub start: usize,
    /// Load average of the machine at this start.
    pub load: Option<f64>,
}

/// Starts of the program whose measurements a study has; none of a study that keeps nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Starts {
    /// Starts, in order.
    pub starts: Vec<Start>,
    /// Notes about the rows on disk.
    #[serde(skip)]
    pub notes: Vec<String>,
}

impl Starts {
    /// Returns the machine at the first of them: when the study began.
    pub(crate) fn machine(&self, present: &Machine) -> Machine {
        let load = self.starts.first().map_or(present.load, |first| first.load);
        Machine {
            load,
            ..present.clone()
        }
    }

    /// Returns the sentence on a study of several starts.
    pub(crate) fn sentence(&self) -> Option<String> {
        let [_, _, ..] = &*self.starts else {
            return None;
        };
        let each = self.starts.iter().map(|Start { start, load }| {
            let load = load.map_or(String::new(), |load| format!(" (load {load:.2})"));
            format!("{start}{load}")
        });
        Some(format!(
            "the run times are of {} starts of the program: {}",
            self.starts.len(),
            each.collect::<Vec<_>>().join(", ")
        ))
    }

    /// Adds what the reader of a summary should know.
    pub(crate) fn note(&self, summary: &mut Summary) {
        for note in self.sentence().iter().chain(&self.notes) {
            summary.fact("note", note);
        }
    }
}
