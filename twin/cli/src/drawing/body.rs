//! Side and top view of a robot: trunk, hips and extended legs.

use twinrig_kernel::Unit;
use twinrig_robot::Robot;
use twinrig_robot::leg::{Joints, LegError, Pantograph};

use super::canvas::{Canvas, Px, Rect};
use super::panel::{Extent, Frame, Label};
use crate::robot_facts::shown;

/// Direction from which a robot is seen.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum View {
    /// From its right: x to the right, z up.
    Side,
    /// From above: x to the right, y up.
    Top,
}

/// A robot seen from one direction, its legs extended and the feet below the hips.
pub(super) struct SeenRobot<'a> {
    robot: &'a Robot,
    view: View,
    /// Hips and joints below them, down to the foot \[m\].
    legs: Vec<[[f64; 2]; 4]>,
}

/// Distance of dimension lines from what they measure \[px\].
const OFFSET: f64 = 14.0;

impl<'a> SeenRobot<'a> {
    /// Returns the robot seen from one direction.
    ///
    /// # Errors
    /// [`LegError`] for a leg that cannot be extended.
    pub fn new(robot: &'a Robot, view: View) -> Result<Self, LegError> {
        let mut legs = Vec::new();
        for mount in &robot.legs {
            let leg = Pantograph::new(&mount.leg)?;
            let pose = leg.pose_of_angles(leg.angles(0.0, Joints { q2: 0.0, q3: 0.0 }))?;
            let [x, y, z] = mount.hip;
            let below = |p: [f64; 2]| match view {
                View::Side => [x + p[0], z + p[1]],
                View::Top => [x + p[0], y],
            };
            let joints = [pose.knee, pose.ankle, pose.foot].map(|p| below([p.x, p.y]));
            let [knee, ankle, foot] = joints;
            legs.push([below([0.0, 0.0]), knee, ankle, foot]);
        }
        Ok(Self { robot, view, legs })
    }

    /// Returns half of the trunk's size in the view \[m\].
    fn half(&self) -> [f64; 2] {
        let [length, width, height] = self.robot.trunk.size;
        match self.view {
            View::Side => [0.5 * length, 0.5 * height],
            View::Top => [0.5 * length, 0.5 * width],
        }
    }

    /// Returns the extent of the drawing \[m\].
    pub fn extent(&self) -> Extent {
        let [x, y] = self.half();
        let points = self.legs.iter().flatten().copied();
        Extent::of(points.chain([[-x, -y], [x, y]]))
    }

    /// Returns the labels' texts, before the places of the points are known.
    pub fn texts(&self) -> Vec<String> {
        let frame = Frame {
            origin: [0.0, 0.0],
            scale: 1.0,
        };
        let labels = self.labels(frame);
        labels.into_iter().map(|label| label.text).collect()
    }

    /// Draws the robot.
    pub fn draw(&self, canvas: &mut Canvas, frame: Frame) {
        let [x, y] = self.half();
        let (left, top) = (frame.at([-x, y]), frame.at([x, -y]));
        canvas.rectangle(
            "trunk",
            Rect {
                left: left[0],
                top: left[1],
                right: top[0],
                bottom: top[1],
            },
        );
        if self.view == View::Side {
            let Extent { least, greatest } = self.extent();
            let ground = [[least[0], least[1]], [greatest[0], least[1]]];
            canvas.line("ground", &ground.map(|p| frame.at(p)));
        }
        for leg in &self.legs {
            canvas.line("toe", &leg.map(|p| frame.at(p)));
        }
        for leg in &self.legs {
            canvas.circle("joint", frame.at(leg[0]), 5.0);
        }
        let [x, y] = frame.at([0.0, 0.0]);
        canvas.line("dimension", &[[x - 6.0, y], [x + 6.0, y]]);
        canvas.line("dimension", &[[x, y - 6.0], [x, y + 6.0]]);
        for (from, to) in self.spans(frame) {
            canvas.dimension(from, to);
        }
    }

    /// Returns the dimension lines: length and height or width of the trunk, distance of the hips
    /// along x, and hip to foot or distance of the hips along y.
    fn spans(&self, frame: Frame) -> [(Px, Px); 4] {
        let [x, y] = self.half();
        let Extent { least, greatest } = self.extent();
        let hips = Extent::of(self.legs.iter().map(|leg| leg[0]));
        let off = |n: f64| n * OFFSET / frame.scale;
        let (above, left, right) = (
            greatest[1] + off(1.0),
            least[0] - off(1.0),
            greatest[0] + off(1.0),
        );
        let [first, .., last] = self.legs.first().copied().unwrap_or([[0.0; 2]; 4]);
        let other = match self.view {
            View::Side => ([right, first[1]], [right, last[1]]),
            View::Top => ([right, hips.least[1]], [right, hips.greatest[1]]),
        };
        let places = [
            ([-x, above], [x, above]),
            ([left, -y], [left, y]),
            (
                [hips.least[0], above + off(1.0)],
                [hips.greatest[0], above + off(1.0)],
            ),
            other,
        ];
        places.map(|(from, to)| (frame.at(from), frame.at(to)))
    }

    /// Returns the labels with the points that they name.
    pub fn labels(&self, frame: Frame) -> Vec<Label> {
        let spans = self.spans(frame);
        let [length, width, height] = self.robot.trunk.size;
        let hips = Extent::of(self.legs.iter().map(|leg| leg[0]));
        let apart = |axis: usize| hips.greatest[axis] - hips.least[axis];
        let mm = |name: &str, value: f64| format!("{name} {}", shown(&[value], Unit::Meter));
        let texts = match self.view {
            View::Side => {
                let leg = self.legs.first().copied().unwrap_or([[0.0; 2]; 4]);
                [
                    mm("trunk length", length),
                    mm("trunk height", height),
                    mm("hips apart", apart(0)),
                    mm("L_max", leg[0][1] - leg[3][1]),
                ]
            }
            View::Top => [
                mm("trunk length", length),
                mm("trunk width", width),
                mm("hips apart", apart(0)),
                mm("hips apart", apart(1)),
            ],
        };
        let dimensions = spans.into_iter().zip(texts).map(|((a, b), text)| Label {
            // Off the middle, where the lines of several dimensions would cross.
            at: [0.7 * a[0] + 0.3 * b[0], 0.7 * a[1] + 0.3 * b[1]],
            text,
        });
        let centre = Label {
            at: frame.at([0.0, 0.0]),
            text: "centre of mass, trunk".to_owned(),
        };
        dimensions.chain([centre]).chain(self.hips(frame)).collect()
    }

    /// Returns a label for every place of hips, with the names of the legs there.
    fn hips(&self, frame: Frame) -> Vec<Label> {
        let mut places: Vec<([f64; 2], Vec<&str>)> = Vec::new();
        for (mount, leg) in self.robot.legs.iter().zip(&self.legs) {
            match places.iter_mut().find(|(place, _)| *place == leg[0]) {
                Some((_, names)) => names.push(&mount.name),
                None => places.push((leg[0], vec![&mount.name])),
            }
        }
        let labels = places.into_iter().map(|(place, names)| Label {
            at: frame.at(place),
            text: format!("hip {}", names.join(", ")),
        });
        labels.collect()
    }
}
