//! ROS 2 message definitions: the standard types used by recordings, and those of this project.

/// Name and definition of every message type, except those of groups of signals, which are
/// generated.
const DEFINITIONS: [(&str, &str); 23] = [
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    (
        "std_msgs/Header",
        "builtin_interfaces/Time stamp\nstring frame_id\n",
    ),
    ("std_msgs/String", "string data\n"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
    (
        "geometry_msgs/Quaternion",
        "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
    ),
    (
        "geometry_msgs/Transform",
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    ),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    ),
    (
        "tf2_msgs/TFMessage",
        "geometry_msgs/TransformStamped[] transforms\n",
    ),
    (
        "geometry_msgs/Pose",
        "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
    ),
    (
        "geometry_msgs/PoseWithCovariance",
        "geometry_msgs/Pose pose\nfloat64[36] covariance\n",
    ),
    (
        "geometry_msgs/Twist",
        "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
    ),
    (
        "geometry_msgs/TwistWithCovariance",
        "geometry_msgs/Twist twist\nfloat64[36] covariance\n",
    ),
    (
        "nav_msgs/Odometry",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n\
         geometry_msgs/TwistWithCovariance twist\n",
    ),
    (
        "sensor_msgs/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
    ),
    ("diagnostic_msgs/KeyValue", "string key\nstring value\n"),
    (
        "diagnostic_msgs/DiagnosticStatus",
        "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\n\
         byte level\nstring name\nstring message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values\n",
    ),
    (
        "diagnostic_msgs/DiagnosticArray",
        "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n",
    ),
    (
        "twinrig/Footstep",
        "# A footstep, at its lift-off. Times are since the start of the run.\n\
         string leg\n\
         float64 touch_down_s\n\
         float64 lift_off_s\n\
         float64[3] position_m    # of the foot at touch-down, world frame\n\
         float64 slip_m           # greatest horizontal distance from there while in contact\n\
         float64 impulse_ns       # integral of the load, in newton-seconds\n\
         float64 peak_load_n\n",
    ),
    (
        "twinrig/Change",
        "# A process variable was set.\n\
         string variable\n\
         float64 value            # in the unit of the variable\n",
    ),
    (
        "twinrig/Expectation",
        "# The outcome of an expectation. A number that there is not is NaN.\n\
         string name\n\
         string verdict           # pass, fail or unobserved\n\
         bool optional            # whether it may be unobserved\n\
         float64 measured         # the value that is nearest to violating the expectation\n\
         float64 bound            # the limit that it is nearest to\n\
         float64 other_bound      # the limit on the other side\n\
         float64 margin           # distance to the limit, negative on its wrong side\n\
         string unit              # of measured, bound and margin\n\
         float64 first_violation_s\n\
         string detail            # which leg, which footstep, why unobserved\n\
         string leg               # of the measured value\n\
         string signal            # of the measured value\n\
         uint32 element           # of the signal, counted from 1; 0: none\n\
         float64 instant_s        # of the measured value, since the start of the run\n\
         float64 recording_s      # the same instant in the recording\n\
         float64 value            # of the signal at the instant\n\
         float64 min              # least accepted value\n\
         float64 max              # greatest accepted value\n\
         uint32 line              # of the scenario, counted from 1\n",
    ),
    (
        "twinrig/Verdict",
        "# The verdict of a run, at its end.\n\
         string verdict           # pass, fail or error\n\
         bool interrupted         # by the user: the run would have gone on\n\
         string error             # why it did not reach its end; empty if it did\n\
         twinrig/Expectation[] expectations\n",
    ),
    (
        "twinrig/Bytes",
        "# Bytes that passed on a wire, in one piece.\n\
         uint8[] data\n",
    ),
];

/// Package of the project's own messages.
pub(crate) const PACKAGE: &str = "twinrig";

/// Converts a type name `PACKAGE/NAME` to its full form `PACKAGE/msg/NAME`.
pub(crate) fn full_name(name: &str) -> String {
    name.replacen('/', "/msg/", 1)
}

/// Returns the definition of type `name`, followed by those of all types it contains, each after a
/// line with its name.
pub(crate) fn complete(name: &str) -> String {
    let mut text = of(name).to_owned();
    let mut types = vec![name];
    let mut next = 0;
    while let Some(one) = types.get(next) {
        next += 1;
        for part in parts(of(one)) {
            if !types.contains(&part) {
                types.push(part);
            }
        }
    }
    for part in &types[1..] {
        text.push_str(&"=".repeat(80));
        text.extend(["\nMSG: ", part, "\n", of(part)]);
    }
    text
}

fn of(name: &str) -> &'static str {
    let found = DEFINITIONS.iter().find(|(known, _)| *known == name);
    found.map_or("", |(_, definition)| definition)
}

/// Returns the types of those fields of a definition that are messages.
fn parts(definition: &'static str) -> impl Iterator<Item = &'static str> {
    let types = definition.lines().filter_map(|line| line.split(' ').next());
    let types = types.filter(|word| word.contains('/'));
    types.map(|word| word.trim_end_matches("[]"))
}

/// Converts a path to a valid ROS 2 topic name: `/` before each part, which contains letters,
/// digits and single underscores and does not begin with a digit.
pub(crate) fn topic_name(path: &str) -> String {
    let mut name = String::new();
    for part in path.split('/').filter(|part| !part.is_empty()) {
        name.push('/');
        if part.starts_with(|first: char| first.is_ascii_digit()) {
            name.push('_');
        }
        for character in part.chars() {
            if character.is_ascii_alphanumeric() {
                name.push(character);
            } else if !name.ends_with('_') {
                name.push('_');
            }
        }
    }
    name
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn definitions_are_complete() {
        for (name, definition) in DEFINITIONS {
            let complete = complete(name);
            assert!(complete.starts_with(definition), "{name}");
            for part in DEFINITIONS
                .iter()
                .flat_map(|(_, definition)| parts(definition))
            {
                assert!(!of(part).is_empty(), "{part} is not defined");
            }
            for line in complete
                .lines()
                .filter(|line| !line.starts_with(['=', 'M', '#']))
            {
                let part = line.split([' ', '[']).next().unwrap();
                let defined = complete.contains(&format!("\nMSG: {part}\n"));
                assert!(!part.contains('/') || defined, "{part} in {name}");
            }
        }
        let odometry = complete("nav_msgs/Odometry");
        assert_eq!(odometry.matches("MSG: geometry_msgs/Vector3\n").count(), 1);
    }

    #[test]
    fn topic_names_are_valid_in_ros() {
        assert_eq!(topic_name("process-inputs"), "/process_inputs");
        assert_eq!(topic_name("wire/left bus/2nd"), "/wire/left_bus/_2nd");
    }

    proptest! {
        #[test]
        fn every_topic_name_is_valid_in_ros(path in "\\PC{1,12}") {
            let topic = topic_name(&format!("wire/{path}"));
            prop_assert!(topic.starts_with("/wire") && !topic.contains("__"), "{topic}");
            for part in topic.split('/').skip(1) {
                prop_assert!(part.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_'), "{topic}");
                prop_assert!(part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'), "{topic}");
            }
        }
    }
}
