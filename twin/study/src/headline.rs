//! A study in a sentence.

use crate::dominance::Dominance;
use crate::number::{grouped_factor, knob, si};
use crate::row::{Row, RowKind, Status};
use crate::study::{Study, StudyKind};
use crate::workshop::Scales;

/// The step that plants are used at, and what is aimed for there.
pub(crate) const USUAL_STEP_S: f64 = 2e-3;
pub(crate) const AIM_M: f64 = 1e-6;

/// Whether a row is of the step that plants are used at.
pub(crate) fn at_usual_step(row: &Row) -> bool {
    row.step_s
        .is_some_and(|step| (step / USUAL_STEP_S - 1.0).abs() < 1e-9)
}

/// Where a plant is ahead of others that solve its model, and where not.
pub(crate) fn dominance_sentence(dominance: &Dominance) -> String {
    let of = &dominance.of;
    let count = dominance.settings.len();
    let behind = dominance.behind().count();
    let ranges = dominance.over.iter().map(|plant| {
        let range = dominance.range(plant, None);
        range.map_or_else(
            || format!("{plant} is closer than {of} at all of its settings"),
            |(least, most)| {
                let [least, most] = [least, most].map(grouped_factor);
                format!("{least} to {most} less run time than {plant}")
            },
        )
    });
    let ranges = ranges.collect::<Vec<_>>().join(", ");
    let whose = match &dominance.over[..] {
        [plant] => format!("{plant}'s"),
        _ => "their".to_owned(),
    };
    if behind == 0 {
        format!(
            "At no greater error {of} takes {ranges}: it is ahead at all of {whose} {count} settings."
        )
    } else {
        format!(
            "At no greater error {of} takes {ranges}: it is ahead at {} of {whose} {count} settings and not at {behind}.",
            count - behind
        )
    }
}

impl Study {
    /// What it found, in a sentence or two.
    pub fn headline(&self) -> String {
        match self.kind {
            StudyKind::Precision => {
                let all = self.dominances();
                let sentences = all.iter().map(dominance_sentence);
                let sentences = std::iter::once(self.precise()).chain(sentences);
                sentences.collect::<Vec<_>>().join(" ")
            }
            StudyKind::Stability => self.stable(),
        }
    }

    /// The fastest of the most thorough model at the usual step that comes within the aim, or the one that comes nearest.
    fn precise(&self) -> String {
        let massive = |row: &&Row| self.massive.is_empty() || self.massive.contains(&row.plant);
        let rows = self.rows.iter().filter(massive);
        let known: Vec<(&Row, f64)> = rows
            .filter(|row| row.kind == RowKind::Integration && row.status == Status::Ok)
            .filter_map(|row| Some((row, row.error_rms_m?)))
            .collect();
        let usual = known.iter().filter(|(row, _)| at_usual_step(row));
        let rows: Vec<(&Row, f64)> = usual.copied().collect();
        let speed = |row: &Row| row.real_time_factor.unwrap_or(0.0);
        let fastest = |rows: &[(&Row, f64)]| -> Option<String> {
            let within = rows.iter().filter(|(_, error)| *error <= AIM_M);
            let (row, error) = within.max_by(|(a, _), (b, _)| speed(a).total_cmp(&speed(b)))?;
            let setting = knob(row.step_s, row.tolerance);
            let (name, error) = (row.line().name(), si(*error, "m"));
            Some(format!(
                "{name} at {setting}: {error} at {} real time.",
                grouped_factor(speed(row))
            ))
        };
        let step = si(USUAL_STEP_S, "s");
        if let Some(found) = fastest(&rows) {
            return found;
        }
        // Those that choose their own.
        let adaptive = known.iter().filter(|(row, _)| row.line().is_adaptive());
        let adaptive: Vec<(&Row, f64)> = adaptive.copied().collect();
        if let Some(found) = fastest(&adaptive) {
            return found;
        }
        match rows.iter().min_by(|(_, a), (_, b)| a.total_cmp(b)) {
            Some((row, error)) => {
                let (aim, floor) = (si(AIM_M, "m"), self.floor());
                let none = if floor > AIM_M {
                    let floor = si(floor, "m");
                    format!(
                        "{aim} cannot be told here: the floor is {floor}; the nearest at {step}"
                    )
                } else {
                    format!("No method comes within {aim} at {step}; the nearest")
                };
                format!(
                    "{none} is {} with {} at {} real time.",
                    row.line().name(),
                    si(*error, "m"),
                    grouped_factor(speed(row))
                )
            }
            None => {
                "No error is known: there is no reference, or nothing came to the end.".to_owned()
            }
        }
    }

    /// The method whose steps may be longest and are right, and the one whose may not be long.
    fn stable(&self) -> String {
        let rows = self.rows.iter();
        let limits: Vec<(&Row, f64)> = rows
            .filter(|row| row.scales == Scales::AS_IS && row.status == Status::Ok)
            .filter_map(|row| Some((row, row.largest_stable_step_s?)))
            .collect();
        let right = limits
            .iter()
            .rev()
            .filter_map(|(row, limit)| Some((row, *limit, row.largest_right_step_s?)));
        let longest = right.max_by(|a, b| a.2.total_cmp(&b.2));
        let shortest = limits.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let (Some((row, limit, right)), Some((short, least))) = (longest, shortest) else {
            return "No step is both stable and right.".to_owned();
        };
        let beyond = match row.least_unstable_step_s {
            Some(_) => "",
            None => " and beyond",
        };
        let bound = if right < limit {
            format!(
                "right to {} and stable to {}{beyond}",
                si(right, "s"),
                si(limit, "s")
            )
        } else {
            format!("stable and right to {}{beyond}", si(limit, "s"))
        };
        format!(
            "{} is {bound}; {} is stable to {} only.",
            row.line().name(),
            short.line().name(),
            si(*least, "s")
        )
    }
}
