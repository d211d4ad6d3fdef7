//! Evaluation of the samples and events of a run.

use twinrig_kernel::SimTime;
use twinrig_runtime::{Group, Observer, RunEvent};

use super::channel::{Cycle, CycleEvent};
use super::gait::FirstLeg;
use super::touch_downs::TouchDown;
use super::{Judge, MonitorKind};

impl Judge {
    #[inline]
    fn find_footsteps(&mut self, now: SimTime, channel: Group, values: &[f64]) {
        for foot in &mut self.feet {
            if foot.channel != channel {
                continue;
            }
            let position = foot.position;
            let position = [values[position], values[position + 1], values[position + 2]];
            let detection = foot.detector.sample(now, values[foot.load], position);
            let leg = foot.detector.leg();
            if leg == 0 {
                let touch_down = detection.touch_down.or(foot.detector.unconfirmed());
                self.first_leg = FirstLeg {
                    touched_down: touch_down == Some(now),
                    confirmed: detection.touch_down.is_some(),
                };
            }
            if let Some(at) = detection.touch_down {
                self.touch_downs.add(TouchDown { at, leg });
            }
            if let Some(step) = detection.closed {
                self.closed.push(step);
            }
        }
        if !self.touch_downs.pending().is_empty() {
            self.release_touch_downs(now);
        }
        for step in &self.closed {
            for index in self.step_monitors.iter().chain(&self.gait_monitors) {
                self.monitors[*index].step(step);
            }
        }
    }

    /// Evaluates the samples of a channel for claims about a gait.
    #[inline]
    fn observe_gaits(&mut self, now: SimTime, channel: Group, values: &[f64]) {
        for index in &self.gait_monitors {
            let monitor = &mut self.monitors[*index];
            let MonitorKind::Gait(meter) = &mut monitor.meter else {
                continue;
            };
            if monitor.fell {
                continue;
            }
            if meter.reads(channel) {
                meter.phases(now, channel, values);
            }
            if monitor.channel == channel && monitor.window.contains(now) {
                monitor.samples += 1;
                meter.sample(now, values, self.first_leg);
            }
            if monitor.channel == channel && self.first_leg.confirmed {
                meter.confirm_cycle();
            }
        }
    }

    /// Releases the touch-downs that no earlier one can precede any more. A future one is not
    /// before `now`, nor before the touch-down of a foot whose footstep is unconfirmed.
    pub(super) fn release_touch_downs(&mut self, now: SimTime) {
        let unconfirmed = self.feet.iter().filter_map(|foot| {
            let at = foot.detector.unconfirmed()?;
            let leg = foot.detector.leg();
            Some(TouchDown { at, leg })
        });
        let now = TouchDown { at: now, leg: 0 };
        let horizon = unconfirmed.fold(now, TouchDown::min);
        while let Some(touch_down) = self.touch_downs.next_before(horizon) {
            for index in &self.step_monitors {
                let monitor = &mut self.monitors[*index];
                if let (MonitorKind::Footsteps(meter), false) = (&mut monitor.meter, monitor.fell) {
                    meter.touch_down(touch_down);
                }
            }
        }
    }

    /// Handles a fall at `now`: claims about an upright robot end, with the footsteps up to now.
    fn handle_fall(&mut self, now: SimTime) {
        if self.fall.ended_at().is_some() {
            self.ended_at.get_or_insert(now);
        }
        self.load_cycles.finish(&mut self.monitors);
        for (monitor, expectation) in self.monitors.iter_mut().zip(&self.expectations) {
            if !expectation.claim.requires_upright_robot() || monitor.window.before < now {
                continue;
            }
            match &mut monitor.meter {
                MonitorKind::Footsteps(meter) => {
                    for touch_down in self.touch_downs.pending() {
                        meter.touch_down(*touch_down);
                    }
                }
                MonitorKind::Signal(meter) => meter.fall(now),
                _ => {}
            }
            let open = self
                .feet
                .iter()
                .filter_map(|foot| foot.detector.provisional());
            for step in open {
                monitor.step(&step);
            }
            monitor.take_samples(&self.foot_samples);
            monitor.fell = true;
        }
    }
}

impl Observer for Judge {
    /// # Panics
    /// If the length of `values` differs from that of the layout passed to [`Judge::new`].
    #[inline]
    fn samples(&mut self, now: SimTime, channel: Group, values: &[f64]) {
        assert_eq!(
            values.len(),
            self.lengths[channel as usize],
            "the number of samples differs from the layout"
        );
        self.closed.clear();
        self.load_cycles.clear();
        self.first_leg = FirstLeg::default();
        if !self.reads[channel as usize] {
            return;
        }
        if self.fall.sample(now, channel, values) {
            self.handle_fall(now);
        }
        self.find_footsteps(now, channel, values);
        if channel == self.foot_channel {
            self.load_cycles.sample(now, values, &mut self.monitors);
            for count in &mut self.foot_samples {
                count.samples += u64::from(count.window.contains(now));
            }
        }
        for index in &self.signal_monitors[channel as usize] {
            let monitor = &mut self.monitors[*index];
            if monitor.fell {
                continue;
            }
            let MonitorKind::Signal(meter) = &mut monitor.meter else {
                continue;
            };
            if monitor.window.contains(now) {
                monitor.samples += u64::from(meter.sample(now, values));
                if meter.ends_the_run() {
                    self.ended_at.get_or_insert(now);
                }
            } else {
                meter.outside(values);
            }
        }
        self.observe_gaits(now, channel, values);
        for index in &self.pair_monitors[channel as usize] {
            let monitor = &mut self.monitors[*index];
            let in_window = monitor.window.contains(now);
            monitor.samples += match &mut monitor.meter {
                MonitorKind::Comparison(meter) => meter.sample(now, channel, values, in_window),
                MonitorKind::Sequence(meter) => meter.sample(now, channel, values, in_window),
                _ => 0,
            };
        }
    }

    #[inline]
    fn event(&mut self, now: SimTime, event: RunEvent) {
        let Some((of, event)) = CycleEvent::of(event) else {
            return;
        };
        for index in &self.cycle_monitors {
            let monitor = &mut self.monitors[*index];
            let MonitorKind::Cycle(cycle, meter) = &mut monitor.meter else {
                continue;
            };
            if !monitor.window.contains(now) {
                continue;
            }
            if *cycle == of {
                meter.event(now, event);
            } else if *cycle == Cycle::Control && event == CycleEvent::Missed {
                meter.skip(now);
            }
        }
    }
}
