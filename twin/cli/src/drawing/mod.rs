//! Drawing of a robot as an SVG page: its legs to scale, extended and bent, with their dimensions;
//! the robot from the side and from above; a table of the symbols. Points come from the kinematics
//! of the plants.

mod body;
mod canvas;
mod leg;
mod panel;
mod symbols;
#[cfg(test)]
mod tests;

use twinrig_robot::leg::LegError;
use twinrig_robot::{Robot, RobotFile};

use body::{SeenRobot, View};
use canvas::{Canvas, LINE, Rect, truncated};
use leg::PosedLeg;
use panel::{Frame, Panel};

pub(crate) use canvas::Page;

use crate::robot_facts::{LegKind, leg_kinds};

/// Width of the page \[px\].
const WIDTH: f64 = 1400.0;
/// Space around and between the panels \[px\].
const SPACE: f64 = 20.0;
/// Least heights of the panels of legs and of views \[px\].
const LEG_HEIGHT: f64 = 520.0;
const VIEW_HEIGHT: f64 = 380.0;

/// Draws the robot of a file.
///
/// # Errors
/// [`LegError`] for a leg without the poses that are drawn.
pub(crate) fn drawing(file: &RobotFile, robot: &Robot) -> Result<Page, LegError> {
    let mut canvas = Canvas::default();
    let title = truncated(&format!("{} ({})", robot.name, file.file()), 180);
    canvas.label("title", [SPACE, SPACE + LINE], &title);
    let mut top = 2.0 * SPACE + LINE;
    let mut kinds: Vec<LegKind> = Vec::new();
    for kind in leg_kinds(robot)? {
        // Legs that differ in their load only look the same.
        match kinds.iter_mut().find(|other| other.leg == kind.leg) {
            Some(other) => other.legs.extend(kind.legs),
            None => kinds.push(kind),
        }
    }
    for kind in &kinds {
        top += legs(&mut canvas, kind, top)?;
        top += symbols::draw(&mut canvas, [SPACE, top], &symbols::rows(kind)) + SPACE;
    }
    top += views(&mut canvas, robot, top)?;
    Ok(canvas.finish(&title, WIDTH, top))
}

/// Returns the areas of two panels side by side.
fn halves(top: f64, height: f64) -> [Rect; 2] {
    let width = 0.5 * (WIDTH - 3.0 * SPACE);
    [SPACE, 2.0 * SPACE + width].map(|left| Rect::new(left, top, width, height))
}

/// Attributes of a group that state its scale.
fn scale_of(frame: Frame) -> [(&'static str, String); 2] {
    let Frame {
        origin: [x, y],
        scale,
    } = frame;
    [
        ("data-origin", format!("{x:.3} {y:.3}")),
        ("data-scale", format!("{scale:.6}")),
    ]
}

/// Draws a kind of leg extended and bent, at one scale, and returns the height that it takes.
fn legs(canvas: &mut Canvas, kind: &LegKind, top: f64) -> Result<f64, LegError> {
    let poses = [PosedLeg::extended(kind)?, PosedLeg::bent(kind)?];
    let texts = [poses[0].texts(), poses[1].texts()];
    let most = texts[0].len().max(texts[1].len());
    let height = Panel::height(most).max(LEG_HEIGHT);
    let areas = halves(top, height);
    let panels = [0, 1].map(|n| Panel::new(areas[n], &texts[n]));
    let extents = [poses[0].extent(), poses[1].extent()];
    let scale = panels[0]
        .scale(&extents[0])
        .min(panels[1].scale(&extents[1]));
    let names = kind.legs.join(", ");
    let titles = [
        format!("leg {}, extended: q2 = q3 = 0 ({names})", kind.name),
        format!("leg {}, bent until the diagonal bottoms out", kind.name),
    ];
    for (n, id) in ["extended", "bent"].into_iter().enumerate() {
        let frame = panels[n].frame(&extents[n], scale);
        canvas.begin(&format!("{}-{id}", kind.name), &scale_of(frame));
        poses[n].draw(canvas, frame);
        panels[n].label(canvas, &titles[n], poses[n].labels(frame));
        canvas.end();
    }
    Ok(height + SPACE)
}

/// Draws the views of the robot, at one scale, and returns the height that they take.
fn views(canvas: &mut Canvas, robot: &Robot, top: f64) -> Result<f64, LegError> {
    let views = [
        SeenRobot::new(robot, View::Side)?,
        SeenRobot::new(robot, View::Top)?,
    ];
    let texts = [views[0].texts(), views[1].texts()];
    let most = texts[0].len().max(texts[1].len());
    let height = Panel::height(most).max(VIEW_HEIGHT);
    let areas = halves(top, height);
    let panels = [0, 1].map(|n| Panel::new(areas[n], &texts[n]));
    let extents = [views[0].extent(), views[1].extent()];
    let scale = panels[0]
        .scale(&extents[0])
        .min(panels[1].scale(&extents[1]));
    let titles = [
        "from the right: x forward →, z up ↑",
        "from above: x forward →, y left ↑",
    ];
    for (n, id) in ["side", "top"].into_iter().enumerate() {
        let frame = panels[n].frame(&extents[n], scale);
        canvas.begin(id, &scale_of(frame));
        views[n].draw(canvas, frame);
        panels[n].label(canvas, titles[n], views[n].labels(frame));
        canvas.end();
    }
    Ok(height + SPACE)
}
