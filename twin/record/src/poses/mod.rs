//! State of the robot in standard messages for ROS 2 viewers and tools: coordinate frames,
//! odometry, joints, drives. All numbers are taken from recorded samples of the plant; none is
//! computed additionally.

mod drives;
mod frames;
mod joints;
mod odometry;
mod series;
mod signals;

use twinrig_kernel::Layout;

pub use frames::{Skeleton, SkeletonAbduction, SkeletonLeg};
pub use series::{FrameSampler, FrameSeries, LegLinks};

use crate::Topic;
use drives::Drives;
use frames::Frames;
use joints::Joints;
use odometry::Odometry;
use signals::Signals;

/// Converts samples of the plant to messages without allocation: each message is created once and
/// its numbers are overwritten.
#[derive(Debug, Clone)]
pub(crate) struct Poses {
    frames: Frames,
    odometry: Option<Odometry>,
    joints: Option<Joints>,
    drives: Option<Drives>,
}

impl Poses {
    /// Creates the messages of a plant whose samples have the given layout. Odometry and drives use
    /// recorded signals only, which `keep` selects.
    pub(crate) fn new(skeleton: &Skeleton, layout: &Layout, keep: &dyn Fn(&str) -> bool) -> Self {
        let signals = Signals { layout, keep };
        Self {
            frames: Frames::new(skeleton, &signals),
            odometry: Odometry::new(&signals),
            joints: Joints::new(skeleton, &signals),
            drives: Drives::new(&signals),
        }
    }

    /// Topics for which there are messages.
    pub(crate) fn topics(&self) -> impl Iterator<Item = Topic> {
        let odometry = self.odometry.as_ref().map(|_| Topic::Odometry);
        let joints = self.joints.as_ref().map(|_| Topic::Joints);
        let drives = self.drives.as_ref().map(|_| Topic::Drives);
        let frames = [Topic::Frames].into_iter();
        frames.chain(odometry).chain(joints).chain(drives)
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
            Topic::Drives => Some(self.drives.as_mut()?.at(stamp, values)),
            Topic::Description
            | Topic::Events
            | Topic::Footsteps
            | Topic::Changes
            | Topic::Verdict => None,
        }
    }
}
