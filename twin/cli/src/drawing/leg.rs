//! Drawing of a leg in its plane, in one pose.

use twinrig_kernel::Unit;
use twinrig_robot::leg::{Joints, LegError, Pantograph, Planar, Pose};
use twinrig_robot::{Leg, Spring};

use super::canvas::{Canvas, Px};
use super::panel::{Extent, Frame, Label};
use crate::robot_facts::{LegKind, shown};

/// A leg in one pose, the foot below the hip.
pub(super) struct PosedLeg<'a> {
    leg: &'a Leg,
    pose: Pose,
    /// Points at which the rods join first and third segment.
    inner: Planar,
    outer: Planar,
    /// End of the toe segment, if the leg has one.
    toe: Option<Planar>,
    is_extended: bool,
}

/// Distance of dimension lines from their segments \[px\].
const OFFSET: f64 = 14.0;

impl<'a> PosedLeg<'a> {
    /// Returns the fully extended leg.
    ///
    /// # Errors
    /// [`LegError`] if that pose is singular.
    pub fn extended(kind: &'a LegKind) -> Result<Self, LegError> {
        Self::at(kind, 0.0, 0.0, true)
    }

    /// Returns the leg with the diagonal at its stop and the pantograph closed.
    ///
    /// # Errors
    /// [`LegError`] if that pose is singular.
    pub fn bent(kind: &'a LegKind) -> Result<Self, LegError> {
        let leg = &kind.pantograph;
        let command = leg.inverse_closed(Planar::new(0.0, -leg.length_min()))?;
        Self::at(kind, command.hip, leg.knee_bottomed()?, false)
    }

    fn at(kind: &'a LegKind, hip: f64, q2: f64, is_extended: bool) -> Result<Self, LegError> {
        let (leg, pantograph): (&Leg, &Pantograph) = (&kind.leg, &kind.pantograph);
        let angles = pantograph.angles(hip, Joints { q2, q3: -q2 });
        let pose = pantograph.pose_of_angles(angles)?;
        let [first, _, third] = pose.along;
        let toe = leg.toe.map(|toe| {
            let angle = angles[2] + toe.rest;
            pose.foot + Planar::new(libm::sin(angle), -libm::cos(angle)) * toe.length
        });
        Ok(Self {
            leg,
            inner: first * (leg.l1 - leg.l_delta),
            outer: pose.ankle - third * leg.l_delta,
            pose,
            toe,
            is_extended,
        })
    }

    /// Returns the points that the drawing contains \[m\].
    pub fn extent(&self) -> Extent {
        let r = self.leg.pulley_radius;
        let pulley = [[-r, -r], [r, r]];
        let pose = &self.pose;
        let points = [pose.knee, pose.ankle, pose.foot, self.inner, self.outer];
        let points = points.into_iter().chain(self.toe).map(|p| [p.x, p.y]);
        Extent::of(points.chain(pulley))
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

    /// Draws the leg.
    pub fn draw(&self, canvas: &mut Canvas, frame: Frame) {
        let at = |p: Planar| frame.at([p.x, p.y]);
        let (pose, hip) = (&self.pose, Planar::zeros());
        canvas.circle("pulley", at(hip), self.leg.pulley_radius * frame.scale);
        canvas.line("cable", &[at(hip), at(pose.ankle)]);
        canvas.line("segment", &[at(hip), at(pose.knee), at(pose.ankle)]);
        canvas.line("segment", &[at(self.outer), at(pose.foot)]);
        if let Some(toe) = self.toe {
            canvas.line("toe", &[at(pose.foot), at(toe)]);
        }
        canvas.line("spring", &coil(at(self.inner), at(pose.ankle)));
        canvas.line("spring", &coil(at(self.inner), at(self.outer)));
        for joint in [hip, pose.knee, pose.ankle, pose.foot] {
            canvas.circle("joint", at(joint), 5.0);
        }
        for pin in [self.inner, self.outer] {
            canvas.circle("pin", at(pin), 3.0);
        }
        for (from, to) in self.spans(frame) {
            canvas.dimension(from, to);
        }
        canvas.line("dimension", &self.knee_arc(frame));
    }

    /// Returns the dimension lines, parallel to what they measure: segments 1 to 3, offset on the
    /// first and on the third, hip to foot.
    fn spans(&self, frame: Frame) -> [(Px, Px); 6] {
        let pose = &self.pose;
        let hip = Planar::zeros();
        let beside = |from: Planar, to: Planar, offset: f64| {
            let along = (to - from).normalize();
            let shift = Planar::new(-along.y, along.x) * (offset / frame.scale);
            let place = |p: Planar| frame.at([p.x, p.y]);
            (place(from + shift), place(to + shift))
        };
        let extent = self.extent();
        let right = extent.greatest[0] + OFFSET / frame.scale;
        // The leg bends forward at the knee and backward at the ankle: free sides.
        [
            beside(hip, pose.knee, OFFSET),
            beside(pose.knee, pose.ankle, OFFSET),
            beside(self.outer, pose.foot, -OFFSET),
            beside(self.inner, pose.knee, 0.6 * OFFSET),
            beside(self.outer, pose.ankle, -0.6 * OFFSET),
            (frame.at([right, 0.0]), frame.at([right, pose.foot.y])),
        ]
    }

    /// Returns the arc from the direction of the first segment to the second, around the knee.
    fn knee_arc(&self, frame: Frame) -> Vec<Px> {
        const RADIUS: f64 = 24.0;
        const STEPS: u32 = 24;
        let [first, second, _] = self.pose.angles();
        let at = |step: u32| {
            let angle = first + (second - first) * f64::from(step) / f64::from(STEPS);
            let reach = RADIUS / frame.scale;
            let knee = self.pose.knee;
            frame.at([
                knee.x + reach * libm::sin(angle),
                knee.y - reach * libm::cos(angle),
            ])
        };
        (0..=STEPS).map(at).collect()
    }

    /// Returns the labels with the points that they name.
    pub fn labels(&self, frame: Frame) -> Vec<Label> {
        let spans = self.spans(frame).map(middle);
        let found = if self.is_extended {
            self.extended_labels(frame, &spans)
        } else {
            self.bent_labels(frame, &spans)
        };
        let labels = found.into_iter().map(|(at, text)| Label { at, text });
        labels.collect()
    }

    /// Returns the labels of the bent leg: what differs from the extended one.
    fn bent_labels(&self, frame: Frame, spans: &[Px; 6]) -> Vec<(Px, String)> {
        let pose = &self.pose;
        let [first, second, _] = pose.angles();
        let flexed = shown(&[first - second], Unit::Radian);
        vec![
            (spans[5], length("L_min", pose.foot.norm())),
            (self.on_cable(frame), length("cable", pose.cable)),
            (self.at_arc(frame), format!("q2_ref - q2 = {flexed}")),
            (
                between(frame, self.inner, pose.ankle, 0.5),
                length("l_d,min", pose.diagonal),
            ),
            (
                between(frame, self.inner, self.outer, 0.5),
                length("l_p = l2", pose.parallel),
            ),
        ]
    }

    /// Returns the labels of the extended leg.
    fn extended_labels(&self, frame: Frame, spans: &[Px; 6]) -> Vec<(Px, String)> {
        let (leg, pose) = (self.leg, &self.pose);
        let stiffness = |name: &str, spring: &Spring| {
            format!(
                "{name} = {}",
                shown(&[spring.stiffness], Unit::NewtonPerMeter)
            )
        };
        let at = |p: Planar| frame.at([p.x, p.y]);
        let [x, y] = at(Planar::zeros());
        let rim = leg.pulley_radius * frame.scale * core::f64::consts::FRAC_1_SQRT_2;
        let reference = shown(&[leg.q2_ref], Unit::Radian);
        let mut found = vec![
            (spans[0], length("l1", leg.l1)),
            (spans[1], length("l2", leg.l2)),
            (spans[2], length("l3", leg.l3)),
            (spans[3], length("l_Δ", leg.l_delta)),
            (spans[4], length("l_Δ", leg.l_delta)),
            (spans[5], length("L_max", pose.foot.norm())),
            (self.on_cable(frame), length("cable", pose.cable)),
            (self.at_arc(frame), format!("q2_ref = {reference}")),
            (
                between(frame, self.inner, pose.ankle, 0.5),
                stiffness("diagonal k_d", &leg.diagonal),
            ),
            (
                between(frame, self.inner, self.outer, 0.5),
                stiffness("parallel k_p", &leg.parallel),
            ),
            ([x - rim, y - rim], length("pulley r", leg.pulley_radius)),
            ([x, y], "hip q1".to_owned()),
            (at(pose.knee), "knee q2".to_owned()),
            (at(pose.ankle), "ankle q3".to_owned()),
            (at(pose.foot), "foot".to_owned()),
        ];
        if let (Some(toe), Some(end)) = (leg.toe, self.toe) {
            found.push((
                between(frame, pose.foot, end, 0.7),
                length("toe", toe.length),
            ));
        }
        found
    }

    /// Returns the middle of the arc at the knee.
    fn at_arc(&self, frame: Frame) -> Px {
        let arc = self.knee_arc(frame);
        arc[arc.len() / 2]
    }

    /// Returns a point of the cable that nothing else crosses.
    fn on_cable(&self, frame: Frame) -> Px {
        between(frame, Planar::zeros(), self.pose.ankle, 0.35)
    }
}

fn length(name: &str, value: f64) -> String {
    format!("{name} = {}", shown(&[value], Unit::Meter))
}

fn middle((a, b): (Px, Px)) -> Px {
    [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
}

/// Returns the place of the point at a share of the way between two points.
fn between(frame: Frame, a: Planar, b: Planar, share: f64) -> Px {
    let p = a + (b - a) * share;
    frame.at([p.x, p.y])
}

/// Returns the points of a spring between two points: a zigzag between straight ends.
fn coil(from: Px, to: Px) -> Vec<Px> {
    const TURNS: u32 = 7;
    const WIDTH: f64 = 4.0;
    let (x, y) = (to[0] - from[0], to[1] - from[1]);
    let length = libm::hypot(x, y).max(1e-9);
    let at = |share: f64, across: f64| {
        [
            from[0] + x * share - y / length * across,
            from[1] + y * share + x / length * across,
        ]
    };
    let mut points = vec![from, at(0.25, 0.0)];
    for turn in 0..2 * TURNS {
        let share = 0.25 + 0.5 * (f64::from(turn) + 0.5) / f64::from(2 * TURNS);
        points.push(at(share, if turn % 2 == 0 { WIDTH } else { -WIDTH }));
    }
    points.extend([at(0.75, 0.0), to]);
    points
}
