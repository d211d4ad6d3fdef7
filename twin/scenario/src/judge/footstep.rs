//! Detection of footsteps from the load and position of a foot.

use serde::Serialize;
use twinrig_kernel::{SimDuration, SimTime};

use super::tracker::seconds;
use crate::scene::Scene;

/// One footstep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Footstep {
    /// Index of the leg in [`crate::Judge::legs`].
    pub leg: usize,
    /// Time at which the load first reached the touch-down threshold.
    pub touch_down: SimTime,
    /// Time at which the load last fell below the lift-off threshold; none if the run ended before.
    pub lift_off: Option<SimTime>,
    /// World position of the foot at touch-down \[m\]; if several contacts were merged, at the
    /// touch-down of the one with the largest impulse.
    pub position: [f64; 3],
    /// Greatest horizontal distance from the touch-down position during contact \[m\]; if several
    /// contacts were merged, the sum.
    pub slip: f64,
    /// Integral of the load \[N·s\].
    pub impulse: f64,
    /// Greatest observed load \[N\].
    pub peak_load: f64,
}

impl Footstep {
    /// Returns the stance time \[s\]; none if the foot did not lift off.
    pub(crate) fn stance(&self) -> Option<f64> {
        Some(seconds(self.lift_off? - self.touch_down))
    }
}

/// Thresholds of a footstep, in newtons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Thresholds {
    pub touch_down: f64,
    pub lift_off: f64,
    pub shortest_swing: SimDuration,
    /// \[N·s\]
    pub least_impulse: f64,
}

impl Thresholds {
    /// Returns the thresholds of the scene, whose weight scales them.
    pub fn of(scene: &Scene) -> Self {
        let spec = scene.scenario.observe.footsteps;
        Self {
            touch_down: spec.touch_down.newton(scene.weight),
            lift_off: spec.lift_off.newton(scene.weight),
            shortest_swing: spec.shortest_swing,
            least_impulse: spec.least_impulse * scene.weight,
        }
    }
}

/// Detector of the footsteps of one foot.
#[derive(Clone, Debug)]
pub(crate) struct Detector {
    leg: usize,
    thresholds: Thresholds,
    previous: Option<SimTime>,
    /// Present contact.
    contact: Option<Contact>,
    /// Footstep that may continue, because its foot may touch down again within the shortest swing.
    open: Option<Footstep>,
    /// Impulse of the contact that defines the position of the open footstep.
    largest_impulse: f64,
    /// Whether the impulse of the open footstep has reached the threshold.
    confirmed: bool,
    /// Time at which a load or a position was first not finite.
    pub non_finite_at: Option<SimTime>,
}

/// Result of an observation of a foot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Detection {
    /// Touch-down of the open footstep, if it is confirmed by this observation.
    pub touch_down: Option<SimTime>,
    /// Footstep completed by this observation.
    pub closed: Option<Footstep>,
}

#[derive(Clone, Copy, Debug)]
struct Contact {
    position: [f64; 3],
    impulse: f64,
    /// Square of the greatest horizontal distance from `position`.
    slip_squared: f64,
}

impl Detector {
    pub fn new(leg: usize, thresholds: Thresholds) -> Self {
        Detector {
            leg,
            thresholds,
            previous: None,
            contact: None,
            open: None,
            largest_impulse: 0.0,
            confirmed: false,
            non_finite_at: None,
        }
    }

    /// Returns the leg of the foot.
    pub fn leg(&self) -> usize {
        self.leg
    }

    /// Returns the touch-down of an open footstep that is not confirmed.
    pub fn unconfirmed(&self) -> Option<SimTime> {
        let open = self.open.as_ref().filter(|_| !self.confirmed)?;
        Some(open.touch_down)
    }

    /// Evaluates an observation: the mean load since the previous one, and the position of the
    /// foot.
    #[inline]
    pub fn sample(&mut self, now: SimTime, load: f64, position: [f64; 3]) -> Detection {
        let elapsed = self
            .previous
            .map_or(0.0, |previous| (now - previous).as_secs_f64());
        self.previous = Some(now);
        let finite = load.is_finite() && position.iter().all(|x| x.is_finite());
        if !finite {
            self.non_finite_at.get_or_insert(now);
            return Detection::default();
        }
        if self.contact.is_some() {
            self.continue_contact(now, load, elapsed, position);
            return Detection {
                touch_down: self.confirm(),
                closed: None,
            };
        }
        let closed = self.close(now);
        if load >= self.thresholds.touch_down {
            self.touch_down(now, load, elapsed, position);
        }
        Detection {
            touch_down: self.confirm(),
            closed,
        }
    }

    /// Confirms the open footstep once its impulse has reached the threshold; returns its
    /// touch-down.
    fn confirm(&mut self) -> Option<SimTime> {
        let open = self.open.as_ref().filter(|_| !self.confirmed)?;
        let contact_impulse = self.contact.map_or(0.0, |contact| contact.impulse);
        self.confirmed = open.impulse + contact_impulse >= self.thresholds.least_impulse;
        self.confirmed.then_some(open.touch_down)
    }

    /// Returns the open footstep as if the run ended now.
    pub fn provisional(&self) -> Option<Footstep> {
        self.clone().finish()
    }

    /// Returns the footstep that is open at the end of the run.
    pub fn finish(&mut self) -> Option<Footstep> {
        if self.contact.is_some() {
            self.end_contact();
        }
        self.take_open()
    }

    fn touch_down(&mut self, now: SimTime, load: f64, elapsed: f64, position: [f64; 3]) {
        let impulse = load * elapsed;
        self.contact = Some(Contact {
            position,
            impulse,
            slip_squared: 0.0,
        });
        let open = self.open.get_or_insert(Footstep {
            leg: self.leg,
            touch_down: now,
            lift_off: None,
            position,
            slip: 0.0,
            impulse: 0.0,
            peak_load: load,
        });
        open.lift_off = None;
        open.peak_load = open.peak_load.max(load);
    }

    fn continue_contact(&mut self, now: SimTime, load: f64, elapsed: f64, position: [f64; 3]) {
        let (Some(contact), Some(open)) = (&mut self.contact, &mut self.open) else {
            return;
        };
        contact.impulse += load * elapsed;
        if load < self.thresholds.lift_off {
            open.lift_off = Some(now);
            self.end_contact();
            return;
        }
        let (dx, dy) = (
            position[0] - contact.position[0],
            position[1] - contact.position[1],
        );
        contact.slip_squared = contact.slip_squared.max(dx * dx + dy * dy);
        open.peak_load = open.peak_load.max(load);
    }

    fn end_contact(&mut self) {
        let (Some(contact), Some(open)) = (self.contact.take(), &mut self.open) else {
            return;
        };
        open.impulse += contact.impulse;
        open.slip += contact.slip_squared.sqrt();
        if contact.impulse > self.largest_impulse {
            self.largest_impulse = contact.impulse;
            open.position = contact.position;
        }
    }

    /// Completes the open footstep if its foot has been off the ground for the shortest swing.
    fn close(&mut self, now: SimTime) -> Option<Footstep> {
        let lift_off = self.open.as_ref()?.lift_off?;
        if now - lift_off < self.thresholds.shortest_swing {
            return None;
        }
        self.take_open()
    }

    fn take_open(&mut self) -> Option<Footstep> {
        self.largest_impulse = 0.0;
        let confirmed = std::mem::take(&mut self.confirmed);
        let footstep = self.open.take()?;
        (confirmed || footstep.impulse >= self.thresholds.least_impulse).then_some(footstep)
    }
}
