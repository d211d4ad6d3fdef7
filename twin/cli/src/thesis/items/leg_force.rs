//! Force of the massless leg (section 2.7.1).

use std::f64::consts::{PI, TAU};

use libm::{cos, sin, sqrt};
use twinrig_robot::Toe;
use twinrig_robot::leg::{Pantograph, Planar};

use crate::error::ThesisError;
use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Measurement, Rule};

/// Greatest axial stiffness of a leg, and that of its diagonal spring \[N/m\].
const STIFFNESS: f64 = 253.27;
const DIAGONAL: f64 = 4400.0;

/// Ranges over which the stiffness is greatest: lengths as shares of the longest leg in a
/// direction, and directions of the foot against the axis of the leg \[rad\]. The range of the
/// figure is not printed.
const LENGTHS: [f64; 2] = [0.75, 0.97];
const DIRECTIONS: [f64; 2] = [-0.5, 0.5];
/// Intervals of both ranges.
const INTERVALS: u32 = 20;
/// Step of second differences of the energy \[m\].
const STEP: f64 = 2e-4;
/// Hip angles at which a minimum of the energy is sought, and steps that refine it.
const HIPS: u32 = 1000;
const REFINEMENTS: u32 = 60;

pub(crate) const FIG_2_9: Item = Item {
    id: "fig-2-9",
    title: "Force of the massless leg",
    place: "2.7.1, figure 2.9",
    run_s: 1.0,
    figures: &[
        PrintedFigure::value(
            "closed",
            "greatest axial stiffness without foot, up to 0.98 of the length",
            "2.7.1, figure 2.9",
            STIFFNESS,
            "N/m",
        )
        .rule(Rule::Within(0.01), "the geometry has three digits")
        .remark(
            "the geometry of the leg is not printed; that of the robot file was chosen to give \
             this stiffness from the printed springs. It rises to 260 N/m at 0.995 of the length",
        ),
        PrintedFigure::value(
            "stiffness",
            "the same with the spring of the foot, over lengths and directions (eqs. 2.21, 2.22)",
            "2.7.1, figure 2.9",
            STIFFNESS,
            "N/m",
        )
        .rule(Rule::Within(0.01), "as above")
        .remark(
            "geometry of the leg and range of the figure are not printed; here 0.75 to 0.97 of the \
             length and ±29°",
        ),
        PrintedFigure::value(
            "ratio",
            "stiffness of the diagonal spring over the printed one",
            "2.7.1, figure 2.9",
            10.0,
            "×",
        )
        .rule(Rule::Factor(2.0), "\"one order of magnitude\""),
    ],
    sources: &[
        Source::of(
            &["closed"],
            Basis::Given,
            &[
                Input::Fitted("geometry of the leg"),
                Input::Set("printed springs"),
            ],
        ),
        Source::of(
            &["stiffness"],
            Basis::Substitute,
            &[
                Input::Fitted("geometry of the leg"),
                Input::Set("springs of leg and foot"),
                Input::Free("stiffness with the foot"),
            ],
        ),
        Source::of(
            &["ratio"],
            Basis::Arithmetic,
            &[Input::Set("printed stiffnesses")],
        ),
    ],
    measure: fig_2_9,
    commands: &["cargo test -p twinrig-robot greatest_axial_stiffness"],
};

fn fig_2_9(context: &Context<'_>) -> Result<Measurements, TwinError> {
    const FILE: &str = "passive-legs.toml";
    let assembly = context.assembly(FILE)?;
    let lacks = |what| ThesisError::Lacks {
        file: FILE.to_owned(),
        what,
    };
    let robot = assembly.robot();
    let leg = robot.and_then(|robot| robot.legs.first());
    let leg = &leg.ok_or_else(|| lacks("leg"))?.leg;
    let toe = leg.toe.as_ref().ok_or_else(|| lacks("toe"))?;
    let pantograph = Pantograph::new(leg).map_err(ThesisError::from)?;
    let closed = pantograph.greatest_axial_stiffness();
    let mut found = Measurements::default();
    found.set("closed", closed.map_err(ThesisError::from)?);
    let greatest = FootedLeg { pantograph, toe }.greatest_stiffness();
    found.add("stiffness", greatest.map(Measurement::exact));
    found.set("ratio", DIAGONAL / STIFFNESS);
    Ok(found)
}

/// Massless leg that stands on the tip of its foot.
struct FootedLeg<'t> {
    pantograph: Pantograph,
    toe: &'t Toe,
}

impl FootedLeg<'_> {
    /// Returns the greatest second derivative of the least energy over the length; none if the leg
    /// reaches no length of the range.
    fn greatest_stiffness(&self) -> Option<f64> {
        let point =
            |[from, to]: [f64; 2], n: u32| from + (to - from) * f64::from(n) / f64::from(INTERVALS);
        let directions = (0..=INTERVALS).map(|n| point(DIRECTIONS, n));
        let stiffness = directions.flat_map(|direction| {
            let longest = self.longest(direction);
            let lengths = (0..=INTERVALS).map(move |n| point(LENGTHS, n) * longest);
            lengths.filter_map(move |length| {
                let energy = |length| self.energy(length, direction);
                let [shorter, longer] = [energy(length - STEP)?, energy(length + STEP)?];
                Some((shorter - 2.0 * energy(length)? + longer) / (STEP * STEP))
            })
        });
        stiffness.reduce(f64::max)
    }

    /// Returns the greatest distance from hip to tip, the leg straight \[m\].
    fn longest(&self, direction: f64) -> f64 {
        let (leg, foot) = (self.pantograph.length_max(), self.toe.length);
        let across = foot * sin(direction);
        sqrt(leg * leg - across * across) + foot * cos(direction)
    }

    /// Returns the least energy of all springs at a distance from hip to tip \[J\]; none beyond the
    /// stops.
    fn energy(&self, length: f64, direction: f64) -> Option<f64> {
        let (across, along) = (sin(direction), cos(direction));
        let foot = Planar::new(-self.toe.length * across, self.toe.length * along - length);
        let energy = |hip: f64| {
            let pose = self.pantograph.pose(sin(hip), cos(hip), foot).ok()?;
            let [_, _, third] = pose.angles();
            let bend = direction - third - self.toe.rest;
            let springs = self.pantograph.spring_energy(&pose);
            let is_allowed = self.pantograph.allows(&pose);
            is_allowed.then_some(springs + 0.5 * self.toe.stiffness * bend * bend)
        };
        let step = TAU / f64::from(HIPS);
        let hips = (0..HIPS).map(|n| step * f64::from(n) - PI);
        let found = hips.filter_map(|hip| Some((hip, energy(hip)?)));
        let (hip, least) = found.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let [mut low, mut high] = [hip - step, hip + step];
        for _ in 0..REFINEMENTS {
            let third = (high - low) / 3.0;
            let energy = |hip| energy(hip).unwrap_or(f64::INFINITY);
            if energy(low + third) < energy(high - third) {
                high -= third;
            } else {
                low += third;
            }
        }
        let refined = energy(0.5 * (low + high)).unwrap_or(f64::INFINITY);
        Some(refined.min(least))
    }
}

#[cfg(test)]
mod tests {
    use twinrig_robot::Leg;

    use super::*;

    /// With a rigid foot in line with its direction the leg is the one without a foot, longer by
    /// the foot.
    #[test]
    fn leg_on_a_foot_that_does_not_bend_is_the_leg_alone() {
        let leg = Leg::example();
        let alone = Pantograph::new(&leg).unwrap();
        let toe = Toe {
            length: 0.0,
            stiffness: 0.0,
            rest: 0.0,
        };
        let footed = FootedLeg {
            pantograph: Pantograph::new(&leg).unwrap(),
            toe: &toe,
        };
        for share in [0.8, 0.9, 0.97] {
            let length = share * alone.length_max();
            let energy = |length| footed.energy(length, 0.0).unwrap();
            let second = energy(length - STEP) - 2.0 * energy(length) + energy(length + STEP);
            let (ours, known) = (
                second / (STEP * STEP),
                alone.axial_stiffness(length).unwrap(),
            );
            // Both are differences over steps of 0.1 and 0.2 mm.
            assert!((ours / known - 1.0).abs() < 0.01, "{ours} {known}");
        }
    }
}
