//! State of the robot in standard messages for ROS 2 viewers and tools: coordinate frames,
//! odometry, joints. All numbers are taken from recorded samples of the plant; none is computed
//! additionally.

mod frames;
mod joints;
mod odometry;
mod series;

use twinrig_kernel::{Layout, Unit};

pub use frames::{Skeleton, SkeletonLeg};
pub use series::{FrameSampler, FrameSeries};

use crate::Topic;
use frames::Frames;
use joints::Joints;
use odometry::Odometry;

/// Fixed frame.
const WORLD: &str = "world";
/// Frame of the trunk.
const BODY: &str = "body";

/// Converts samples of the plant to messages without allocation: each message is created once and
/// its numbers are overwritten.
#[derive(Debug, Clone)]
pub(crate) struct Poses {
    frames: Frames,
    odometry: Option<Odometry>,
    joints: Option<Joints>,
}

impl Poses {
    /// Creates the messages of a plant whose samples have the given layout. Odometry and joints use
    /// recorded signals only, which `keep` selects.
    pub(crate) fn new(skeleton: &Skeleton, layout: &Layout, keep: &dyn Fn(&str) -> bool) -> Self {
        let signals = Signals { layout, keep };
        Self {
            frames: Frames::new(skeleton, &signals),
            odometry: Odometry::new(&signals),
            joints: Joints::new(&signals),
        }
    }

    /// Topics for which there are messages.
    pub(crate) fn topics(&self) -> impl Iterator<Item = Topic> {
        let odometry = self.odometry.as_ref().map(|_| Topic::Odometry);
        let joints = self.joints.as_ref().map(|_| Topic::Joints);
        [Topic::Frames].into_iter().chain(odometry).chain(joints)
    }

    /// Returns the message of `topic` for a sample; `None` if there is none.
    pub(crate) fn message(
        &mut self,
        topic: Topic,
        stamp: [u8; 8],
        values: &[f64],
    ) -> Option<&[u8]> {
        match topic {
            Topic::Frames => Some(self.frames.at(stamp, values)),
            Topic::Odometry => Some(self.odometry.as_mut()?.at(stamp, values)),
            Topic::Joints => Some(self.joints.as_mut()?.at(stamp, values)),
            Topic::Events | Topic::Footsteps | Topic::Changes | Topic::Verdict => None,
        }
    }
}

/// Signals in a sample of the plant.
struct Signals<'a> {
    layout: &'a Layout,
    keep: &'a dyn Fn(&str) -> bool,
}

impl Signals<'_> {
    /// Returns the offset of the signal `name` if it has `size` components.
    fn start(&self, name: &str, size: usize) -> Option<usize> {
        let range = self.layout.find(name)?;
        (range.len() == size).then_some(range.start)
    }

    /// As [`Signals::start`], for recorded signals only.
    fn recorded(&self, name: &str, size: usize) -> Option<usize> {
        self.start(name, size).filter(|_| (self.keep)(name))
    }

    /// Returns the names and offsets of the recorded signals with one component in `unit`.
    fn of_unit(&self, unit: Unit) -> impl Iterator<Item = (&str, usize)> {
        let fields = self.layout.fields();
        let scalars = fields.filter(move |field| field.port.unit == unit && field.port.size == 1);
        let scalars = scalars.map(|field| (field.port.name.as_str(), field.range().start));
        scalars.filter(|(name, _)| (self.keep)(name))
    }
}
