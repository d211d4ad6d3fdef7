//! Coordinate frames over time, for programs that evaluate them: the numbers of the `/tf` messages.

use twinrig_kernel::{Layout, SimDuration, SimTime};

use super::frames::{ABDUCTOR, Frames, UPPER, transforms};
use super::{Signals, Skeleton};
use crate::cdr;

/// Coordinate frames of the trunk and of the leg segments over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameSeries {
    /// Names of parent and child of each transform, parents first.
    pub links: Vec<[String; 2]>,
    /// Times of the samples.
    pub times: Vec<SimTime>,
    /// Seven numbers per sample and link: position of the child in its parent, x, y, z \[m\], and
    /// its orientation as a unit quaternion x, y, z, w.
    pub numbers: Vec<f64>,
}

/// Links of a leg in a [`FrameSeries`], by their indices.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LegLinks {
    /// Name of the leg.
    pub name: String,
    /// Upper segment; middle and lower segment and foot follow.
    pub upper: usize,
    /// Part between trunk and upper segment, of a leg that abducts.
    pub abductor: Option<usize>,
}

impl FrameSeries {
    /// Links of a leg, from the upper segment to the foot.
    const LEG: usize = 4;

    /// Returns the links of the legs.
    pub fn legs(&self) -> Vec<LegLinks> {
        // Recordings of builds before 0.1.0 have a slash, and name segments by their upper joints.
        let part = |index: usize| self.links[index][1].rsplit_once(['_', '/']);
        let is_upper = |part: &str| part == UPPER || part == "hip";
        let ends = 1..(self.links.len() + 1).saturating_sub(Self::LEG);
        let legs = ends.filter_map(|upper| {
            let (name, _) = part(upper).filter(|(_, part)| is_upper(part))?;
            Some(LegLinks {
                name: name.to_owned(),
                upper,
                abductor: (part(upper - 1) == Some((name, ABDUCTOR))).then(|| upper - 1),
            })
        });
        legs.collect()
    }

    /// Adds the frames of a message; `None` if it is invalid or has other links than its
    /// predecessors.
    pub(crate) fn add(&mut self, now: SimTime, message: &[u8]) -> Option<()> {
        let transforms = transforms(message)?;
        if self.times.is_empty() {
            let links = transforms.iter().map(|transform| transform.link.clone());
            self.links = links.collect();
        }
        let links = transforms.iter().map(|transform| &transform.link);
        links.eq(&self.links).then_some(())?;
        self.times.push(now);
        for transform in transforms {
            self.numbers.extend(transform.numbers);
        }
        Some(())
    }
}

/// Collects the frames of a run from the samples of its plant, at the times at which a recording
/// has them.
#[derive(Debug, Clone)]
pub struct FrameSampler {
    frames: Frames,
    period: SimDuration,
    due: Option<SimTime>,
    series: FrameSeries,
}

impl FrameSampler {
    /// Creates a sampler of a plant whose samples have the given layout.
    pub fn new(skeleton: &Skeleton, layout: &Layout, period: SimDuration) -> Self {
        // Frames do not depend on the selection of recorded signals.
        let keep = |_: &str| true;
        let signals = Signals {
            layout,
            keep: &keep,
        };
        Self {
            frames: Frames::new(skeleton, &signals),
            period,
            due: Some(SimTime::ZERO),
            series: FrameSeries::default(),
        }
    }

    /// Takes a sample of the plant into account.
    pub fn sample(&mut self, now: SimTime, values: &[f64]) {
        if self.due.is_some_and(|due| now >= due) {
            self.due = now.checked_add(self.period);
            let message = self.frames.at(cdr::stamp(now), values);
            // A message of the same frames is valid and has the same links.
            let _ = self.series.add(now, message);
        }
    }

    /// Returns the collected frames.
    pub fn finish(self) -> FrameSeries {
        self.series
    }
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::{Direction, Port, Unit};
    use twinrig_runtime::Group;

    use super::*;
    use crate::{Cadence, Digest, Fingerprint, RecordedGroup, Recorder, Recording, RunInfo};

    #[test]
    fn legs_are_found_by_the_names_of_their_links() {
        let legs = |names: &str| {
            let links = names
                .split(' ')
                .map(|name| [String::new(), name.to_owned()]);
            let series = FrameSeries {
                links: links.collect(),
                ..FrameSeries::default()
            };
            let legs = series.legs().into_iter();
            let legs = legs.map(|leg| (leg.name, leg.upper, leg.abductor));
            legs.collect::<Vec<_>>()
        };
        let of = |name: &str, upper, abductor| (name.to_owned(), upper, abductor);
        let two = "trunk LF_upper LF_middle LF_lower LF_foot \
                   A_B_abductor A_B_upper A_B_middle A_B_lower A_B_foot";
        assert_eq!(legs(two), [of("LF", 1, None), of("A_B", 6, Some(5))]);
        let former = "body LF/hip LF/knee LF/ankle LF/foot RF/hip RF/knee RF/ankle RF/foot";
        assert_eq!(legs(former), [of("LF", 1, None), of("RF", 5, None)]);
        // Of the recording of another program.
        assert_eq!(legs("trunk LF_upper LF_middle"), []);
        assert_eq!(legs("LF_upper"), []);
    }

    #[test]
    fn sampler_collects_the_frames_of_a_recording() {
        let ports = [
            Port::output("body/position", Unit::Meter, 3),
            Port::output("leg/LF/angles", Unit::Radian, 3),
        ];
        let layout = Layout::of(&ports, Direction::Output);
        let leg = crate::SkeletonLeg {
            name: "LF".to_owned(),
            hip: [0.1, 0.05, 0.0],
            segments: [0.044, 0.071, 0.039],
            reference: [0.0; 3],
            abduction: None,
        };
        let skeleton = Skeleton { legs: vec![leg] };
        let period = SimDuration::from_millis(5);
        let cadence = Cadence {
            frames: Some(period),
            ..Cadence::default()
        };
        let group = RecordedGroup {
            group: Group::Plant,
            layout: &layout,
            keep: &|_| false,
        };
        let info = RunInfo::default();
        let recorder = Recorder::new(Vec::new(), &info, &[group], &skeleton, cadence);
        let mut recorder = recorder.unwrap();
        let mut sampler = FrameSampler::new(&skeleton, &layout, period);
        for step in 0..20 {
            let now = SimTime::from_nanos(2_000_000 * step);
            let values = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6].map(|value| value * step as f64);
            recorder.sample(now, Group::Plant, &values);
            sampler.sample(now, &values);
        }
        let digest: Digest = Fingerprint::new().digest();
        let end = SimTime::from_nanos(38_000_000);
        let recording = Recording::from_bytes(recorder.finish(digest, end).unwrap()).unwrap();
        let series = sampler.finish();
        assert_eq!(series, recording.frames().unwrap());
        // Every third sample is the first at or after the end of a period.
        let times: Vec<u64> = series.times.iter().map(|time| time.as_nanos()).collect();
        assert_eq!(times, [0, 3, 6, 9, 12, 15, 18].map(|n| 2_000_000 * n));
        assert_eq!(series.links[4], ["LF_lower", "LF_foot"]);
        assert_eq!(series.numbers.len(), 7 * 5 * 7);
        assert_eq!(series.numbers[35..38], [0.1 * 3.0, 0.2 * 3.0, 0.3 * 3.0]);
    }
}
