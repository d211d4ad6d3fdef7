//! Messages of a run, from its samples, events and bytes: for a file, or for viewers of a run that
//! goes on.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Group, RunEvent};

use crate::cdr::{self, CdrWriter};
use crate::channels::{RecordedGroup, Sampled, add_group, add_topic, add_traces};
use crate::messages::DEVICES_ARE_OPEN;
use crate::poses::Poses;
use crate::run_info::RunInfo;
use crate::sink::{ChannelId, Sink};
use crate::{ChangeMessage, EPOCH, EventMessage, Message, RecordError, Skeleton, Topic};

/// Encoder of a run, whose messages `sink` receives.
pub struct Encoder<S: Sink> {
    pub(crate) sink: S,
    groups: [Option<Sampled>; 4],
    topics: [Option<ChannelId>; Topic::ALL.len()],
    traces: Vec<ChannelId>,
    poses: Option<(Poses, SimDuration)>,
    poses_due: SimTime,
    /// Buffer of the message being encoded.
    scratch: Vec<u8>,
    tasks: Vec<String>,
    variables: Vec<String>,
}

impl<S: Sink> Encoder<S> {
    /// Adds the channels of a run to `sink`. Frames are derived from the plant every `frames`, if
    /// that is among `groups`.
    ///
    /// # Errors
    /// [`RecordError::Describe`].
    pub fn new(
        mut sink: S,
        info: &RunInfo,
        groups: &[RecordedGroup<'_>],
        skeleton: &Skeleton,
        frames: Option<SimDuration>,
    ) -> Result<Self, RecordError> {
        let plant = groups.iter().find(|group| group.group == Group::Plant);
        let poses = frames.zip(plant).map(|(period, plant)| {
            let poses = Poses::new(skeleton, plant.layout, plant.keep);
            (poses, period)
        });
        let mut sampled = [const { None }; 4];
        for declared in groups {
            sampled[declared.group as usize] = Some(add_group(&mut sink, declared)?);
        }
        let mut topics = [const { None }; Topic::ALL.len()];
        let pose_topics = poses.iter().flat_map(|(poses, _)| poses.topics());
        for topic in Topic::MESSAGES.into_iter().chain(pose_topics) {
            topics[topic as usize] = Some(add_topic(&mut sink, topic));
        }
        if poses.is_some() && !info.description.is_empty() {
            topics[Topic::Description as usize] = Some(add_topic(&mut sink, Topic::Description));
        }
        let traces = add_traces(&mut sink, &info.traces);
        Ok(Self {
            sink,
            traces,
            groups: sampled,
            topics,
            poses,
            poses_due: SimTime::ZERO,
            scratch: Vec::with_capacity(8192),
            tasks: info.tasks.clone(),
            variables: info.variables.clone(),
        })
    }

    /// Encodes the description of the robot at `now`, if the run has one.
    pub fn describe(&mut self, now: SimTime, description: &str) {
        if let Some(channel) = self.topics[Topic::Description as usize] {
            CdrWriter::new(&mut self.scratch).text(description);
            self.write_scratch(channel, now);
        }
    }

    /// Returns the receiver of the messages.
    pub fn sink(&mut self) -> &mut S {
        &mut self.sink
    }

    /// Continues at an earlier time: the next sample has its frames.
    pub fn restart(&mut self) {
        self.poses_due = SimTime::ZERO;
    }

    /// Encodes the selected signals of `group` at `now`, and the frames where they are due;
    /// `values` has the layout of the group. Undeclared groups have no message.
    #[inline]
    pub fn sample(&mut self, now: SimTime, group: Group, values: &[f64]) {
        let Some(sampled) = &self.groups[group as usize] else {
            return;
        };
        if !sampled.ranges.is_empty() {
            let (channel, size) = (sampled.channel, sampled.size);
            self.sink.message(channel, log_time(now), size, |message| {
                let (header, mut rest) = message.split_at_mut(cdr::HEADER.len());
                header.copy_from_slice(&cdr::HEADER);
                for range in &sampled.ranges {
                    let kept = &values[range.clone()];
                    let (bytes, after) = rest.split_at_mut(kept.len() * 8);
                    for (bytes, value) in bytes.chunks_exact_mut(8).zip(kept) {
                        bytes.copy_from_slice(&value.to_bits().to_le_bytes());
                    }
                    rest = after;
                }
            });
        }
        if group == Group::Plant && now >= self.poses_due {
            self.write_poses(now, values);
        }
    }

    fn write_poses(&mut self, now: SimTime, values: &[f64]) {
        let Some((poses, period)) = &mut self.poses else {
            self.poses_due = SimTime::from_nanos(u64::MAX);
            return;
        };
        self.poses_due = now + *period;
        let stamp = cdr::stamp(now);
        for topic in Topic::POSES {
            if let Some(channel) = self.topics[topic as usize]
                && let Some(message) = poses.message(topic, stamp, values)
            {
                let fill = |room: &mut [u8]| room.copy_from_slice(message);
                self.sink
                    .message(channel, log_time(now), message.len(), fill);
            }
        }
    }

    /// Encodes bytes transmitted on a wire trace at `now`; those of undeclared traces have no
    /// message.
    pub fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        if let Some(&channel) = self.traces.get(trace) {
            CdrWriter::new(&mut self.scratch).octets(bytes);
            self.write_scratch(channel, now);
        }
    }

    /// Encodes `message` at `now`.
    pub fn message<M: Message>(&mut self, now: SimTime, message: &M) {
        if let Some(channel) = self.topics[M::TOPIC as usize] {
            message.write(cdr::stamp(now), &mut CdrWriter::new(&mut self.scratch));
            self.write_scratch(channel, now);
        }
    }

    fn write_scratch(&mut self, channel: ChannelId, now: SimTime) {
        let scratch = &self.scratch;
        let fill = |room: &mut [u8]| room.copy_from_slice(scratch);
        self.sink
            .message(channel, log_time(now), scratch.len(), fill);
    }

    /// Encodes changes and exceptional events (skipped tasks, overruns). Begin and end of processes
    /// and tasks, and skips that follow from the periods, are frequent and follow from the
    /// scenario: they have no message.
    #[inline]
    pub fn event(&mut self, now: SimTime, event: RunEvent) {
        if !is_regular(event) {
            self.exceptional_event(now, event);
        }
    }

    fn exceptional_event(&mut self, now: SimTime, event: RunEvent) {
        let event_message = |event: &str| EventMessage {
            event: event.to_owned(),
            part: None,
            count: None,
        };
        match event {
            RunEvent::TaskSkipped {
                task,
                implied: false,
            } => {
                let message = EventMessage {
                    part: Some(name(&self.tasks, task)),
                    ..event_message("task skipped")
                };
                self.message(now, &message);
            }
            RunEvent::Overrun { missed } => {
                let message = EventMessage {
                    count: Some(missed),
                    ..event_message("overrun")
                };
                self.message(now, &message);
            }
            RunEvent::Change { variable, value } => {
                let variable = name(&self.variables, variable);
                self.message(now, &ChangeMessage { variable, value });
            }
            RunEvent::Opened => self.message(now, &event_message(DEVICES_ARE_OPEN)),
            RunEvent::ProcessBegin { .. }
            | RunEvent::ProcessEnd
            | RunEvent::TaskBegin { .. }
            | RunEvent::TaskEnd { .. }
            | RunEvent::TaskSkipped { .. } => {}
        }
    }
}

/// Returns whether an event is one of each control step.
#[inline]
pub(crate) fn is_regular(event: RunEvent) -> bool {
    matches!(
        event,
        RunEvent::ProcessBegin { .. }
            | RunEvent::ProcessEnd
            | RunEvent::TaskBegin { .. }
            | RunEvent::TaskEnd { .. }
            | RunEvent::TaskSkipped { implied: true, .. }
    )
}

fn name(names: &[String], number: usize) -> String {
    names
        .get(number)
        .cloned()
        .unwrap_or_else(|| number.to_string())
}

/// Converts `now` to the time line of recordings \[ns\].
pub(crate) fn log_time(now: SimTime) -> u64 {
    now.as_nanos().saturating_add(EPOCH.as_nanos())
}
