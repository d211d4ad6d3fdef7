//! Statistics of the trunk that involve several signals or samples.

use std::f64::consts::PI;

use twinrig_kernel::SimTime;

use super::outcome::{Finding, TILT};
use super::tracker::{Extremes, Site};
use crate::limits::Limits;

/// Mean speed over the window.
#[derive(Clone, Debug)]
pub(crate) struct Speed {
    /// Index of x; y follows.
    position: usize,
    yaw: usize,
    /// Whether it is that along the path, not along the initial heading.
    is_of_path: bool,
    limits: Limits,
    path: Option<PlanarPath>,
}

/// Planar path of the trunk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlanarPath {
    start: SimTime,
    now: SimTime,
    from: [f64; 2],
    at: [f64; 2],
    heading: f64,
    length: f64,
    non_finite_at: Option<SimTime>,
}

impl PlanarPath {
    pub fn new(start: SimTime, from: [f64; 2], heading: f64) -> Self {
        PlanarPath {
            start,
            now: start,
            from,
            at: from,
            heading,
            length: 0.0,
            non_finite_at: None,
        }
    }

    /// Extends the path to `at`; returns the speed since the last place \[m/s\], 0 at the first.
    #[inline]
    pub fn advance(&mut self, now: SimTime, at: [f64; 2]) -> f64 {
        let (dx, dy) = (at[0] - self.at[0], at[1] - self.at[1]);
        let step = (dx * dx + dy * dy).sqrt();
        let elapsed = (now - self.now).as_secs_f64();
        self.length += step;
        self.at = at;
        self.now = now;
        if !(at[0].is_finite() && at[1].is_finite() && self.heading.is_finite()) {
            self.non_finite_at.get_or_insert(now);
        }
        if elapsed > 0.0 { step / elapsed } else { 0.0 }
    }

    /// Returns the time of the first value that is not finite.
    pub fn non_finite_at(&self) -> Option<SimTime> {
        self.non_finite_at
    }

    /// Returns the distance along the initial heading \[m\].
    pub fn ahead(&self) -> f64 {
        let (dx, dy) = (self.at[0] - self.from[0], self.at[1] - self.from[1]);
        dx * libm::cos(self.heading) + dy * libm::sin(self.heading)
    }

    /// Returns the mean speed along the initial heading \[m/s\]; none at the start.
    pub fn speed_ahead(&self) -> Option<f64> {
        let elapsed = (self.now - self.start).as_secs_f64();
        (elapsed > 0.0).then(|| self.ahead() / elapsed)
    }

    /// Returns the mean speed along the path \[m/s\]; none at the start.
    fn speed_along(&self) -> Option<f64> {
        let elapsed = (self.now - self.start).as_secs_f64();
        (elapsed > 0.0).then(|| self.length / elapsed)
    }
}

impl Speed {
    pub fn new(position: usize, yaw: usize, is_of_path: bool, limits: Limits) -> Self {
        Speed {
            position,
            yaw,
            is_of_path,
            limits,
            path: None,
        }
    }

    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) {
        let at = [values[self.position], values[self.position + 1]];
        let heading = values[self.yaw];
        let path = self
            .path
            .get_or_insert_with(|| PlanarPath::new(now, at, heading));
        path.advance(now, at);
    }

    pub fn finding(&self) -> Finding {
        let observed = self.path.and_then(|path| {
            let speed = if self.is_of_path {
                path.speed_along()
            } else {
                path.speed_ahead()
            };
            Some((path, speed?))
        });
        let Some((path, speed)) = observed else {
            return Finding::unobserved("there is no observation in its window");
        };
        if path.non_finite_at.is_some() {
            return Finding::not_a_number(path.non_finite_at);
        }
        Finding::of(self.limits.compare(speed, speed), None, "")
    }
}

/// Greatest change from the initial yaw, whole turns included.
#[derive(Clone, Debug)]
pub(crate) struct Yaw {
    element: usize,
    limits: Limits,
    last: Option<f64>,
    turned: f64,
    extremes: Extremes,
}

/// Returns the turn between the headings of two observations \[rad\]: the shorter one is assumed.
#[inline]
pub(super) fn turn(from: f64, to: f64) -> f64 {
    let turn = to - from;
    if turn > PI {
        turn - 2.0 * PI
    } else if turn < -PI {
        turn + 2.0 * PI
    } else {
        turn
    }
}

impl Yaw {
    pub fn new(element: usize, limits: Limits) -> Self {
        Yaw {
            element,
            limits,
            last: None,
            turned: 0.0,
            extremes: Extremes::default(),
        }
    }

    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) {
        let yaw = values[self.element];
        self.turned += turn(self.last.replace(yaw).unwrap_or(yaw), yaw);
        self.extremes
            .add_within(now, self.turned.abs(), &self.limits);
    }

    pub fn finding(&self) -> Finding {
        Finding {
            element: Some(self.element),
            ..self.extremes.finding(&self.limits, "")
        }
    }
}

/// Part of a twist in the plane, in axes of the trunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TwistPart {
    /// Velocity along the heading.
    Forward,
    /// Velocity to the left of it.
    Left,
    /// Rate of the heading.
    Turn,
}

/// Mean of a part of the trunk's twist over the window.
#[derive(Clone, Debug)]
pub(crate) struct MeanTwist {
    /// Index of x; y follows.
    position: usize,
    yaw: usize,
    part: TwistPart,
    limits: Limits,
    start: Option<SimTime>,
    now: SimTime,
    /// Last place and heading.
    last: [f64; 3],
    /// Integral of the part.
    sum: f64,
    non_finite_at: Option<SimTime>,
}

impl MeanTwist {
    pub fn new(position: usize, yaw: usize, part: TwistPart, limits: Limits) -> Self {
        MeanTwist {
            position,
            yaw,
            part,
            limits,
            start: None,
            now: SimTime::ZERO,
            last: [0.0; 3],
            sum: 0.0,
            non_finite_at: None,
        }
    }

    pub fn sample(&mut self, now: SimTime, values: &[f64]) {
        let at = [
            values[self.position],
            values[self.position + 1],
            values[self.yaw],
        ];
        if !at.iter().all(|value| value.is_finite()) {
            self.non_finite_at.get_or_insert(now);
        }
        if self.start.is_none() {
            (self.start, self.last) = (Some(now), at);
        }
        let [x, y, yaw] = self.last;
        let turned = turn(yaw, at[2]);
        // The heading in the middle of the interval.
        let middle = yaw + 0.5 * turned;
        let (sine, cosine) = (libm::sin(middle), libm::cos(middle));
        let (dx, dy) = (at[0] - x, at[1] - y);
        self.sum += match self.part {
            TwistPart::Forward => dx * cosine + dy * sine,
            TwistPart::Left => dy * cosine - dx * sine,
            TwistPart::Turn => turned,
        };
        (self.last, self.now) = (at, now);
    }

    pub fn finding(&self) -> Finding {
        let elapsed = self.start.map(|start| (self.now - start).as_secs_f64());
        let Some(elapsed) = elapsed.filter(|elapsed| *elapsed > 0.0) else {
            return Finding::unobserved("there is no observation in its window");
        };
        if self.non_finite_at.is_some() {
            return Finding::not_a_number(self.non_finite_at);
        }
        let mean = self.sum / elapsed;
        Finding::of(self.limits.compare(mean, mean), None, "")
    }
}

/// The first height of the run, inside or outside of a window.
#[derive(Clone, Debug)]
pub(crate) struct StandingHeight {
    /// Index of the height.
    pub element: usize,
    pub first: Option<f64>,
}

impl StandingHeight {
    pub fn new(element: usize) -> Self {
        let first = None;
        StandingHeight { element, first }
    }

    /// Stores the first height, and returns it.
    #[inline]
    pub fn record(&mut self, values: &[f64]) -> f64 {
        *self.first.get_or_insert(values[self.element])
    }
}

/// Detection of a fall within a window.
#[derive(Clone, Debug)]
pub(crate) struct Upright {
    pub height: StandingHeight,
    /// Index of the roll; the pitch follows.
    roll: usize,
    /// Share of the standing height.
    share: f64,
    tilt: f64,
    heights: Extremes,
    tilts: Extremes,
    fallen_at: Option<SimTime>,
    /// Side to which it first was tilted too far.
    side: &'static str,
}

impl Upright {
    pub fn new(height: usize, roll: usize, share: f64, tilt: f64) -> Self {
        Upright {
            height: StandingHeight::new(height),
            roll,
            share,
            tilt,
            heights: Extremes::default(),
            tilts: Extremes::default(),
            fallen_at: None,
            side: "",
        }
    }

    /// Returns whether it has fallen within the window.
    pub fn has_fallen(&self) -> bool {
        self.fallen_at.is_some()
    }

    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) {
        let min_height = self.share * self.height.record(values);
        let height = values[self.height.element];
        self.heights.add_of(self.height.element, now, height);
        let (roll, pitch) = (values[self.roll].abs(), values[self.roll + 1].abs());
        // Propagates a NaN, unlike `f64::max`.
        let (element, tilt) = if roll > pitch || roll.is_nan() {
            (self.roll, roll)
        } else {
            (self.roll + 1, pitch)
        };
        self.tilts.add_of(element, now, tilt);
        if !(height >= min_height && tilt <= self.tilt) && self.fallen_at.is_none() {
            self.fallen_at = Some(now);
        }
        if tilt > self.tilt && self.side.is_empty() {
            self.side = match (element == self.roll, values[element] > 0.0) {
                (true, true) => "to the right, ",
                (true, false) => "to the left, ",
                (false, true) => "forward, ",
                (false, false) => "backward, ",
            };
        }
    }

    pub fn finding(&self) -> Finding {
        let non_finite_at = self.heights.non_finite_at.or(self.tilts.non_finite_at);
        if non_finite_at.is_some() {
            return Finding::not_a_number(non_finite_at);
        }
        let Some(standing_height) = self.height.first.filter(|_| !self.heights.is_empty()) else {
            return Finding::unobserved("there is no observation in its window");
        };
        let min_height = Limits {
            min: Some(self.share * standing_height),
            max: None,
        };
        let low = min_height.compare(self.heights.least, self.heights.greatest);
        let tilted = Limits::at_most(self.tilt).compare(self.tilts.least, self.tilts.greatest);
        // Of two limits with different units the one with the smaller relative margin is reported.
        if tilted.margin / self.tilt < low.margin / standing_height {
            let Site { at, element } = self.tilts.greatest_site;
            let detail = format!("{}{TILT}", self.side);
            Finding::of(tilted, self.fallen_at, detail).seen_in(element, at, tilted.measured)
        } else {
            let Site { at, element } = self.heights.least_site;
            let finding = Finding::of(low, self.fallen_at, "lowest height");
            finding.seen_in(element, at, low.measured)
        }
    }
}
