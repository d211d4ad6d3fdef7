//! A picture of a run at an instant, for places that show no pages: the robot from its right side,
//! and the footsteps around.

use std::fmt::Write as _;
use std::ops::Range;

use twinrig_record::{FrameSeries, RecordError};
use twinrig_report::html::element::escaped;

use crate::figure::JOINTS;
use crate::gait::{LegGait, gait};
use crate::run::Run;

/// Size \[px\], and that of the robot's part and of a leg's lane.
const WIDTH: f64 = 640.0;
const ROBOT: f64 = 190.0;
const LANE: f64 = 16.0;
/// Names of the legs are left of the lanes \[px\].
const NAMES: f64 = 34.0;
/// Time before and after the instant \[s\].
const AROUND: f64 = 0.75;
/// Scale of the robot: metres across the picture, for one whose hips are a metre apart.
const ROBOTS_ACROSS: f64 = 4.2;
/// Colours of the legs.
const COLOURS: [&str; 4] = ["#0a64ad", "#cf4a0a", "#14875e", "#a83f86"];

/// Returns an SVG picture of a run at the instant `at` \[s\]; none without coordinate frames of
/// legs.
///
/// # Errors
/// A message of the recording cannot be decoded.
pub fn picture(run: &Run<'_>, at: f64) -> Result<Option<String>, RecordError> {
    let frames = run.shown().frames()?;
    let sample = frames
        .times
        .iter()
        .rposition(|time| time.as_secs_f64() <= at + 1e-9);
    let Some(places) = sample.map(|sample| places(&frames, sample)) else {
        return Ok(None);
    };
    let legs = legs(&frames);
    if legs.is_empty() {
        return Ok(None);
    }
    let gait = gait(run, legs.iter().map(|(name, _)| name.as_str()))?;
    let height = ROBOT + LANE * gait.len() as f64 + 8.0;
    let title = escaped(&format!("{} at {at:.3} s", run.name()));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" \
         width=\"{WIDTH}\" height=\"{height}\" role=\"img\" aria-label=\"{title}\" \
         font-family=\"sans-serif\" font-size=\"11\"><rect width=\"100%\" height=\"100%\" \
         fill=\"#ffffff\"/><text x=\"8\" y=\"16\">{title}</text>"
    );
    robot(&mut svg, &places, &legs);
    for (index, of) in gait.iter().enumerate() {
        lane(&mut svg, index, of, at);
    }
    let x = time(0.0);
    line(&mut svg, [[x, ROBOT], [x, height - 8.0]], "#1d2126", 1.2);
    svg += "</svg>\n";
    Ok(Some(svg))
}

/// Returns the position in the world of each frame of a sample, in the order of the links.
fn places(frames: &FrameSeries, sample: usize) -> Vec<[f64; 3]> {
    const NUMBERS: usize = 7;
    let width = NUMBERS * frames.links.len();
    let numbers = frames.numbers[sample * width..].chunks_exact(NUMBERS);
    let mut poses: Vec<([f64; 3], [f64; 4])> = Vec::with_capacity(frames.links.len());
    for ([parent, _], numbers) in frames.links.iter().zip(numbers) {
        let at: [f64; 3] = std::array::from_fn(|n| numbers[n]);
        let turn: [f64; 4] = std::array::from_fn(|n| numbers[3 + n]);
        let parent = frames.links.iter().position(|[_, child]| child == parent);
        let pose = match parent.and_then(|index| poses.get(index)) {
            None => (at, turn),
            Some(&(origin, attitude)) => {
                let at = rotated(attitude, at);
                (
                    std::array::from_fn(|n| origin[n] + at[n]),
                    product(attitude, turn),
                )
            }
        };
        poses.push(pose);
    }
    poses.into_iter().map(|(at, _)| at).collect()
}

/// Rotates a vector by a unit quaternion x, y, z, w.
fn rotated([x, y, z, w]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let cross = |b: [f64; 3]| {
        [
            y * b[2] - z * b[1],
            z * b[0] - x * b[2],
            x * b[1] - y * b[0],
        ]
    };
    let once = cross(v);
    let twice = cross(once);
    std::array::from_fn(|n| v[n] + 2.0 * (w * once[n] + twice[n]))
}

/// Returns the rotation by `b`, then by `a`.
fn product([ax, ay, az, aw]: [f64; 4], [bx, by, bz, bw]: [f64; 4]) -> [f64; 4] {
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

/// Returns the names of the legs, and the indices of their links, from the hip down.
fn legs(frames: &FrameSeries) -> Vec<(String, Range<usize>)> {
    let legs = frames.legs().into_iter();
    legs.map(|leg| (leg.name, leg.upper..leg.upper + JOINTS))
        .collect()
}

/// Draws trunk and legs, the left ones first, which are behind.
fn robot(svg: &mut String, places: &[[f64; 3]], legs: &[(String, Range<usize>)]) {
    let hips = legs.iter().map(|(_, links)| places[links.start]);
    let hips: Vec<[f64; 3]> = hips.collect();
    let span = |axis: usize| {
        let values = hips.iter().map(|hip| hip[axis]);
        let least = values.clone().fold(f64::INFINITY, f64::min);
        [least, values.fold(f64::NEG_INFINITY, f64::max)]
    };
    let [back, front] = span(0);
    let scale = WIDTH / (ROBOTS_ACROSS * (front - back).max(0.05));
    let middle = 0.5 * (back + front);
    let place = |at: [f64; 3]| {
        [
            0.5 * WIDTH + (at[0] - middle) * scale,
            ROBOT - 26.0 - at[2] * scale,
        ]
    };
    line(
        svg,
        [[0.0, ROBOT - 26.0], [WIDTH, ROBOT - 26.0]],
        "#9aa5af",
        1.0,
    );
    let [trunk_back, trunk_front] = [back, front].map(|x| {
        let hip = hips.iter().find(|hip| hip[0] == x).copied();
        place(hip.unwrap_or([x, 0.0, 0.0]))
    });
    line(svg, [trunk_back, trunk_front], "#5c6670", 9.0);
    let mut order: Vec<usize> = (0..legs.len()).collect();
    order.sort_by(|a, b| hips[*b][1].total_cmp(&hips[*a][1]));
    for index in order {
        let (name, links) = &legs[index];
        let colour = COLOURS[index % COLOURS.len()];
        let points: Vec<[f64; 2]> = places[links.clone()].iter().map(|at| place(*at)).collect();
        for pair in points.windows(2) {
            line(svg, [pair[0], pair[1]], colour, 4.0);
        }
        if let Some([x, y]) = points.last() {
            let name = escaped(name);
            // Writing to a string cannot fail.
            let _ = write!(
                svg,
                "<text x=\"{x:.1}\" y=\"{:.1}\" fill=\"{colour}\" text-anchor=\"middle\">{name}</text>",
                y + 15.0
            );
        }
    }
}

/// Returns the place of a time relative to the instant \[px\].
fn time(after: f64) -> f64 {
    let share = (after + AROUND) / (2.0 * AROUND);
    NAMES + (WIDTH - NAMES - 8.0) * share.clamp(0.0, 1.0)
}

/// Draws the footsteps of a leg.
fn lane(svg: &mut String, index: usize, of: &LegGait, at: f64) {
    let y = ROBOT + LANE * index as f64;
    let colour = COLOURS[index % COLOURS.len()];
    let name = escaped(&of.leg);
    let _ = write!(
        svg,
        "<text x=\"6\" y=\"{:.1}\" fill=\"{colour}\">{name}</text>",
        y + 12.0
    );
    for step in &of.footsteps {
        if step.to < at - AROUND || step.from > at + AROUND {
            continue;
        }
        let [from, to] = [step.from, step.to].map(|edge| time(edge - at));
        let _ = write!(
            svg,
            "<rect x=\"{from:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{colour}\"/>",
            y + 3.0,
            (to - from).max(1.0),
            LANE - 6.0
        );
    }
}

fn line(svg: &mut String, [[x, y], [u, v]]: [[f64; 2]; 2], colour: &str, width: f64) {
    let _ = write!(
        svg,
        "<path d=\"M{x:.1} {y:.1}L{u:.1} {v:.1}\" stroke=\"{colour}\" stroke-width=\"{width}\" \
         stroke-linecap=\"round\"/>"
    );
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::SimTime;

    use super::*;

    #[test]
    fn places_follow_from_rotations_of_parents() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let link = |parent: &str, child: &str| [parent.to_owned(), child.to_owned()];
        let frames = FrameSeries {
            links: vec![
                link("world", "trunk"),
                link("trunk", "LF_upper"),
                link("LF_upper", "LF_middle"),
            ],
            times: vec![SimTime::ZERO],
            // The trunk is turned by 90° about z, the hip by −90° about y.
            numbers: [
                [1.0, 2.0, 3.0, 0.0, 0.0, half, half],
                [0.5, 0.0, 0.0, 0.0, -half, 0.0, half],
                [0.0, 0.0, -0.25, 0.0, 0.0, 0.0, 1.0],
            ]
            .concat(),
        };
        let places = places(&frames, 0);
        for (place, expected) in places.iter().zip([
            [1.0, 2.0, 3.0],
            [1.0, 2.5, 3.0],
            // Down is forward of the trunk, which is y of the world.
            [1.0, 2.75, 3.0],
        ]) {
            for (found, expected) in place.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12, "{place:?}");
            }
        }
    }
}
