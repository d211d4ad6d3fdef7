//! Results of a study of a gait over frequency and step length.

use serde_json::{Value, json};
use twinrig_report::number::si;

use super::GaitPoint;
use crate::csv;
use crate::machine::Machine;

/// Subject of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct GaitMapInput {
    /// Name of the scenario.
    pub name: String,
    /// Path of the scenario file.
    pub file: String,
    /// Frequencies \[Hz\].
    pub frequencies_hz: Vec<f64>,
    /// Step lengths \[m\].
    pub step_lengths_m: Vec<f64>,
    /// Time from which the gait is measured \[s\].
    pub after_s: f64,
    /// End of each run \[s\].
    pub end_s: f64,
    /// Parts that are left out, each with the reason.
    pub left_out: Vec<String>,
}

impl GaitMapInput {
    /// Returns the scene, frequency and step length of each run.
    pub(super) fn places(&self, scenes: usize) -> Vec<(usize, [f64; 2])> {
        let mut places = Vec::new();
        for scene in 0..scenes {
            for &frequency in &self.frequencies_hz {
                let lengths = self.step_lengths_m.iter();
                places.extend(lengths.map(|&length| (scene, [frequency, length])));
            }
        }
        places
    }
}

/// Gait over frequency and step length, on each plant.
#[derive(Clone, Debug, PartialEq)]
pub struct GaitMap {
    /// Subject of the study.
    pub input: GaitMapInput,
    /// Results of all runs.
    pub points: Vec<GaitPoint>,
}

impl GaitMap {
    /// Returns the plants.
    pub fn plants(&self) -> Vec<&str> {
        let mut plants: Vec<&str> = self.points.iter().map(|point| &*point.plant).collect();
        plants.dedup();
        plants
    }

    /// Returns the points of a plant.
    pub fn of_plant<'s>(&'s self, plant: &str) -> impl Iterator<Item = &'s GaitPoint> {
        self.points.iter().filter(move |point| point.plant == plant)
    }

    /// Returns the point of a plant with the greatest `value`, among those that have one.
    fn best(&self, plant: &str, value: impl Fn(&GaitPoint) -> Option<f64>) -> Option<&GaitPoint> {
        let points = self.of_plant(plant);
        let valued = points.filter_map(|point| Some((point, value(point)?)));
        let best = valued.max_by(|(_, one), (_, other)| one.total_cmp(other));
        best.map(|(point, _)| point)
    }

    /// Returns the fastest and the most economical gait of each plant, and the number of falls.
    pub(super) fn headline(&self) -> String {
        let sentences = self.plants().into_iter().map(|plant| {
            let at = |point: &GaitPoint| {
                let frequency = si(point.frequency_hz, "Hz");
                format!("{frequency} and {}", si(point.step_length_m, "m"))
            };
            let fastest = self.best(plant, |point| point.speed_m_s);
            let fastest =
                fastest.and_then(|it| Some(format!("{:.3} m/s at {}", it.speed_m_s?, at(it))));
            let cheapest = self.best(plant, |point| point.cost_of_transport.map(|cost| -cost));
            let cheapest =
                cheapest.and_then(|it| Some(format!("{:.3} at {}", it.cost_of_transport?, at(it))));
            let fell = self
                .of_plant(plant)
                .filter(|it| it.fell_at_s.is_some())
                .count();
            let none = || "none".to_owned();
            format!(
                "{plant}: fastest {}; least cost of transport {}; {fell} of {} fell.",
                fastest.unwrap_or_else(none),
                cheapest.unwrap_or_else(none),
                self.of_plant(plant).count(),
            )
        });
        sentences.collect::<Vec<_>>().join(" ")
    }

    /// Returns the study as JSON, with the machine it ran on and the command that repeats it.
    pub fn json(&self, machine: &Machine, command: &str) -> Value {
        json!({
            "study": "gait",
            "scenario": self.input.name,
            "file": self.input.file,
            "machine": machine,
            "command": command,
            "after_s": self.input.after_s,
            "end_s": self.input.end_s,
            "headline": self.headline(),
            "points": self.points,
            "left_out": self.input.left_out,
        })
    }

    /// Returns all points as comma-separated values.
    pub fn csv(&self) -> String {
        csv::table(&self.points, "", &[])
    }
}
