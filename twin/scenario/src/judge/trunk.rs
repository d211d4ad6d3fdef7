//! Statistics of the trunk that involve several signals or samples.

use std::f64::consts::PI;

use twinrig_kernel::SimTime;

use super::outcome::Finding;
use super::tracker::Extremes;
use crate::expect::Along;
use crate::limits::Limits;

/// Mean speed over the window.
#[derive(Clone, Debug)]
pub(crate) struct Speed {
    /// Index of x; y follows.
    position: usize,
    yaw: usize,
    along: Along,
    limits: Limits,
    path: Option<PlanarPath>,
}

/// Planar path of the trunk.
#[derive(Clone, Copy, Debug)]
struct PlanarPath {
    start: SimTime,
    now: SimTime,
    from: [f64; 2],
    at: [f64; 2],
    heading: f64,
    length: f64,
    non_finite_at: Option<SimTime>,
}

impl Speed {
    pub fn new(position: usize, yaw: usize, along: Along, limits: Limits) -> Self {
        Speed {
            position,
            yaw,
            along,
            limits,
            path: None,
        }
    }

    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) {
        let at = [values[self.position], values[self.position + 1]];
        let path = self.path.get_or_insert(PlanarPath {
            start: now,
            now,
            from: at,
            at,
            heading: values[self.yaw],
            length: 0.0,
            non_finite_at: None,
        });
        let (dx, dy) = (at[0] - path.at[0], at[1] - path.at[1]);
        path.length += (dx * dx + dy * dy).sqrt();
        path.at = at;
        path.now = now;
        if !(at[0].is_finite() && at[1].is_finite() && path.heading.is_finite()) {
            path.non_finite_at.get_or_insert(now);
        }
    }

    pub fn finding(&self) -> Finding {
        let Some(path) = self.path.filter(|path| path.now > path.start) else {
            return Finding::unobserved("there is no observation in its window");
        };
        if path.non_finite_at.is_some() {
            return Finding::not_a_number(path.non_finite_at);
        }
        let (dx, dy) = (path.at[0] - path.from[0], path.at[1] - path.from[1]);
        let distance = match self.along {
            Along::Heading => dx * libm::cos(path.heading) + dy * libm::sin(path.heading),
            Along::Path => path.length,
        };
        let speed = distance / (path.now - path.start).as_secs_f64();
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
        // Between two observations the shorter turn is assumed.
        let mut step = yaw - self.last.replace(yaw).unwrap_or(yaw);
        if step > PI {
            step -= 2.0 * PI;
        } else if step < -PI {
            step += 2.0 * PI;
        }
        self.turned += step;
        self.extremes
            .add_within(now, self.turned.abs(), &self.limits);
    }

    pub fn finding(&self) -> Finding {
        self.extremes.finding(&self.limits, "")
    }
}

/// Detection of a fall within a window.
#[derive(Clone, Debug)]
pub(crate) struct Upright {
    height: usize,
    /// Index of the roll; the pitch follows.
    roll: usize,
    /// Share of the standing height.
    share: f64,
    tilt: f64,
    standing_height: Option<f64>,
    heights: Extremes,
    tilts: Extremes,
    fallen_at: Option<SimTime>,
}

/// Detail of a finding of [`Upright`] whose values are angles instead of heights.
pub(crate) const TILT: &str = "greatest tilt";

impl Upright {
    pub fn new(height: usize, roll: usize, share: f64, tilt: f64) -> Self {
        Upright {
            height,
            roll,
            share,
            tilt,
            standing_height: None,
            heights: Extremes::default(),
            tilts: Extremes::default(),
            fallen_at: None,
        }
    }

    /// Stores the first height of the run, inside or outside the window, and returns it.
    #[inline]
    pub fn record_standing_height(&mut self, values: &[f64]) -> f64 {
        *self.standing_height.get_or_insert(values[self.height])
    }

    /// Returns whether it has fallen within the window.
    pub fn has_fallen(&self) -> bool {
        self.fallen_at.is_some()
    }

    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) {
        let min_height = self.share * self.record_standing_height(values);
        let height = values[self.height];
        self.heights.add(now, height);
        let (roll, pitch) = (values[self.roll].abs(), values[self.roll + 1].abs());
        // Propagates a NaN, unlike `f64::max`.
        let tilt = if roll > pitch || roll.is_nan() {
            roll
        } else {
            pitch
        };
        self.tilts.add(now, tilt);
        if !(height >= min_height && tilt <= self.tilt) && self.fallen_at.is_none() {
            self.fallen_at = Some(now);
        }
    }

    pub fn finding(&self) -> Finding {
        let non_finite_at = self.heights.non_finite_at.or(self.tilts.non_finite_at);
        if non_finite_at.is_some() {
            return Finding::not_a_number(non_finite_at);
        }
        let Some(standing_height) = self.standing_height.filter(|_| !self.heights.is_empty())
        else {
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
            Finding::of(tilted, self.fallen_at, TILT)
        } else {
            Finding::of(low, self.fallen_at, "lowest height")
        }
    }
}
