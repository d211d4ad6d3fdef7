//! The robot in motion: poses of trunk and legs, forces and ground.

use serde::Serialize;
use twinrig_kernel::{SimTime, signal};
use twinrig_record::{FrameSeries, LegLinks, RecordError, Recording};

use crate::columns::{Column, Columns};
use crate::run::Run;

/// Poses and forces over time, of which a script draws the robot.
#[derive(Debug, Serialize)]
pub(crate) struct Figure {
    /// Times \[s\].
    times: Column,
    /// Position x, y, z of the trunk \[m\] and its orientation as a quaternion x, y, z, w.
    trunk: Vec<Column>,
    legs: Vec<Leg>,
    /// Force of pushes on the trunk \[N\], if there are any.
    push: Option<Vec<Column>>,
    /// Force of the ground on the trunk \[N\], if there is any.
    contact: Option<Vec<Column>>,
    ground: Option<Ground>,
    /// Weight of the robot \[N\], which scales the arrows; none if it is not known.
    weight: Option<f64>,
}

/// A leg: hip, knee, ankle and foot.
#[derive(Debug, Serialize)]
struct Leg {
    name: String,
    /// Hip in the trunk, knee in the thigh, ankle in the shank, foot in the last segment \[m\].
    offsets: [[f64; 3]; 4],
    /// Angles of the segments relative to their parents, forward \[rad\].
    angles: Vec<Column>,
    /// Joint of abduction, if there is any that moves.
    abduction: Option<Abduction>,
    /// Force of the ground on the foot \[N\]; its normal component if no other is known.
    force: Option<Vec<Column>>,
    /// Force of pushes on the foot \[N\].
    push: Option<Vec<Column>>,
    /// Force of the ground on knee and ankle \[N\], if there is any.
    segments: Option<Vec<Column>>,
}

/// Joint of abduction of a leg.
#[derive(Debug, Serialize)]
struct Abduction {
    /// Point of its axis in the trunk \[m\].
    axis: [f64; 3],
    /// Angle to the left \[rad\].
    angle: Column,
}

/// Height of the ground along the path of the robot.
#[derive(Debug, Serialize)]
struct Ground {
    x: Column,
    y: f64,
    z: Column,
}

/// Transforms of a leg: hip, knee, ankle, foot.
pub(crate) const JOINTS: usize = 4;
/// Numbers of a transform.
pub(crate) const NUMBERS: usize = 7;

impl Figure {
    /// Returns the figure of a run; none without recorded coordinate frames.
    pub(crate) fn of(run: &Run<'_>, columns: &mut Columns) -> Result<Option<Self>, RecordError> {
        let recording = run.shown();
        let frames = recording.frames()?;
        let legs = frames.legs();
        if frames.times.is_empty() || legs.is_empty() {
            return Ok(None);
        }
        let seconds: Vec<f64> = frames.times.iter().map(|at| at.as_secs_f64()).collect();
        let trunk: Vec<Vec<f64>> = (0..NUMBERS).map(|n| numbers(&frames, 0, n)).collect();
        let forces = |columns: &mut Columns, name: &str, size: usize| {
            let sampled = at_times(recording, name, size, &frames.times)?;
            let is_there = sampled.iter().flatten().any(|force| *force != 0.0);
            is_there.then(|| sampled.iter().map(|axis| columns.add(axis)).collect())
        };
        let legs = legs.into_iter().map(|leg| {
            let LegLinks { upper, .. } = leg;
            let angle = |link: usize, axis: usize, of: fn(f64, f64) -> f64| {
                let (sin, cos) = (numbers(&frames, link, axis), numbers(&frames, link, 6));
                let angles = sin.iter().zip(&cos);
                angles.map(|(sin, cos)| of(*sin, *cos)).collect::<Vec<_>>()
            };
            let angles = (0..JOINTS - 1).map(|joint| angle(upper + joint, 4, forward_angle));
            let angles = angles.map(|angles| columns.add(&angles)).collect();
            let abduction = leg.abductor.and_then(|link| {
                let angles = angle(link, 3, leftward_angle);
                let moves = angles.iter().any(|angle| *angle != 0.0);
                moves.then(|| Abduction {
                    axis: position(&frames.numbers, link),
                    angle: columns.add(&angles),
                })
            });
            let offsets = offsets(&frames.numbers, &leg);
            let name = leg.name;
            let force = forces(columns, &signal::of_leg(&name, signal::FOOT_FORCE), 3);
            let mut load = || {
                let name = signal::of_leg(&name, signal::FOOT_LOAD);
                let load = at_times(recording, &name, 1, &frames.times)?.swap_remove(0);
                let none = vec![0.0; load.len()];
                Some([&none, &none, &load].map(|axis| columns.add(axis)).into())
            };
            Leg {
                force: match force {
                    Some(force) => Some(force),
                    None => load(),
                },
                push: forces(columns, &signal::of_leg(&name, signal::PUSH_FORCE), 3),
                segments: forces(columns, &signal::of_leg(&name, signal::SEGMENTS_FORCE), 3),
                offsets,
                angles,
                abduction,
                name,
            }
        });
        let legs = legs.collect();
        Ok(Some(Self {
            times: columns.add_fine(&seconds),
            ground: Ground::below(run, [&trunk[0], &trunk[1]], columns),
            trunk: trunk.iter().map(|numbers| columns.add(numbers)).collect(),
            legs,
            push: forces(columns, signal::BODY_PUSH_FORCE, 3),
            contact: forces(columns, signal::BODY_CONTACT_FORCE, 3),
            weight: run.assembly().map(|assembly| assembly.scene().weight),
        }))
    }

    /// Returns the names of the legs.
    pub(crate) fn legs(&self) -> impl Iterator<Item = &str> {
        self.legs.iter().map(|leg| leg.name.as_str())
    }
}

/// Returns the angle of a segment relative to its parent from the components y and w of its
/// quaternion: a rotation about y, which points left, by the negative angle.
pub(crate) fn forward_angle(y: f64, w: f64) -> f64 {
    -2.0 * libm::atan2(y, w)
}

/// Returns the angle of abduction from the components x and w of its quaternion.
pub(crate) fn leftward_angle(x: f64, w: f64) -> f64 {
    2.0 * libm::atan2(x, w)
}

/// Returns the position of a link in its parent, of the transforms of an instant \[m\].
pub(crate) fn position(numbers: &[f64], link: usize) -> [f64; 3] {
    [0, 1, 2].map(|n| numbers[NUMBERS * link + n])
}

/// Returns the positions of hip in the trunk, knee in the thigh, ankle in the shank and foot in the
/// last segment, of the transforms of an instant \[m\]. The joint of abduction is at zero.
pub(crate) fn offsets(numbers: &[f64], leg: &LegLinks) -> [[f64; 3]; JOINTS] {
    let mut offsets = [0, 1, 2, 3].map(|joint| position(numbers, leg.upper + joint));
    if let Some(abductor) = leg.abductor {
        let axis = position(numbers, abductor);
        offsets[0] = [0, 1, 2].map(|n| offsets[0][n] + axis[n]);
    }
    offsets
}

/// Returns a number of a transform over time.
fn numbers(frames: &FrameSeries, link: usize, number: usize) -> Vec<f64> {
    let width = NUMBERS * frames.links.len();
    let of_frame = frames.numbers.chunks_exact(width);
    of_frame.map(|all| all[NUMBERS * link + number]).collect()
}

/// Returns the components of a signal of the plant at the last sample up to each of `times`; none
/// without the signal.
fn at_times(
    recording: &Recording,
    name: &str,
    size: usize,
    times: &[SimTime],
) -> Option<Vec<Vec<f64>>> {
    let series = recording.series(name).ok()?;
    if series.signal.size != size || series.times.is_empty() {
        return None;
    }
    let mut sampled = vec![Vec::with_capacity(times.len()); size];
    let mut index = 0;
    for at in times {
        while series.times.get(index + 1).is_some_and(|next| next <= at) {
            index += 1;
        }
        for (component, values) in sampled.iter_mut().enumerate() {
            values.push(series.values[size * index + component]);
        }
    }
    Some(sampled)
}

impl Ground {
    /// Places at which the height is taken.
    const PLACES: usize = 400;
    /// Distance before and behind the path \[m\].
    const BEYOND: f64 = 1.0;

    /// Returns the ground along the path of the trunk; none if it is not known.
    fn below(run: &Run<'_>, [x, y]: [&Vec<f64>; 2], columns: &mut Columns) -> Option<Self> {
        let ground = &run.assembly()?.scene().ground;
        let finite = || x.iter().copied().filter(|x| x.is_finite());
        let from = finite().fold(f64::INFINITY, f64::min) - Self::BEYOND;
        let to = finite().fold(f64::NEG_INFINITY, f64::max) + Self::BEYOND;
        if from > to {
            return None;
        }
        let middle = y.first().copied().filter(|y| y.is_finite())?;
        let places =
            (0..=Self::PLACES).map(|n| from + (to - from) * n as f64 / Self::PLACES as f64);
        let places: Vec<f64> = places.collect();
        let heights = places.iter().map(|x| ground.height(*x, middle));
        let heights: Vec<f64> = heights.collect::<Option<_>>()?;
        Some(Self {
            x: columns.add(&places),
            y: middle,
            z: columns.add(&heights),
        })
    }
}
