//! The packages `mcap-ros2-support` and `rosbags` from `PyPI` read all recorded messages, with
//! equal results.

use std::path::Path;

use super::common::*;
use serde_json::{Value, json};
use twinrig_record::{EPOCH, Recording};
use twinrig_testing::python;

fn hex(values: &[f64]) -> Value {
    values
        .iter()
        .map(|value| format!("{:016x}", value.to_bits()))
        .collect()
}

/// Contents of `bytes` as read by each of the two packages; `None` without Python.
fn found(bytes: &[u8], test: &str) -> Option<[Value; 2]> {
    let python = python::python("mcap, mcap_ros2, rosbags")?;
    let name = format!("twinrig-python-{test}-{}.mcap", std::process::id());
    let file = std::env::temp_dir().join(name);
    std::fs::write(&file, bytes).unwrap();
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let found = ["read_recording.py", "read_rosbag.py"]
        .map(|script| tests.join(script))
        .map(|script| python::run(&python, &script, &[&file], &json!(null)));
    std::fs::remove_file(&file).unwrap();
    Some(found)
}

#[test]
fn independent_packages_read_every_bit() {
    let bytes = recorded(100);
    let Some([found, bag]) = found(&bytes, "bits") else {
        return;
    };
    let messages = &found["messages"];
    for (topic, messages) in messages.as_object().unwrap() {
        assert!(messages == &bag["messages"][topic], "{topic}");
    }
    let plant = messages["/plant"].as_array().unwrap();
    assert_eq!(plant.len(), 100);
    let commands = messages["/process_outputs"].as_array().unwrap();
    for ((step, sample), command) in (0..).zip(plant).zip(commands) {
        let values = plant_values(step);
        assert_eq!(sample[0], json!(EPOCH.as_nanos() + step * PERIOD_NS));
        assert_eq!(sample[1]["body_position"], hex(&values[0..3]));
        assert_eq!(sample[1]["body_orientation"], hex(&values[3..7]));
        assert_eq!(sample[1]["leg_lf_angles"], hex(&values[7..10]));
        assert_eq!(sample[1]["leg_lf_foot_load"], hex(&values[10..11])[0]);
        let angle = &command[1]["leg_lf_hip_command"];
        assert_eq!(*angle, hex(&command_values(step))[0]);
    }
    assert_eq!(found["attachments"]["scenario.toml"], "name = \"test\"\n");
    assert_eq!(found["metadata"]["run"]["seed"], "7");
    let fingerprint = Recording::from_bytes(bytes)
        .unwrap()
        .fingerprint()
        .unwrap()
        .to_owned();
    assert_eq!(found["metadata"]["result"]["fingerprint"], fingerprint);
}

#[test]
fn messages_are_those_of_the_run() {
    let Some([found, _]) = found(&recorded(100), "messages") else {
        return;
    };
    let last =
        |topic: &str| found["messages"][topic].as_array().unwrap().last().unwrap()[1].clone();
    let (step, nanos) = (90, 90 * PERIOD_NS);
    let values = plant_values(step);
    let stamp = json!({ "sec": 1, "nanosec": nanos });

    let frames = &last("/tf")["transforms"];
    assert_eq!(frames.as_array().unwrap().len(), 5);
    assert_eq!(
        frames[4]["header"],
        json!({ "stamp": stamp, "frame_id": "LF_lower" })
    );
    assert_eq!(frames[4]["child_frame_id"], "LF_foot");
    assert_eq!(
        frames[0]["transform"]["translation"]["x"],
        hex(&values[0..1])[0]
    );
    assert_eq!(frames[0]["transform"]["rotation"]["w"], hex(&[1.0])[0]);

    let odometry = last("/odom");
    assert_eq!(
        odometry["header"],
        json!({ "stamp": stamp, "frame_id": "world" })
    );
    assert_eq!(
        odometry["pose"]["pose"]["position"]["y"],
        hex(&values[1..2])[0]
    );
    assert_eq!(
        odometry["twist"]["twist"]["linear"]["x"],
        hex(&values[11..12])[0]
    );
    assert_eq!(
        odometry["twist"]["covariance"].as_array().unwrap().len(),
        36
    );

    let joints = last("/joint_states");
    assert_eq!(joints["name"], json!(["LF_hip", "LF_knee", "LF_ankle"]));
    let drives = last("/drive_states");
    assert_eq!(drives["name"], json!(["LF/hip"]));
    assert_eq!(drives["position"], hex(&values[17..18]));
    assert_eq!(
        (&drives["velocity"], &drives["effort"]),
        (&json!([]), &hex(&[-0.2]))
    );

    let footstep_99 = footstep(99);
    assert_eq!(
        last("/footsteps"),
        json!({
            "leg": "LF",
            "touch_down_s": hex(&[footstep_99.touch_down_s])[0],
            "lift_off_s": hex(&[footstep_99.lift_off_s])[0],
            "position_m": hex(&footstep_99.position_m.unwrap()),
            "slip_m": hex(&[footstep_99.slip_m])[0],
            "impulse_ns": hex(&[footstep_99.impulse_ns])[0],
            "peak_load_n": hex(&[footstep_99.peak_load_n])[0],
        })
    );
    assert_eq!(
        last("/changes"),
        json!({ "variable": "step_length", "value": hex(&[0.11])[0] })
    );
    let status = &last("/diagnostics")["status"][0];
    assert_eq!(
        (&status["level"], &status["message"]),
        (&json!(1), &json!("task skipped"))
    );
    assert_eq!(
        status["values"],
        json!([{ "key": "part", "value": "direct" }])
    );
    assert_eq!(last("/wire/left_bus/_2"), json!({ "data": [99, 0, 255] }));
    assert_eq!(found["messages"]["/verdict"], json!([]));
}

/// All channels have CDR messages, a definition and a quality of service, as required by the
/// profile `ros2`.
#[test]
fn recording_conforms_to_the_ros2_profile() {
    let Some([found, bag]) = found(&recorded(10), "profile") else {
        return;
    };
    assert_eq!(found["profile"], "ros2");
    for (topic, channel) in found["channels"].as_object().unwrap() {
        assert_eq!(channel[0], "cdr", "{topic}");
        assert!(channel[1]["offered_qos_profiles"].is_string(), "{topic}");
    }
    for (name, encoding) in found["schemas"].as_object().unwrap() {
        assert_eq!(encoding, "ros2msg", "{name}");
    }
    let types = json!({
        "/plant": "twinrig/msg/Plant",
        "/process_outputs": "twinrig/msg/ProcessOutputs",
        "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
        "/footsteps": "twinrig/msg/Footstep",
        "/changes": "twinrig/msg/Change",
        "/verdict": "twinrig/msg/Verdict",
        "/tf": "tf2_msgs/msg/TFMessage",
        "/odom": "nav_msgs/msg/Odometry",
        "/joint_states": "sensor_msgs/msg/JointState",
        "/drive_states": "sensor_msgs/msg/JointState",
        "/robot_description": "std_msgs/msg/String",
        "/wire/sbcp/out": "twinrig/msg/Bytes",
        "/wire/left_bus/_2": "twinrig/msg/Bytes",
    });
    assert_eq!(bag["types"], types);
    // All releases of ROS 2 agree with our definitions of the standard types and lack our own
    // types.
    assert!(bag["releases"].as_u64() >= Some(5), "{}", bag["releases"]);
    assert_eq!(bag["other"], json!([]));
    let own = bag["own"].as_array().unwrap();
    assert!(
        own.iter()
            .all(|name| name.as_str().unwrap().starts_with("twinrig/")),
        "{own:?}"
    );
}
