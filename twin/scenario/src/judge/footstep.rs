//! Finding footsteps in the load and place of a foot.

use serde::Serialize;
use twinrig_kernel::{SimDuration, SimTime};

use super::tracker::seconds;

/// One footstep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Footstep {
    /// Index of the leg in [`crate::Judge::legs`].
    pub leg: usize,
    /// When the load first reached the threshold of a touch-down.
    pub touch_down: SimTime,
    /// When the load last fell below the threshold of a lift-off; none if the run ended before.
    pub lift_off: Option<SimTime>,
    /// Place of the foot in the world at touch-down; of several contacts that count as one, at the touch-down of the one
    /// with the largest impulse \[m\].
    pub position: [f64; 3],
    /// Greatest horizontal distance from the place of touch-down while in contact; of several contacts, the sum \[m\].
    pub slip: f64,
    /// Integral of the load \[N·s\].
    pub impulse: f64,
    /// Greatest load, as it was observed \[N\].
    pub peak_load: f64,
}

impl Footstep {
    /// Touch-down to lift-off \[s\]; none if the foot did not lift off.
    pub(crate) fn stance(&self) -> Option<f64> {
        Some(seconds(self.lift_off? - self.touch_down))
    }
}

/// What counts as a footstep, in newtons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Thresholds {
    pub touch_down: f64,
    pub lift_off: f64,
    pub shortest_swing: SimDuration,
    /// \[N·s\]
    pub least_impulse: f64,
}

/// Finds the footsteps of one foot.
#[derive(Clone, Debug)]
pub(crate) struct Detector {
    leg: usize,
    thresholds: Thresholds,
    previous: Option<SimTime>,
    /// The contact that lasts.
    contact: Option<Contact>,
    /// The footstep that is not closed yet: its foot may touch down again at once.
    open: Option<Footstep>,
    /// Impulse of the contact whose place the open footstep has.
    best_impulse: f64,
    /// Whether the open footstep has enough impulse to be one for sure.
    sure: bool,
    /// When a load or a place was no number.
    pub broken_at: Option<SimTime>,
}

/// What an observation of a foot brings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Seen {
    /// The touch-down of the open footstep, which is one for sure from now on.
    pub touch_down: Option<SimTime>,
    /// The footstep that is closed.
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
            best_impulse: 0.0,
            sure: false,
            broken_at: None,
        }
    }

    /// The leg that the foot belongs to.
    pub fn leg(&self) -> usize {
        self.leg
    }

    /// The touch-down of a footstep that may come to nothing.
    pub fn unsure(&self) -> Option<SimTime> {
        let open = self.open.as_ref().filter(|_| !self.sure)?;
        Some(open.touch_down)
    }

    /// Takes an observation: the mean load since the last one, and the place of the foot.
    #[inline]
    pub fn sample(&mut self, now: SimTime, load: f64, position: [f64; 3]) -> Seen {
        let since = self
            .previous
            .map_or(0.0, |previous| (now - previous).as_secs_f64());
        self.previous = Some(now);
        let finite = load.is_finite() && position.iter().all(|x| x.is_finite());
        if !finite {
            self.broken_at.get_or_insert(now);
            return Seen::default();
        }
        if self.contact.is_some() {
            self.stand(now, load, since, position);
            return Seen {
                touch_down: self.become_sure(),
                closed: None,
            };
        }
        let closed = self.close(now);
        if load >= self.thresholds.touch_down {
            self.touch_down(now, load, since, position);
        }
        Seen {
            touch_down: self.become_sure(),
            closed,
        }
    }

    /// The touch-down of the open footstep, once its impulse is enough.
    fn become_sure(&mut self) -> Option<SimTime> {
        let open = self.open.as_ref().filter(|_| !self.sure)?;
        let lasting = self.contact.map_or(0.0, |contact| contact.impulse);
        self.sure = open.impulse + lasting >= self.thresholds.least_impulse;
        self.sure.then_some(open.touch_down)
    }

    /// The open footstep as it would be if the run ended now.
    pub fn so_far(&self) -> Option<Footstep> {
        self.clone().finish()
    }

    /// The footstep that the end of the run leaves open.
    pub fn finish(&mut self) -> Option<Footstep> {
        if self.contact.is_some() {
            self.end_contact();
        }
        self.take_open()
    }

    fn touch_down(&mut self, now: SimTime, load: f64, since: f64, position: [f64; 3]) {
        let impulse = load * since;
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

    fn stand(&mut self, now: SimTime, load: f64, since: f64, position: [f64; 3]) {
        let (Some(contact), Some(open)) = (&mut self.contact, &mut self.open) else {
            return;
        };
        contact.impulse += load * since;
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
        if contact.impulse > self.best_impulse {
            self.best_impulse = contact.impulse;
            open.position = contact.position;
        }
    }

    /// Closes the open footstep if its foot has been off the ground for long enough.
    fn close(&mut self, now: SimTime) -> Option<Footstep> {
        let lift_off = self.open.as_ref()?.lift_off?;
        if now - lift_off < self.thresholds.shortest_swing {
            return None;
        }
        self.take_open()
    }

    fn take_open(&mut self) -> Option<Footstep> {
        self.best_impulse = 0.0;
        let sure = std::mem::take(&mut self.sure);
        let footstep = self.open.take()?;
        (sure || footstep.impulse >= self.thresholds.least_impulse).then_some(footstep)
    }
}
