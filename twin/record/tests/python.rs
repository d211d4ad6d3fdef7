//! The packages `mcap` and `mcap-ros2-support` from `PyPI` read what we write.

mod common;
#[path = "common/python.rs"]
mod python;

use common::*;
use serde_json::{Value, json};
use twinrig_record::{EPOCH, Recording};

fn hex(values: &[f64]) -> Value {
    values
        .iter()
        .map(|value| format!("{:016x}", value.to_bits()))
        .collect()
}

#[test]
fn python_reads_every_bit() {
    let Some(python) = python::python("mcap, mcap_ros2") else {
        return;
    };
    let file = std::env::temp_dir().join(format!("twinrig-python-{}.mcap", std::process::id()));
    let bytes = recorded(100);
    std::fs::write(&file, &bytes).unwrap();
    let found = python::run(&python, "read_recording.py", &[&file], &json!(null));
    std::fs::remove_file(&file).unwrap();

    let plant = found["samples"]["/plant"].as_array().unwrap();
    assert_eq!(plant.len(), 100);
    let commands = found["samples"]["/process-outputs"].as_array().unwrap();
    for ((step, sample), command) in (0..).zip(plant).zip(commands) {
        let values = plant_values(step);
        assert_eq!(sample[0], json!(EPOCH.as_nanos() + step * PERIOD_NS));
        assert_eq!(sample[2], step);
        assert_eq!(sample[1]["body/position"], hex(&values[0..3]));
        assert_eq!(sample[1]["body/orientation"], hex(&values[3..7]));
        assert_eq!(sample[1]["leg/LF/angles"], hex(&values[7..10]));
        assert_eq!(sample[1]["leg/LF/foot/load"], hex(&values[10..11]));
        assert_eq!(command[1]["leg/LF/hip/command"], hex(&command_values(step)));
    }
    assert_eq!(
        found["json"]["/footsteps"][1],
        serde_json::to_value(footstep(49)).unwrap()
    );
    assert_eq!(
        found["json"]["/changes"][0],
        json!({"variable": "step_length", "value": 0.11})
    );
    assert_eq!(
        found["json"]["/tf"][9]["transforms"][4]["parent_frame_id"],
        "LF/ankle"
    );
    assert_eq!(found["schemas"]["foxglove.FrameTransforms"], "jsonschema");
    assert_eq!(found["schemas"]["twinrig/msg/Plant"], "ros2msg");
    assert_eq!(found["attachments"]["scenario.toml"], "name = \"test\"\n");
    assert_eq!(found["metadata"]["run"]["seed"], "7");
    let fingerprint = Recording::from_bytes(bytes)
        .unwrap()
        .fingerprint()
        .unwrap()
        .to_owned();
    assert_eq!(found["metadata"]["result"]["fingerprint"], fingerprint);
}
