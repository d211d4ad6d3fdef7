//! A study in a sentence.

use crate::dominance::Dominance;
use crate::factory::Scales;
use crate::number::{grouped_factor, method_setting, si};
use crate::row::{Row, RowKind, Status};
use crate::study::{Study, StudyKind};

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

/// The row that a study of precision is summed up by.
pub(crate) struct Foremost<'s> {
    pub(crate) row: &'s Row,
    pub(crate) error_m: f64,
    pub(crate) choice: Choice,
}

/// How it was chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Choice {
    /// The fastest within the aim at the usual step.
    Fastest,
    /// Where there is none, the fastest within the aim of those that choose their steps.
    FastestAdaptive,
    /// Where there is none either, the smallest error at the usual step.
    Nearest,
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

    /// The rows that a headline may be about: runs of the most thorough model that came to their end, and their errors.
    pub(crate) fn candidates(&self) -> Vec<(&Row, f64)> {
        let massive = |row: &&Row| self.massive.is_empty() || self.massive.contains(&row.plant);
        let rows = self.rows.iter().filter(massive);
        rows.filter(|row| row.kind == RowKind::Integration && row.status == Status::Ok)
            .filter_map(|row| Some((row, row.error_rms_m?)))
            .collect()
    }

    /// The row that the headline, a card and the table name; none if no error is known.
    pub(crate) fn foremost(&self) -> Option<Foremost<'_>> {
        let known = self.candidates();
        let of = |wanted: fn(&Row) -> bool| {
            let rows = known.iter().filter(move |(row, _)| wanted(row));
            rows.copied().collect::<Vec<_>>()
        };
        let fastest = |rows: &[(&'_ Row, f64)]| {
            let within = rows.iter().enumerate();
            let within = within.filter(|(_, (_, error))| *error <= AIM_M);
            let speed = |row: &Row| row.real_time_factor.unwrap_or(0.0);
            // Of several that are alike, the first.
            let best = within
                .rev()
                .max_by(|(_, (a, _)), (_, (b, _))| speed(a).total_cmp(&speed(b)));
            best.map(|(place, _)| place)
        };
        let usual = of(at_usual_step);
        let adaptive = of(|row| row.line().is_adaptive());
        let nearest = |rows: &[(&'_ Row, f64)]| {
            let rows = rows.iter().enumerate();
            let nearest = rows.min_by(|(_, (_, a)), (_, (_, b))| a.total_cmp(b));
            nearest.map(|(place, _)| place)
        };
        let (rows, place, choice) = if let Some(place) = fastest(&usual) {
            (usual, place, Choice::Fastest)
        } else if let Some(place) = fastest(&adaptive) {
            (adaptive, place, Choice::FastestAdaptive)
        } else {
            let place = nearest(&usual)?;
            (usual, place, Choice::Nearest)
        };
        let (row, error_m) = rows[place];
        Some(Foremost {
            row,
            error_m,
            choice,
        })
    }

    fn precise(&self) -> String {
        let Some(Foremost {
            row,
            error_m,
            choice,
        }) = self.foremost()
        else {
            return "No error is known: there is no reference, or nothing came to the end."
                .to_owned();
        };
        let name = row.line().name();
        let speed = grouped_factor(row.real_time_factor.unwrap_or(0.0));
        let (error, aim, step) = (si(error_m, "m"), si(AIM_M, "m"), si(USUAL_STEP_S, "s"));
        match choice {
            Choice::Fastest | Choice::FastestAdaptive => {
                let setting = method_setting(row.step_s, row.tolerance);
                format!("{name} at {setting}: {error} at {speed} real time.")
            }
            Choice::Nearest => {
                let floor = self.floor();
                let none = if floor > AIM_M {
                    let floor = si(floor, "m");
                    format!(
                        "{aim} cannot be told here: the floor is {floor}; the nearest at {step}"
                    )
                } else {
                    format!("No method comes within {aim} at {step}; the nearest")
                };
                format!("{none} is {name} with {error} at {speed} real time.")
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
