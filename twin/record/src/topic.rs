//! Topics of a recording, except those of groups of signals and wires.

/// A topic with messages of one type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Topic {
    /// Exceptional events of the executor: skipped tasks, overruns.
    Events,
    /// Footsteps, at the time of lift-off.
    Footsteps,
    /// Process variables changed during the run.
    Changes,
    /// Verdict, once, at the end.
    Verdict,
    /// Coordinate frames of body and leg segments.
    Frames,
    /// Pose and twist of the body.
    Odometry,
    /// Positions of the joints of the legs.
    Joints,
    /// Positions, rates and torques of the drives.
    Drives,
    /// The robot as URDF, once, at the start.
    Description,
}

impl Topic {
    /// Every topic.
    pub const ALL: [Self; 9] = [
        Self::Events,
        Self::Footsteps,
        Self::Changes,
        Self::Verdict,
        Self::Frames,
        Self::Odometry,
        Self::Joints,
        Self::Drives,
        Self::Description,
    ];

    /// Topics of messages written individually by a run.
    pub(crate) const MESSAGES: [Self; 4] =
        [Self::Events, Self::Footsteps, Self::Changes, Self::Verdict];

    /// Topics derived from samples of the plant.
    pub(crate) const POSES: [Self; 4] = [Self::Frames, Self::Odometry, Self::Joints, Self::Drives];

    /// Name of the channel.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Events => "/diagnostics",
            Self::Footsteps => "/footsteps",
            Self::Changes => "/changes",
            Self::Verdict => "/verdict",
            Self::Frames => "/tf",
            Self::Odometry => "/odom",
            Self::Joints => "/joint_states",
            Self::Drives => "/drive_states",
            Self::Description => "/robot_description",
        }
    }

    /// Type of the messages.
    pub(crate) const fn message_type(self) -> &'static str {
        match self {
            Self::Events => "diagnostic_msgs/DiagnosticArray",
            Self::Footsteps => "twinrig/Footstep",
            Self::Changes => "twinrig/Change",
            Self::Verdict => "twinrig/Verdict",
            Self::Frames => "tf2_msgs/TFMessage",
            Self::Odometry => "nav_msgs/Odometry",
            Self::Joints | Self::Drives => "sensor_msgs/JointState",
            Self::Description => "std_msgs/String",
        }
    }

    /// Returns the topic of a channel, including the names used by earlier builds.
    pub(crate) fn of_channel(name: &str) -> Option<Self> {
        const EVENTS_OF_EARLIER_BUILDS: &str = "/events";
        if name == EVENTS_OF_EARLIER_BUILDS {
            return Some(Self::Events);
        }
        Self::ALL.into_iter().find(|topic| topic.name() == name)
    }
}
