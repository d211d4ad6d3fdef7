//! The topics of a recording, except those of groups of signals and of bytes on wires.

/// A topic with messages of one type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Topic {
    /// What the executor did out of the ordinary: skipped tasks, overruns.
    Events,
    /// Every footstep, at the time of its lift-off.
    Footsteps,
    /// Every process variable that was set while the run went on.
    Changes,
    /// The verdict, once, at the end.
    Verdict,
    /// Coordinate frames of body and leg segments.
    Frames,
    /// Where the body is and how it moves.
    Odometry,
    /// Positions, rates and torques of the driven joints.
    Joints,
}

impl Topic {
    /// Every topic.
    pub const ALL: [Self; 7] = [
        Self::Events,
        Self::Footsteps,
        Self::Changes,
        Self::Verdict,
        Self::Frames,
        Self::Odometry,
        Self::Joints,
    ];

    /// Those whose messages a run writes one by one.
    pub(crate) const OF_MESSAGES: [Self; 4] =
        [Self::Events, Self::Footsteps, Self::Changes, Self::Verdict];

    /// Those that are made of samples of the plant.
    pub(crate) const OF_POSES: [Self; 3] = [Self::Frames, Self::Odometry, Self::Joints];

    /// The name of its channel.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Events => "/diagnostics",
            Self::Footsteps => "/footsteps",
            Self::Changes => "/changes",
            Self::Verdict => "/verdict",
            Self::Frames => "/tf",
            Self::Odometry => "/odom",
            Self::Joints => "/joint_states",
        }
    }

    /// The type of its messages.
    pub(crate) const fn message_type(self) -> &'static str {
        match self {
            Self::Events => "diagnostic_msgs/DiagnosticArray",
            Self::Footsteps => "twinrig/Footstep",
            Self::Changes => "twinrig/Change",
            Self::Verdict => "twinrig/Verdict",
            Self::Frames => "tf2_msgs/TFMessage",
            Self::Odometry => "nav_msgs/Odometry",
            Self::Joints => "sensor_msgs/JointState",
        }
    }

    /// The topic of a channel, which earlier builds may have called otherwise.
    pub(crate) fn of_channel(name: &str) -> Option<Self> {
        const EVENTS_BEFORE: &str = "/events";
        if name == EVENTS_BEFORE {
            return Some(Self::Events);
        }
        Self::ALL.into_iter().find(|topic| topic.name() == name)
    }
}
