//! Signals, footsteps and frames of a run, kept in memory.

use std::ops::Range;

use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use twinrig::kernel::{Layout, SimDuration, SimTime, Unit};
use twinrig::runtime::Group;
use twinrig::scenario::Footstep;
use twinrig::{Assembly, RunLayouts, RunObserver, RunProgress};
use twinrig_record::{
    FootstepMessage, FrameSampler, FrameSeries, Recording, SampledGroup, group_name,
};

use crate::poll::SignalPoll;

/// Numbers of a footstep: both times, position, slip, impulse, peak load.
const FOOTSTEP_NUMBERS: usize = 8;

/// Converts a simulated time to the nearest number of seconds.
pub(crate) fn seconds(time: SimTime) -> f64 {
    time.as_nanos() as f64 / 1e9
}

/// Name, symbol of the unit and number of components of a signal.
pub(crate) type SignalRow = (String, String, usize);

/// Samples of a group of signals: a matrix with a row per time.
#[derive(Default)]
pub(crate) struct Samples {
    /// Name of the group, as in recordings.
    pub(crate) name: String,
    /// Signals, in the order of their columns.
    pub(crate) signals: Vec<SignalRow>,
    /// Ranges of the columns in a sample of the group, adjacent ones merged.
    ranges: Vec<Range<usize>>,
    width: usize,
    /// Times \[s\].
    pub(crate) times: Vec<f64>,
    /// Values, row by row.
    pub(crate) values: Vec<f64>,
}

impl Samples {
    /// Selects the signals of a group for which `keep` is true.
    fn of(group: Group, layout: &Layout, keep: &dyn Fn(&str) -> bool) -> Self {
        let mut samples = Self {
            name: group_name(group).to_owned(),
            ..Self::default()
        };
        for field in layout.fields() {
            let port = &field.port;
            if port.size == 0 || !keep(&port.name) {
                continue;
            }
            let unit = Unit::symbol(port.unit).to_owned();
            samples.signals.push((port.name.clone(), unit, port.size));
            samples.width += port.size;
            match samples.ranges.last_mut() {
                Some(last) if last.end == field.offset => last.end = field.range().end,
                _ => samples.ranges.push(field.range()),
            }
        }
        samples
    }

    /// Reads the samples of a group of a recording.
    pub(crate) fn read(recording: &Recording, group: &SampledGroup) -> Self {
        let mut samples = Self {
            name: group.name.clone(),
            ..Self::default()
        };
        for signal in &group.signals {
            let row = (signal.name.clone(), signal.unit.clone(), signal.size);
            samples.signals.push(row);
            samples.width += signal.size;
        }
        samples.times.reserve_exact(group.len());
        samples.values.reserve_exact(group.len() * samples.width);
        for sample in recording.samples(group) {
            samples.times.push(seconds(sample.time));
            samples.values.extend(sample.all());
        }
        samples
    }

    /// Reserves room for `rows` more rows.
    fn reserve(&mut self, rows: usize) -> Result<(), usize> {
        let count = rows.saturating_mul(self.width);
        let failed = |_| count.saturating_add(rows).saturating_mul(size_of::<f64>());
        self.values.try_reserve_exact(count).map_err(failed)?;
        self.times.try_reserve_exact(rows).map_err(failed)
    }

    fn push(&mut self, now: SimTime, values: &[f64]) -> Result<(), usize> {
        if self.times.len() == self.times.capacity() {
            self.reserve(self.times.len().max(1024))?;
        }
        self.times.push(seconds(now));
        for range in &self.ranges {
            self.values.extend_from_slice(&values[range.clone()]);
        }
        Ok(())
    }

    /// Returns name, signals, times and values; the numbers move to Python without a copy.
    pub(crate) fn into_python(self, py: Python<'_>) -> impl IntoPyObject<'_> {
        let (times, values) = (self.times.into_pyarray(py), self.values.into_pyarray(py));
        (self.name, self.signals, times, values)
    }
}

/// Footsteps as columns.
#[derive(Default)]
pub(crate) struct Footsteps {
    /// Names of the legs.
    pub(crate) legs: Vec<String>,
    /// Index of the leg of each footstep.
    leg: Vec<i64>,
    /// Eight numbers per footstep: touch-down and lift-off \[s\], position x, y, z \[m\], slip
    /// \[m\], impulse \[N·s\], peak load \[N\].
    numbers: Vec<f64>,
}

impl Footsteps {
    fn push(&mut self, leg: usize, numbers: [f64; FOOTSTEP_NUMBERS]) {
        self.leg.push(i64::try_from(leg).unwrap_or(i64::MAX));
        self.numbers.extend(numbers);
    }

    /// Adds a footstep of a recording.
    pub(crate) fn push_message(&mut self, message: &FootstepMessage) {
        let known = self.legs.iter().position(|leg| *leg == message.leg);
        let leg = known.unwrap_or_else(|| {
            self.legs.push(message.leg.clone());
            self.legs.len() - 1
        });
        let [x, y, z] = message.position_m.unwrap_or([f64::NAN; 3]);
        let times = [message.touch_down_s, message.lift_off_s];
        let loads = [message.slip_m, message.impulse_ns, message.peak_load_n];
        let ([down, up], [slip, impulse, peak]) = (times, loads);
        self.push(leg, [down, up, x, y, z, slip, impulse, peak]);
    }

    /// Returns names of legs, index of the leg of each footstep, and numbers.
    pub(crate) fn into_python(self, py: Python<'_>) -> impl IntoPyObject<'_> {
        let (leg, numbers) = (self.leg.into_pyarray(py), self.numbers.into_pyarray(py));
        (self.legs, leg, numbers)
    }
}

/// Returns links, times \[s\] and numbers of frames.
pub(crate) fn frames_into_python(series: FrameSeries, py: Python<'_>) -> impl IntoPyObject<'_> {
    let times: Vec<f64> = series.times.into_iter().map(seconds).collect();
    let links = series
        .links
        .into_iter()
        .map(|[parent, child]| (parent, child));
    let links: Vec<_> = links.collect();
    (
        links,
        times.into_pyarray(py),
        series.numbers.into_pyarray(py),
    )
}

/// Observer that keeps the signals that a recording would have.
pub(crate) struct SampleStore<'a> {
    assembly: &'a Assembly<'a>,
    groups: Vec<(Group, Samples)>,
    footsteps: Footsteps,
    frames: Option<FrameSampler>,
    /// Room that could not be reserved \[bytes\]; the run is then pointless.
    pub(crate) missing: Option<usize>,
    /// Poll of Python's signals, where no other thread has it.
    poll: Option<SignalPoll<'a>>,
}

impl<'a> SampleStore<'a> {
    pub(crate) fn new(assembly: &'a Assembly<'a>, poll: Option<SignalPoll<'a>>) -> Self {
        Self {
            assembly,
            groups: Vec::new(),
            footsteps: Footsteps::default(),
            frames: None,
            missing: None,
            poll,
        }
    }

    /// Returns the data of the run.
    pub(crate) fn finish(self) -> RunData {
        RunData {
            groups: self
                .groups
                .into_iter()
                .map(|(_, samples)| samples)
                .collect(),
            footsteps: self.footsteps,
            frames: self.frames.map(FrameSampler::finish).unwrap_or_default(),
        }
    }

    /// Period of the samples of a group.
    fn period(&self, group: Group) -> SimDuration {
        match group {
            Group::Plant | Group::Diagnostics => self.assembly.scenario().observe.period,
            Group::ProcessInputs | Group::ProcessOutputs => self.assembly.period(),
        }
    }

    /// Ends the run if there was no room for its samples.
    fn end_run_unless(&mut self, reserved: Result<(), usize>) {
        if let Err(bytes) = reserved {
            self.missing.get_or_insert(bytes);
            // The next slice of the run is its last.
            if let Some(token) = twinrig::runtime::interrupt::current() {
                token.request();
            }
        }
    }
}

impl RunObserver for SampleStore<'_> {
    fn begin(&mut self, layouts: &RunLayouts<'_>) {
        let scene = self.assembly.scene();
        let keep = |name: &str| scene.recorded.iter().any(|other| other == name);
        let groups = [
            Group::Plant,
            Group::ProcessInputs,
            Group::ProcessOutputs,
            Group::Diagnostics,
        ];
        let duration = self.assembly.end().as_nanos();
        for group in groups {
            let mut samples = Samples::of(group, layouts.layout(group), &keep);
            if samples.signals.is_empty() {
                continue;
            }
            // Both ends of the run are sampled.
            let rows = duration / self.period(group).as_nanos().max(1) + 2;
            let reserved = samples.reserve(usize::try_from(rows).unwrap_or(usize::MAX));
            self.end_run_unless(reserved);
            self.groups.push((group, samples));
        }
        self.footsteps.legs = layouts.legs.to_vec();
        self.frames = self.assembly.frame_period().map(|period| {
            let skeleton = self.assembly.skeleton();
            FrameSampler::new(&skeleton, layouts.layout(Group::Plant), period)
        });
    }

    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if self.missing.is_some() {
            return;
        }
        if group == Group::Plant
            && let Some(frames) = &mut self.frames
        {
            frames.sample(now, values);
        }
        let mut groups = self.groups.iter_mut();
        if let Some((_, samples)) = groups.find(|(of, _)| *of == group) {
            let pushed = samples.push(now, values);
            self.end_run_unless(pushed);
        }
    }

    fn footstep(&mut self, footstep: &Footstep) {
        let up = footstep.lift_off.map_or(f64::NAN, seconds);
        let [x, y, z] = footstep.position;
        let down = seconds(footstep.touch_down);
        let (slip, impulse, peak) = (footstep.slip, footstep.impulse, footstep.peak_load);
        let numbers = [down, up, x, y, z, slip, impulse, peak];
        self.footsteps.push(footstep.leg, numbers);
    }

    fn poll(&mut self, _: &RunProgress<'_>) {
        if let Some(poll) = &mut self.poll {
            poll.poll();
        }
    }
}

/// Signals, footsteps and frames of a run or a recording.
pub(crate) struct RunData {
    pub(crate) groups: Vec<Samples>,
    pub(crate) footsteps: Footsteps,
    pub(crate) frames: FrameSeries,
}

impl RunData {
    /// Adds the data to a dictionary, under `groups`, `footsteps` and `frames`.
    pub(crate) fn add_to(self, to: &Bound<'_, PyDict>) -> PyResult<()> {
        let py = to.py();
        let groups = self.groups.into_iter();
        let groups: Vec<_> = groups.map(|samples| samples.into_python(py)).collect();
        to.set_item("groups", groups)?;
        to.set_item("footsteps", self.footsteps.into_python(py))?;
        to.set_item("frames", frames_into_python(self.frames, py))
    }
}
