//! What a recording holds beside signals: JSON messages, each kind on its own channel.

/// A channel of JSON messages.
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
    /// Where body and leg segments are, for a viewer.
    Frames,
}

impl Topic {
    /// Every topic.
    pub const ALL: [Self; 5] = [
        Self::Events,
        Self::Footsteps,
        Self::Changes,
        Self::Verdict,
        Self::Frames,
    ];

    /// The name of its channel.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Events => "/events",
            Self::Footsteps => "/footsteps",
            Self::Changes => "/changes",
            Self::Verdict => "/verdict",
            Self::Frames => "/tf",
        }
    }

    /// The name of its schema; viewers know the one of the frames.
    pub(crate) const fn schema_name(self) -> &'static str {
        match self {
            Self::Events => "twinrig.Event",
            Self::Footsteps => "twinrig.Footstep",
            Self::Changes => "twinrig.Change",
            Self::Verdict => "twinrig.Verdict",
            Self::Frames => "foxglove.FrameTransforms",
        }
    }

    /// Its JSON schema. Only what every message has is required, so that messages may grow.
    pub(crate) const fn schema(self) -> &'static str {
        match self {
            Self::Events => {
                r#"{"type":"object","required":["event"],"properties":{"event":{"type":"string"},"part":{"type":"string"},"count":{"type":"integer"}}}"#
            }
            Self::Footsteps => {
                r#"{"type":"object","required":["leg","touch_down_s","lift_off_s"],"properties":{"leg":{"type":"string"},"touch_down_s":{"type":"number"},"lift_off_s":{"type":"number"},"position_m":{"type":"array","items":{"type":"number"}},"slip_m":{"type":"number"},"impulse_ns":{"type":"number"}}}"#
            }
            Self::Changes => {
                r#"{"type":"object","required":["variable","value"],"properties":{"variable":{"type":"string"},"value":{"type":"number"}}}"#
            }
            Self::Verdict => {
                r#"{"type":"object","required":["verdict"],"properties":{"verdict":{"type":"string","enum":["pass","fail","error"]}}}"#
            }
            Self::Frames => FRAME_TRANSFORMS,
        }
    }
}

/// The well-known shape of a list of coordinate frames, as viewers expect it.
const FRAME_TRANSFORMS: &str = r#"{"type":"object","title":"foxglove.FrameTransforms","properties":{"transforms":{"type":"array","items":{"type":"object","title":"foxglove.FrameTransform","properties":{"timestamp":{"type":"object","title":"time","properties":{"sec":{"type":"integer","minimum":0},"nsec":{"type":"integer","minimum":0,"maximum":999999999}}},"parent_frame_id":{"type":"string"},"child_frame_id":{"type":"string"},"translation":{"type":"object","title":"foxglove.Vector3","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},"rotation":{"type":"object","title":"foxglove.Quaternion","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}}}}}"#;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_schema_is_json() {
        for topic in Topic::ALL {
            let schema: serde_json::Value = serde_json::from_str(topic.schema()).unwrap();
            assert_eq!(schema["type"], "object", "{topic:?}");
        }
    }
}
