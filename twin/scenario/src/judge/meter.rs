//! One expectation of a signal or the trunk, fed sample by sample. Nothing here allocates once the run has begun.

use std::f64::consts::PI;

use twinrig_kernel::SimTime;

use super::outcome::Finding;
use super::tracker::{Extremes, Settling};
use crate::expect::Along;
use crate::limits::{Comparison, Limits};

/// Watches the samples of one channel.
#[derive(Clone, Debug)]
pub(crate) enum Meter {
    /// Elements stay within limits.
    Always {
        elements: Vec<usize>,
        /// Watch magnitudes.
        absolute: bool,
        limits: Limits,
        seen: Extremes,
    },
    /// The distance between the greatest and the least value of an element.
    Range {
        element: usize,
        limits: Limits,
        seen: Extremes,
    },
    /// Elements come within limits at least once, each.
    Eventually {
        elements: Vec<Nearest>,
        limits: Limits,
    },
    /// Elements stay within limits until another element comes within its own.
    Until {
        elements: Vec<usize>,
        limits: Limits,
        seen: Extremes,
        other: usize,
        other_limits: Limits,
        over_at: Option<SimTime>,
    },
    /// Elements stay near where they end.
    Settles {
        elements: Vec<usize>,
        settling: Settling,
    },
    /// Mean speed; x is element `position`, y the one after it.
    Speed {
        position: usize,
        yaw: usize,
        along: Along,
        limits: Limits,
        trip: Option<Trip>,
    },
    /// Greatest turn away from the first yaw.
    Yaw {
        yaw: usize,
        limits: Limits,
        turn: Option<Turn>,
        seen: Extremes,
    },
    /// The trunk stays up. `height` and the two elements from `roll` on are watched.
    Upright {
        height: usize,
        roll: usize,
        share: f64,
        tilt: f64,
        standing: Option<f64>,
        lowest: Extremes,
        tilted: Extremes,
        fallen_at: Option<SimTime>,
    },
}

/// How near an element has come to the limits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub element: usize,
    /// The best so far; none before the first sample.
    pub best: Option<Comparison>,
    pub broken_at: Option<SimTime>,
}

/// A way through the plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trip {
    start: SimTime,
    now: SimTime,
    from: [f64; 2],
    at: [f64; 2],
    heading: f64,
    path: f64,
    broken_at: Option<SimTime>,
}

/// An angle that counts whole turns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn {
    last: f64,
    turned: f64,
}

impl Meter {
    /// Takes the samples of the meter's channel at `now`, which is within its window. What must be known from before the
    /// window goes to [`Meter::outside`].
    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) {
        match self {
            Meter::Always {
                elements,
                absolute,
                limits,
                seen,
            } => {
                for &element in elements.iter() {
                    let value = values[element];
                    let value = if *absolute { value.abs() } else { value };
                    seen.add_within(now, value, limits);
                }
            }
            Meter::Range {
                element,
                limits,
                seen,
            } => {
                seen.add(now, values[*element]);
                if seen.first_violation.is_none()
                    && limits.max.is_some_and(|max| seen.range() > max)
                {
                    seen.first_violation = Some(now);
                }
            }
            Meter::Eventually { elements, limits } => {
                for nearest in elements.iter_mut() {
                    nearest.add(now, values[nearest.element], limits);
                }
            }
            Meter::Until {
                elements,
                limits,
                seen,
                other,
                other_limits,
                over_at,
            } => {
                if over_at.is_none() && other_limits.hold(values[*other]) {
                    *over_at = Some(now);
                }
                if over_at.is_none() {
                    for &element in elements.iter() {
                        seen.add_within(now, values[element], limits);
                    }
                }
            }
            Meter::Settles { elements, settling } => {
                settling.add(now, elements.iter().map(|&element| values[element]));
            }
            Meter::Speed {
                position,
                yaw,
                trip,
                ..
            } => {
                let at = [values[*position], values[*position + 1]];
                match trip {
                    Some(trip) => trip.go(now, at),
                    None => *trip = Some(Trip::new(now, at, values[*yaw])),
                }
            }
            Meter::Yaw {
                yaw,
                limits,
                turn,
                seen,
            } => {
                let yaw = values[*yaw];
                let turned = turn.get_or_insert(Turn::new(yaw)).to(yaw);
                seen.add_within(now, turned.abs(), limits);
            }
            Meter::Upright { .. } => self.look_for_fall(now, values),
        }
    }

    /// Takes samples outside the meter's window.
    #[inline]
    pub fn outside(&mut self, values: &[f64]) {
        if let Meter::Upright {
            height, standing, ..
        } = self
        {
            standing.get_or_insert(values[*height]);
        }
    }

    fn look_for_fall(&mut self, now: SimTime, values: &[f64]) {
        let Meter::Upright {
            height,
            roll,
            share,
            tilt,
            standing,
            lowest,
            tilted,
            fallen_at,
        } = self
        else {
            return;
        };
        let height = values[*height];
        let standing = *standing.get_or_insert(height);
        lowest.add(now, height);
        let tilt_now = values[*roll].abs().max(values[*roll + 1].abs());
        // `f64::max` prefers a number to a NaN.
        let broken = values[*roll].is_nan() || values[*roll + 1].is_nan();
        tilted.add(now, if broken { f64::NAN } else { tilt_now });
        let up = height >= *share * standing && tilt_now <= *tilt;
        if !up && fallen_at.is_none() {
            *fallen_at = Some(now);
        }
    }

    /// What was found.
    pub fn finding(&self) -> Finding {
        match self {
            Meter::Always { limits, seen, .. } | Meter::Yaw { limits, seen, .. } => {
                seen.finding(limits, "")
            }
            Meter::Range { limits, seen, .. } => range_finding(seen, limits),
            Meter::Eventually { elements, .. } => eventually_finding(elements),
            Meter::Until {
                limits,
                seen,
                over_at,
                ..
            } => until_finding(limits, seen, *over_at),
            Meter::Settles { settling, .. } => settling.finding(),
            Meter::Speed {
                along,
                limits,
                trip,
                ..
            } => speed_finding(*along, limits, trip.as_ref()),
            Meter::Upright {
                share,
                tilt,
                standing,
                lowest,
                tilted,
                fallen_at,
                ..
            } => {
                let broken_at = lowest.broken_at.or(tilted.broken_at);
                if broken_at.is_some() {
                    return Finding::not_a_number(broken_at);
                }
                let Some(standing) = standing.filter(|_| !lowest.is_empty()) else {
                    return Finding::unobserved("nothing was observed in its time");
                };
                // Two limits of different units: the one that is nearer as a share of itself is shown.
                let floor = share * standing;
                let low = Limits {
                    min: Some(floor),
                    max: None,
                }
                .compare(lowest.least, lowest.greatest);
                let tilted = Limits::at_most(*tilt).compare(tilted.least, tilted.greatest);
                if tilted.margin / tilt < low.margin / standing {
                    Finding::of(tilted, *fallen_at, TILT)
                } else {
                    Finding::of(low, *fallen_at, "lowest height")
                }
            }
        }
    }
}

/// What a finding of [`Meter::Upright`] says when its numbers are angles and not heights.
pub(crate) const TILT: &str = "greatest tilt";

impl Nearest {
    pub fn new(element: usize) -> Self {
        Nearest {
            element,
            best: None,
            broken_at: None,
        }
    }

    fn add(&mut self, now: SimTime, value: f64, limits: &Limits) {
        if !value.is_finite() {
            self.broken_at.get_or_insert(now);
            return;
        }
        let here = limits.compare(value, value);
        if self.best.is_none_or(|best| here.margin > best.margin) {
            self.best = Some(here);
        }
    }
}

impl Trip {
    fn new(now: SimTime, at: [f64; 2], heading: f64) -> Self {
        let mut trip = Trip {
            start: now,
            now,
            from: at,
            at,
            heading,
            path: 0.0,
            broken_at: None,
        };
        trip.check(now, &[at[0], at[1], heading]);
        trip
    }

    fn go(&mut self, now: SimTime, to: [f64; 2]) {
        let (dx, dy) = (to[0] - self.at[0], to[1] - self.at[1]);
        self.path += (dx * dx + dy * dy).sqrt();
        self.at = to;
        self.now = now;
        self.check(now, &to);
    }

    fn check(&mut self, now: SimTime, values: &[f64]) {
        if values.iter().any(|value| !value.is_finite()) {
            self.broken_at.get_or_insert(now);
        }
    }
}

impl Turn {
    fn new(yaw: f64) -> Self {
        Turn {
            last: yaw,
            turned: 0.0,
        }
    }

    /// The turn since the start, having come to `yaw` the short way.
    fn to(&mut self, yaw: f64) -> f64 {
        let mut step = yaw - self.last;
        if step > PI {
            step -= 2.0 * PI;
        } else if step < -PI {
            step += 2.0 * PI;
        }
        self.turned += step;
        self.last = yaw;
        self.turned
    }
}

fn range_finding(seen: &Extremes, limits: &Limits) -> Finding {
    if seen.broken_at.is_some() {
        return Finding::not_a_number(seen.broken_at);
    }
    if seen.is_empty() {
        return Finding::unobserved("nothing was observed in its time");
    }
    let range = seen.range();
    Finding::of(limits.compare(range, range), seen.first_violation, "")
}

fn eventually_finding(elements: &[Nearest]) -> Finding {
    let mut worst: Option<Comparison> = None;
    for nearest in elements {
        if nearest.broken_at.is_some() {
            return Finding::not_a_number(nearest.broken_at);
        }
        let Some(best) = nearest.best else {
            return Finding::unobserved("nothing was observed in its time");
        };
        if worst.is_none_or(|worst| best.margin < worst.margin) {
            worst = Some(best);
        }
    }
    match worst {
        Some(worst) => Finding::of(worst, None, "nearest that it came"),
        None => Finding::unobserved("no signal"),
    }
}

fn until_finding(limits: &Limits, seen: &Extremes, over_at: Option<SimTime>) -> Finding {
    if seen.broken_at.is_some() {
        return Finding::not_a_number(seen.broken_at);
    }
    let Some(over_at) = over_at else {
        let mut finding = seen.finding(limits, "what is waited for never happened");
        finding.verdict = super::Verdict::Fail;
        return finding;
    };
    if seen.is_empty() {
        return Finding::unobserved("what is waited for held from the start");
    }
    seen.finding(limits, &format!("until {over_at}"))
}

fn speed_finding(along: Along, limits: &Limits, trip: Option<&Trip>) -> Finding {
    let Some(trip) = trip.filter(|trip| trip.now > trip.start) else {
        return Finding::unobserved("nothing was observed in its time");
    };
    if trip.broken_at.is_some() {
        return Finding::not_a_number(trip.broken_at);
    }
    let (dx, dy) = (trip.at[0] - trip.from[0], trip.at[1] - trip.from[1]);
    let distance = match along {
        Along::Heading => dx * libm::cos(trip.heading) + dy * libm::sin(trip.heading),
        Along::Path => trip.path,
    };
    let speed = distance / (trip.now - trip.start).as_secs_f64();
    Finding::of(limits.compare(speed, speed), None, "")
}
