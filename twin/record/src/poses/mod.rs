//! The state of the robot in standard messages, so that viewers and tools of ROS 2 show it: coordinate frames, odometry,
//! joints. They are made of signals that a sample of the plant holds, and none is computed for them.

mod frames;
mod joints;
mod odometry;

use twinrig_kernel::{Layout, Unit};

pub use frames::{Skeleton, SkeletonLeg};

use crate::Topic;
use frames::Frames;
use joints::Joints;
use odometry::Odometry;

/// The frame that does not move.
const WORLD: &str = "world";
/// The frame of the trunk.
const BODY: &str = "body";

/// Turns samples of the plant into messages. It allocates nothing: each message is made once, and the numbers in it are
/// replaced.
#[derive(Debug, Clone)]
pub(crate) struct Poses {
    frames: Frames,
    odometry: Option<Odometry>,
    joints: Option<Joints>,
}

impl Poses {
    /// Of a plant whose samples are laid out as `layout`. Odometry and joints are of recorded signals, those that `keep`
    /// wants.
    pub(crate) fn new(skeleton: &Skeleton, layout: &Layout, keep: &dyn Fn(&str) -> bool) -> Self {
        let signals = Signals { layout, keep };
        Self {
            frames: Frames::new(skeleton, &signals),
            odometry: Odometry::new(&signals),
            joints: Joints::new(&signals),
        }
    }

    /// The topics that it has messages for.
    pub(crate) fn topics(&self) -> impl Iterator<Item = Topic> {
        let odometry = self.odometry.as_ref().map(|_| Topic::Odometry);
        let joints = self.joints.as_ref().map(|_| Topic::Joints);
        [Topic::Frames].into_iter().chain(odometry).chain(joints)
    }

    /// The message of one of its topics, from a sample; none if it has none.
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

/// The signals of a sample of the plant.
struct Signals<'a> {
    layout: &'a Layout,
    keep: &'a dyn Fn(&str) -> bool,
}

impl Signals<'_> {
    /// Where the `size` components of the signal `name` start.
    fn start(&self, name: &str, size: usize) -> Option<usize> {
        let range = self.layout.find(name)?;
        (range.len() == size).then_some(range.start)
    }

    /// The same of a signal that is recorded.
    fn recorded(&self, name: &str, size: usize) -> Option<usize> {
        self.start(name, size).filter(|_| (self.keep)(name))
    }

    /// Signals that are recorded, of one component in `unit`, and where that is.
    fn of_unit(&self, unit: Unit) -> impl Iterator<Item = (&str, usize)> {
        let fields = self.layout.fields();
        let meant = fields.filter(move |field| field.port.unit == unit && field.port.size == 1);
        let meant = meant.map(|field| (field.port.name.as_str(), field.range().start));
        meant.filter(|(name, _)| (self.keep)(name))
    }
}
