//! Monitors of expectations.

use twinrig_kernel::signal::parse_leg;

use super::Group;
use super::channel::Cycle;
use super::compare::CompareMeter;
use super::cycle::CycleMeter;
use super::footstep::Footstep;
use super::gait::GaitMeter;
use super::labels::Label;
use super::load_cycle::LoadCycle;
use super::meter::Meter;
use super::outcome::{Finding, Verdict};
use super::sequence::SequenceMeter;
use super::steps::StepMeter;
use super::tracker::Window;

/// Monitor of one expectation.
#[derive(Clone, Debug)]
pub(super) struct Monitor {
    pub window: Window,
    pub channel: Group,
    pub meter: MonitorKind,
    /// Names of the elements that a claim about signals is of.
    pub labels: Vec<Label>,
    /// Number of evaluated samples of the channel; of footsteps, see [`Judge::foot_samples`].
    pub samples: u64,
    /// Whether the robot fell within the window of a claim about an upright robot, which is then
    /// judged by the data before the fall.
    pub fell: bool,
}

#[derive(Clone, Debug)]
pub(super) enum MonitorKind {
    Signal(Meter),
    Comparison(CompareMeter),
    Sequence(Box<SequenceMeter>),
    Cycle(Cycle, CycleMeter),
    Footsteps(StepMeter),
    Gait(Box<GaitMeter>),
    /// Judged from the final data of the run.
    AtEnd,
    /// Not observable, with the reason.
    Absent(String),
}

/// Number of samples in a window.
#[derive(Clone, Debug)]
pub(super) struct SampleCount {
    pub window: Window,
    pub samples: u64,
}

impl Monitor {
    pub fn is_of_footsteps(&self) -> bool {
        matches!(self.meter, MonitorKind::Footsteps(_))
    }

    /// Returns whether it evaluates cycles of the loads.
    pub fn reads_load_cycles(&self) -> bool {
        matches!(&self.meter, MonitorKind::Footsteps(meter) if meter.reads_load_cycles())
    }

    /// Returns whether it is of two signals and evaluates samples of `group`.
    pub fn reads_pair(&self, group: Group) -> bool {
        match &self.meter {
            MonitorKind::Comparison(meter) => meter.reads(group),
            MonitorKind::Sequence(meter) => meter.reads(group),
            _ => false,
        }
    }

    /// Returns whether a fall is a part of the measured value.
    pub fn includes_falls(&self) -> bool {
        matches!(&self.meter, MonitorKind::Gait(meter) if meter.includes_falls())
    }

    /// Adds a completed footstep, unless the robot has fallen.
    pub fn step(&mut self, step: &Footstep) {
        match &mut self.meter {
            _ if self.fell => {}
            MonitorKind::Footsteps(meter) => meter.step(step),
            MonitorKind::Gait(meter) if self.window.contains(step.touch_down) => meter.step(step),
            _ => {}
        }
    }

    /// Adds a cycle of the loads, unless the robot has fallen.
    pub fn load_cycle(&mut self, cycle: &LoadCycle) {
        if let (MonitorKind::Footsteps(meter), false) = (&mut self.meter, self.fell) {
            meter.load_cycle(cycle);
        }
    }

    /// Names the element that a finding is of. A failure also names its instant, except where the
    /// element never was where it had to be.
    pub fn named(&self, mut finding: Finding) -> Finding {
        let Some(label) = self.label(finding.element) else {
            return finding;
        };
        let witness = &mut finding.witness;
        witness.leg = parse_leg(&label.signal).map(|(leg, _)| leg.to_owned());
        witness.signal = Some(label.signal.clone());
        witness.element = label.component;
        let fails = finding.verdict == Verdict::Fail;
        // The remark on the first violation has that instant.
        let is_new = fails && witness.at != finding.first_violation;
        let at = witness.at.filter(|_| is_new || !label.short.is_empty());
        let at = at.map(|at| format!("at {:.3} s", at.as_secs_f64()));
        let what = match finding.detail.as_str() {
            "" => "worst",
            detail => detail,
        };
        let detail = match (label.short.as_str(), at) {
            ("", None) => return finding,
            ("", Some(at)) => format!("{what} {at}"),
            (short, None) => format!("{what}: {short}"),
            (short, Some(at)) => format!("{what}: {short} {at}"),
        };
        finding.detail = detail;
        finding
    }

    /// Returns the label of an element; the only one if the finding has none.
    fn label(&self, element: Option<usize>) -> Option<&Label> {
        match (element, self.labels.as_slice()) {
            (Some(element), labels) => labels.iter().find(|label| label.element == element),
            (None, [only]) => Some(only),
            (None, _) => None,
        }
    }

    /// Takes the number of samples so far over, if it is a monitor of footsteps.
    pub fn take_samples(&mut self, counts: &[SampleCount]) {
        if self.is_of_footsteps() {
            let count = counts.iter().find(|count| count.window == self.window);
            self.samples = count.map_or(0, |count| count.samples);
        }
    }
}

/// Returns a count for each window of the monitors of footsteps: most of them share one.
pub(super) fn sample_counts(monitors: &[Monitor]) -> Vec<SampleCount> {
    let mut counts: Vec<SampleCount> = Vec::new();
    for monitor in monitors.iter().filter(|monitor| monitor.is_of_footsteps()) {
        let window = monitor.window;
        if counts.iter().all(|count| count.window != window) {
            counts.push(SampleCount { window, samples: 0 });
        }
    }
    counts
}
