//! Summary of a study in one or two sentences.

use twinrig_report::number::{grouped_factor, method_setting, si};
use twinrig_rig::Scales;

use crate::plants::dominance::{Comparison, Dominance};
use crate::plants::row::{Row, RowKind, Status};
use crate::plants::study::{Study, StudyKind};

/// Usual step of the plants \[s\], and the error aimed for \[m\].
pub(crate) const USUAL_STEP_S: f64 = 2e-3;
pub(crate) const AIM_M: f64 = 1e-6;

/// Returns whether a row has the usual step.
pub(crate) fn at_usual_step(row: &Row) -> bool {
    row.step_s
        .is_some_and(|step| (step / USUAL_STEP_S - 1.0).abs() < 1e-9)
}

/// Compares a plant with the best settings of others that solve its model, in one sentence.
pub(crate) fn dominance_sentence(dominance: &Dominance) -> String {
    let of = &dominance.of;
    let count = dominance.best().count();
    let behind: Vec<String> = dominance
        .best()
        .filter(|comparison| !comparison.is_won())
        .map(compared_setting)
        .collect();
    let ranges = dominance.over.iter().map(|plant| {
        let range = dominance.range(plant, None);
        range.map_or_else(
            || format!("{plant} is more accurate than {of} at all of its best settings"),
            |(least, most)| format!("{} less run time than {plant}", spread(least, most)),
        )
    });
    let ranges = ranges.collect::<Vec<_>>().join(", ");
    let whose = match &dominance.over[..] {
        [plant] => format!("{plant}'s"),
        _ => "their".to_owned(),
    };
    let at = if dominance.own_references {
        "Each against its own reference, at"
    } else {
        "At"
    };
    if behind.is_empty() {
        format!(
            "{at} no greater error {of} takes {ranges}: it is ahead at all of {whose} {count} best settings."
        )
    } else {
        format!(
            "{at} no greater error {of} takes {ranges}: it is ahead at {} of {whose} {count} best settings, and not at {}.",
            count - behind.len(),
            behind.join("; ")
        )
    }
}

/// Formats a range of factors: `3.1 × to 40 ×`.
pub(crate) fn spread(least: f64, most: f64) -> String {
    let [least, most] = [least, most].map(grouped_factor);
    if least == most {
        least
    } else {
        format!("{least} to {most}")
    }
}

/// Formats the compared setting with its error and its speed.
fn compared_setting(comparison: &Comparison) -> String {
    format!(
        "{} {} at {} ({} at {} real time)",
        comparison.plant,
        comparison.method,
        method_setting(comparison.step_s, comparison.tolerance),
        si(comparison.error_rms_m, "m"),
        grouped_factor(1.0 / comparison.run_s_per_simulated_s)
    )
}

/// Row that summarises a study of precision.
pub(crate) struct HeadlineRow<'s> {
    pub(crate) row: &'s Row,
    pub(crate) error_m: f64,
    pub(crate) choice: Choice,
}

/// Criterion by which the headline row was selected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Choice {
    /// Fastest row within the aim at the usual step.
    Fastest,
    /// Otherwise the fastest adaptive row within the aim.
    FastestAdaptive,
    /// Otherwise the smallest error at the usual step.
    Nearest,
}

impl Study {
    /// Returns a summary in one or two sentences.
    pub fn headline(&self) -> String {
        match self.kind {
            StudyKind::Precision => {
                let all = self.dominances();
                let sentences = all.iter().map(dominance_sentence);
                let sentences = std::iter::once(self.precision_headline()).chain(sentences);
                sentences.collect::<Vec<_>>().join(" ")
            }
            StudyKind::Stability => self.stability_headline(),
        }
    }

    /// Returns the completed runs of the plants with segment masses, with their errors: the
    /// candidates for the headline.
    pub(crate) fn candidates(&self) -> Vec<(&Row, f64)> {
        let massive = |row: &&Row| self.massive.is_empty() || self.massive.contains(&row.plant);
        let rows = self.rows.iter().filter(massive);
        rows.filter(|row| row.kind == RowKind::Integration && row.status == Status::Ok)
            .filter_map(|row| Some((row, row.error_rms_m?)))
            .collect()
    }

    /// Returns the row named by headline, card and table; `None` if no error is known.
    pub(crate) fn headline_row(&self) -> Option<HeadlineRow<'_>> {
        let known = self.candidates();
        let of = |accept: fn(&Row) -> bool| {
            let rows = known.iter().filter(move |(row, _)| accept(row));
            rows.copied().collect::<Vec<_>>()
        };
        let fastest = |rows: &[(&'_ Row, f64)]| {
            let within = rows.iter().enumerate();
            let within = within.filter(|(_, (_, error))| *error <= AIM_M);
            let speed = |row: &Row| row.real_time_factor.unwrap_or(0.0);
            // Of equal rows, the first.
            let best = within
                .rev()
                .max_by(|(_, (a, _)), (_, (b, _))| speed(a).total_cmp(&speed(b)));
            best.map(|(place, _)| place)
        };
        let usual = of(at_usual_step);
        let adaptive = of(|row| row.series().is_adaptive());
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
        Some(HeadlineRow {
            row,
            error_m,
            choice,
        })
    }

    fn precision_headline(&self) -> String {
        let Some(HeadlineRow {
            row,
            error_m,
            choice,
        }) = self.headline_row()
        else {
            return "No error is known: there is no reference, or no run completed.".to_owned();
        };
        let name = row.series().name();
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
                        "{aim} cannot be resolved: the floor is {floor}; the smallest error at \
                         {step}"
                    )
                } else {
                    format!("No method is within {aim} at {step}; the smallest error")
                };
                format!("{none} is that of {name}: {error} at {speed} real time.")
            }
        }
    }

    /// Returns the summary of a stability study: the method with the largest accurate step, and
    /// that with the smallest limit.
    fn stability_headline(&self) -> String {
        let rows = self.rows.iter();
        let limits: Vec<(&Row, f64)> = rows
            .filter(|row| row.scales == Scales::AS_IS && row.status == Status::Ok)
            .filter_map(|row| Some((row, row.largest_stable_step_s?)))
            .collect();
        let accurate = limits
            .iter()
            .rev()
            .filter_map(|(row, limit)| Some((row, *limit, row.largest_right_step_s?)));
        let longest = accurate.max_by(|a, b| a.2.total_cmp(&b.2));
        let shortest = limits.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let (Some((row, limit, accurate)), Some((short, least))) = (longest, shortest) else {
            return "No step is both stable and accurate.".to_owned();
        };
        let beyond = match row.least_unstable_step_s {
            Some(_) => "",
            None => " and beyond",
        };
        let bound = if accurate < limit {
            format!(
                "accurate up to {} and stable up to {}{beyond}",
                si(accurate, "s"),
                si(limit, "s")
            )
        } else {
            format!("stable and accurate up to {}{beyond}", si(limit, "s"))
        };
        format!(
            "{} is {bound}; {} is stable up to {} only.",
            row.series().name(),
            short.series().name(),
            si(*least, "s")
        )
    }
}
