//! Expectations of the trunk that take more than one number.

use std::f64::consts::PI;

use twinrig_kernel::SimTime;

use super::outcome::Finding;
use super::tracker::Extremes;
use crate::expect::Along;
use crate::limits::Limits;

/// Mean speed over the window.
#[derive(Clone, Debug)]
pub(crate) struct Speed {
    /// Element of x; that of y is the next.
    position: usize,
    yaw: usize,
    along: Along,
    limits: Limits,
    trip: Option<Trip>,
}

/// A way through the plane.
#[derive(Clone, Copy, Debug)]
struct Trip {
    start: SimTime,
    now: SimTime,
    from: [f64; 2],
    at: [f64; 2],
    heading: f64,
    path: f64,
    broken_at: Option<SimTime>,
}

impl Speed {
    pub fn new(position: usize, yaw: usize, along: Along, limits: Limits) -> Self {
        Speed {
            position,
            yaw,
            along,
            limits,
            trip: None,
        }
    }

    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) {
        let at = [values[self.position], values[self.position + 1]];
        let trip = self.trip.get_or_insert(Trip {
            start: now,
            now,
            from: at,
            at,
            heading: values[self.yaw],
            path: 0.0,
            broken_at: None,
        });
        let (dx, dy) = (at[0] - trip.at[0], at[1] - trip.at[1]);
        trip.path += (dx * dx + dy * dy).sqrt();
        trip.at = at;
        trip.now = now;
        if !(at[0].is_finite() && at[1].is_finite() && trip.heading.is_finite()) {
            trip.broken_at.get_or_insert(now);
        }
    }

    pub fn finding(&self) -> Finding {
        let Some(trip) = self.trip.filter(|trip| trip.now > trip.start) else {
            return Finding::unobserved("nothing was observed in its time");
        };
        if trip.broken_at.is_some() {
            return Finding::not_a_number(trip.broken_at);
        }
        let (dx, dy) = (trip.at[0] - trip.from[0], trip.at[1] - trip.from[1]);
        let distance = match self.along {
            Along::Heading => dx * libm::cos(trip.heading) + dy * libm::sin(trip.heading),
            Along::Path => trip.path,
        };
        let speed = distance / (trip.now - trip.start).as_secs_f64();
        Finding::of(self.limits.compare(speed, speed), None, "")
    }
}

/// Greatest turn away from the first yaw, whole turns counted.
#[derive(Clone, Debug)]
pub(crate) struct Yaw {
    element: usize,
    limits: Limits,
    last: Option<f64>,
    turned: f64,
    seen: Extremes,
}

impl Yaw {
    pub fn new(element: usize, limits: Limits) -> Self {
        Yaw {
            element,
            limits,
            last: None,
            turned: 0.0,
            seen: Extremes::default(),
        }
    }

    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) {
        let yaw = values[self.element];
        // From one observation to the next it turns the short way.
        let mut step = yaw - self.last.replace(yaw).unwrap_or(yaw);
        if step > PI {
            step -= 2.0 * PI;
        } else if step < -PI {
            step += 2.0 * PI;
        }
        self.turned += step;
        self.seen.add_within(now, self.turned.abs(), &self.limits);
    }

    pub fn finding(&self) -> Finding {
        self.seen.finding(&self.limits, "")
    }
}

/// The trunk stays up.
#[derive(Clone, Debug)]
pub(crate) struct Upright {
    height: usize,
    /// Element of roll; that of pitch is the next.
    roll: usize,
    /// Of the standing height.
    share: f64,
    tilt: f64,
    standing: Option<f64>,
    heights: Extremes,
    tilts: Extremes,
    fallen_at: Option<SimTime>,
}

/// What a finding of [`Upright`] says when its numbers are angles and not heights.
pub(crate) const TILT: &str = "greatest tilt";

impl Upright {
    pub fn new(height: usize, roll: usize, share: f64, tilt: f64) -> Self {
        Upright {
            height,
            roll,
            share,
            tilt,
            standing: None,
            heights: Extremes::default(),
            tilts: Extremes::default(),
            fallen_at: None,
        }
    }

    /// Keeps the first height of the run, whether the window has begun or not.
    #[inline]
    pub fn stand(&mut self, values: &[f64]) -> f64 {
        *self.standing.get_or_insert(values[self.height])
    }

    /// Whether it has fallen within the window.
    pub fn has_fallen(&self) -> bool {
        self.fallen_at.is_some()
    }

    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) {
        let floor = self.share * self.stand(values);
        let height = values[self.height];
        self.heights.add(now, height);
        let (roll, pitch) = (values[self.roll].abs(), values[self.roll + 1].abs());
        // Unlike `f64::max` this keeps a NaN.
        let tilt = if roll > pitch || roll.is_nan() {
            roll
        } else {
            pitch
        };
        self.tilts.add(now, tilt);
        if !(height >= floor && tilt <= self.tilt) && self.fallen_at.is_none() {
            self.fallen_at = Some(now);
        }
    }

    pub fn finding(&self) -> Finding {
        let broken_at = self.heights.broken_at.or(self.tilts.broken_at);
        if broken_at.is_some() {
            return Finding::not_a_number(broken_at);
        }
        let Some(standing) = self.standing.filter(|_| !self.heights.is_empty()) else {
            return Finding::unobserved("nothing was observed in its time");
        };
        let floor = Limits {
            min: Some(self.share * standing),
            max: None,
        };
        let low = floor.compare(self.heights.least, self.heights.greatest);
        let tilted = Limits::at_most(self.tilt).compare(self.tilts.least, self.tilts.greatest);
        // Two limits of different units: the one that is nearer, as a share of what there is to lose, is shown.
        if tilted.margin / self.tilt < low.margin / standing {
            Finding::of(tilted, self.fallen_at, TILT)
        } else {
            Finding::of(low, self.fallen_at, "lowest height")
        }
    }
}
