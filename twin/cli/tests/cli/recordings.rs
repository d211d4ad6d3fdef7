//! Replay and comparison of recordings.

use std::collections::BTreeMap;
use std::path::Path;

use regex_lite::{Captures, Regex};
use serde_json::json;
use twinrig_record::{ChangeMessage, EventMessage, FootstepMessage, Recording, VerdictMessage};
use twinrig_testing::python;

use crate::common::{Folder, SOUND, json, twin};

#[test]
fn replay_reproduces_fingerprint() {
    let folder = Folder::new("replay");
    let scenario = folder.file("bob.toml", SOUND);
    let out = folder.join("out");
    let words = ["run", &scenario, "--out", &out, "--json", "--set", "seed=9"];
    let report = json(&twin(&words).out).remove(0);
    let recording = report["recording"].as_str().unwrap();
    std::fs::remove_file(&scenario).unwrap(); // The recording contains the scenario.
    let done = twin(&["replay", recording, "--json"]);
    assert_eq!(done.code, 0, "{done:?}");
    let replayed = &json(&done.out)[0];
    assert_eq!(replayed["fingerprint"], report["fingerprint"]);
    assert_eq!(replayed["identical"], true);
    assert!(twin(&["replay", recording]).out.contains("identical"));
    assert_eq!(
        std::fs::read_dir(&out).unwrap().count(),
        1,
        "no temporary files remain"
    );
}

#[test]
fn truncated_recording_is_compared_up_to_its_end() {
    let folder = Folder::new("cut");
    let scenario = folder.file("bob.toml", &SOUND.replace("1 s", "4 s"));
    let done = twin(&["run", &scenario, "--json", "--out", &folder.join("out")]);
    let recording = json(&done.out)[0]["recording"].as_str().unwrap().to_owned();
    let bytes = std::fs::read(&recording).unwrap();
    std::fs::write(&recording, &bytes[..bytes.len() / 2]).unwrap();
    let verdict = "identical up to the cut-off: ";
    let done = twin(&["replay", &recording]);
    assert_eq!(done.code, 0, "{done:?}");
    assert!(
        done.out
            .contains(&format!("{verdict}the recording was cut off at ")),
        "{}",
        done.out
    );
    let whole = folder.join("whole.mcap");
    std::fs::write(&whole, &bytes).unwrap();
    for (pair, name) in [([&recording, &whole], 'a'), ([&whole, &recording], 'b')] {
        let done = twin(&["diff", pair[0], pair[1]]);
        assert_eq!(done.code, 0, "{done:?}");
        let expected = format!("{verdict}{name} was cut off at ");
        assert!(done.out.contains(&expected), "{}", done.out);
    }
    // A recording of a different run differs, even if it is truncated.
    let other = ["run", &scenario, "--json", "--plant", "snapping", "--out"];
    let done = twin(&[&other[..], &[&folder.join("other")]].concat());
    let other = json(&done.out)[0]["recording"].as_str().unwrap().to_owned();
    assert_eq!(twin(&["diff", &recording, &other]).code, 1);
    std::fs::write(&recording, b"no recording").unwrap();
    assert_eq!(twin(&["replay", &recording]).code, 2);
    assert_eq!(twin(&["diff", &recording, &recording]).code, 2);
}

#[test]
fn diff_finds_first_difference() {
    let folder = Folder::new("diff");
    let scenario = folder.file("bob.toml", SOUND);
    let out = folder.join("out");
    let run = |words: &[&str]| {
        let all = [&["run", &scenario, "--json", "--out", &out], words].concat();
        json(&twin(&all).out)[0]["recording"]
            .as_str()
            .unwrap()
            .to_owned()
    };
    let (a, b) = (
        run(&[]),
        run(&["--set", "record.signals=[\"body/position\"]"]),
    );
    let same = twin(&["diff", &a, &a]);
    assert!(same.code == 0 && same.out.contains("equal"), "{same:?}");
    let done = twin(&["diff", &a, &b, "--json"]);
    let difference = &json(&done.out)[0];
    assert_eq!(done.code, 1);
    assert_eq!(difference["first"], json!(null));
    assert_eq!(difference["only_in_a"], json!(["plant: body/rpy"]));
}

#[test]
fn comparison_without_common_samples_is_an_error() {
    let folder = Folder::new("nothing-to-diff");
    let scenario = folder.file("bob.toml", SOUND);
    let run = |out: &str, signals: &str| {
        let set = format!("record.signals=[{signals}]");
        let out = folder.join(out);
        let done = twin(&["run", &scenario, "--json", "--out", &out, "--set", &set]);
        json(&done.out)[0]["recording"].as_str().unwrap().to_owned()
    };
    let position = run("position", "\"body/position\"");
    let attitude = run("attitude", "\"body/rpy\"");
    for pair in [[&position, &attitude], [&attitude, &position]] {
        for events in [&[][..], &["--events"]] {
            let words = [&["diff", pair[0], pair[1]], events].concat();
            let done = twin(&words);
            assert_eq!(done.code, 2, "{words:?}: {done:?}");
            assert!(done.out.contains("nothing to compare"), "{done:?}");
            let done = twin(&[&words[..], &["--json"]].concat());
            assert_eq!(done.code, 2, "{done:?}");
            let difference = &json(&done.out)[0];
            assert_eq!(difference["nothing"], true, "{difference}");
            assert!(difference["error"].is_string(), "{difference}");
        }
    }
    assert_eq!(twin(&["diff", &position, &position]).code, 0);
    // Truncated before the first sample.
    let bytes = std::fs::read(&position).unwrap();
    std::fs::write(&position, &bytes[..bytes.len().min(2_000)]).unwrap();
    assert_eq!(twin(&["diff", &position, &position]).code, 2);
}

#[test]
fn endless_files_are_refused() {
    let endless = "/dev/zero";
    for words in [
        &["check", endless][..],
        &["run", endless],
        &["diff", endless, endless],
        &["replay", endless],
    ] {
        let done = twin(words);
        assert_eq!(done.code, 2, "{words:?}");
        assert!(
            done.err.contains("longer than 16 MB"),
            "{words:?}: {done:?}"
        );
    }
    let folder = Folder::new("endless-robot");
    let robot = SOUND.replace("\"cheetah-cub\"", "\"./zero.toml\"");
    let scenario = folder.file("zero-robot.toml", &robot);
    std::os::unix::fs::symlink(endless, folder.join("zero.toml")).unwrap();
    let done = twin(&["check", &scenario]);
    assert_eq!(done.code, 2);
    assert!(done.err.contains("longer than 16 MB"), "{done:?}");
}

/// A scenario may be read from a pipe, such as `<(…)` of a shell.
#[test]
fn finite_pipes_are_read() {
    let folder = Folder::new("pipe");
    let pipe = folder.join("pipe.toml");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    let writer = {
        let pipe = pipe.clone();
        std::thread::Builder::new().spawn(move || std::fs::write(pipe, SOUND).unwrap())
    };
    let done = twin(&["check", &pipe]);
    assert_eq!(done.code, 0, "{done:?}");
    writer.unwrap().join().unwrap();
}

/// Returns the path of a recording by an earlier build, with messages as JSON and bytes of wires
/// without encoding: 175 samples of a trot with a force sensor, made from the attached scenario.
fn before_cdr() -> String {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../ci/golden/recording-before-cdr.mcap");
    path.display().to_string()
}

#[test]
fn recording_of_earlier_build_is_read_completely() {
    let recording = Recording::open(before_cdr().as_ref()).unwrap();
    let footsteps = recording.messages::<FootstepMessage>().unwrap();
    assert_eq!(footsteps.len(), 7);
    let (at, first) = &footsteps[0];
    assert_eq!(
        (first.leg.as_str(), first.touch_down_s, first.lift_off_s),
        ("RF", 0.016, 0.216)
    );
    assert!(at.as_secs_f64() >= first.lift_off_s && first.slip_m > 0.0);
    let events = recording.messages::<EventMessage>().unwrap();
    assert_eq!(events.len(), 7);
    assert_eq!(events[0].1.event, "devices are open");
    assert_eq!(events[1].1.part.as_deref(), Some("io"));
    let changes = recording.messages::<ChangeMessage>().unwrap();
    assert_eq!(changes[0].1.variable, "step_length");
    let verdicts = recording.messages::<VerdictMessage>().unwrap();
    let [(_, verdict)] = &verdicts[..] else {
        panic!("{verdicts:?}");
    };
    assert_eq!(
        (verdict.verdict.as_str(), verdict.error.as_ref()),
        ("fail", None)
    );
    let names = verdict.expectations.iter().map(|one| one.name.as_str());
    assert_eq!(names.collect::<Vec<_>>(), ["stands", "steps", "runs"]);
    assert_eq!(verdict.expectations[2].bound, Some(9.0));
}

#[test]
fn recording_of_earlier_build_is_compared_and_replayed() {
    let before = before_cdr();
    let done = twin(&["diff", &before, &before]);
    assert_eq!(done.code, 0, "{done:?}");
    let done = twin(&["diff", "--events", &before, &before]);
    assert_eq!(done.code, 0, "{done:?}");
    // The results of plants may have changed since, but not the recorded signals.
    let done = twin(&["replay", "--json", &before]);
    assert!(done.code < 2, "{done:?}");
    let replayed = &json(&done.out)[0];
    let difference = replayed.get("difference").unwrap_or(replayed);
    assert_eq!(difference["signals"], 3, "{done:?}");
    assert_eq!(
        (&difference["only_in_a"], &difference["only_in_b"]),
        (&json!([]), &json!([]))
    );
}

/// Standard and custom messages of a run with all kinds of messages.
#[test]
fn third_party_packages_read_recording() {
    let Some(python) = python::python("mcap, mcap_ros2, rosbags") else {
        return;
    };
    let before = Recording::open(before_cdr().as_ref()).unwrap();
    let scenario = before.attachment("scenario.toml").unwrap();
    let folder = Folder::new("packages");
    let scenario = folder.file("now.toml", std::str::from_utf8(scenario).unwrap());
    let all = "record.signals=[\"**\"]";
    let done = twin(&[
        "run",
        "--json",
        "--out",
        &folder.join("out"),
        "--set",
        all,
        &scenario,
    ]);
    assert_eq!(done.code, 1, "{done:?}");
    let recording = json(&done.out)[0]["recording"].as_str().unwrap().to_owned();
    let read = |script: &str| {
        let tests = concat!(env!("CARGO_MANIFEST_DIR"), "/../record/tests");
        let script = Path::new(tests).join(script);
        python::run(&python, &script, &[recording.as_ref()], &json!(null))["messages"].clone()
    };
    let (found, bag) = (read("read_recording.py"), read("read_rosbag.py"));
    let topics = found.as_object().unwrap();
    for (topic, messages) in topics {
        assert!(*messages == bag[topic], "{topic}");
    }
    for topic in [
        "/plant",
        "/process_inputs",
        "/process_outputs",
        "/gauges",
        "/tf",
        "/odom",
        "/joint_states",
        "/drive_states",
        "/robot_description",
        "/footsteps",
        "/changes",
        "/diagnostics",
        "/verdict",
        "/wire/optoforce/in",
        "/wire/optoforce/out",
    ] {
        let messages = topics[topic].as_array().unwrap();
        // A controller may have no inputs.
        assert!(
            !messages.is_empty() || topic == "/process_inputs",
            "{topic}"
        );
    }
    let verdict = &topics["/verdict"][0][1];
    assert_eq!(verdict["verdict"], "fail");
    assert_eq!(verdict["expectations"][2]["name"], "runs");
    let legs = ["LF", "RF", "LH", "RH"].map(|leg| [format!("{leg}/hip"), format!("{leg}/knee")]);
    assert_eq!(topics["/drive_states"][0][1]["name"], json!(legs.concat()));
}

/// A joint of a robot description.
struct Joint {
    name: String,
    parent: String,
    place: [f64; 3],
    /// Rotation about y, which points left, where the joint is zero.
    pitch: f64,
    /// Whether it turns about x, to the left.
    abducts: bool,
}

/// Returns the joints of a URDF, by the link that each moves.
fn joints(urdf: &str) -> BTreeMap<String, Joint> {
    let pattern = r#"(?s)<joint name="([^"]+)".*?<origin xyz="(\S+) (\S+) ([^"]+)"(?: rpy="0 (\S+) 0")?/>.*?<parent link="([^"]+)"/>.*?<child link="([^"]+)"/>(?:\s*<axis xyz="([^"]+)"/>)?"#;
    let found = Regex::new(pattern).unwrap();
    let number = |text: &str| text.parse::<f64>().unwrap();
    let joint = |found: Captures<'_>| {
        let joint = Joint {
            name: found[1].to_owned(),
            parent: found[6].to_owned(),
            place: [2, 3, 4].map(|n| number(&found[n])),
            pitch: found.get(5).map_or(0.0, |pitch| number(pitch.as_str())),
            abducts: found.get(8).is_some_and(|axis| axis.as_str() == "1 0 0"),
        };
        (found[7].to_owned(), joint)
    };
    found.captures_iter(urdf).map(joint).collect()
}

/// Returns the number of these digits: its bits in hexadecimal.
fn of_bits(text: &serde_json::Value) -> f64 {
    f64::from_bits(u64::from_str_radix(text.as_str().unwrap(), 16).unwrap())
}

/// The robot of a viewer: every frame of a recording is a link of its URDF, at the place and angle
/// at which the recorded states of its joints put the link.
#[test]
fn robot_of_viewers_moves_as_the_recorded_one() {
    const STANDS: &str = "controller = { kind = 'stand', period = '2 ms' }";
    const SPLAYED: &str =
        "controller = { kind = 'stand', period = '2 ms', abduction = 'hold', splay = '5 deg' }";
    let Some(python) = python::python("mcap, mcap_ros2") else {
        return;
    };
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../record/tests/read_recording.py"
    );
    let folder = Folder::new("viewers");
    for (name, robot, plant, controller, joints_of) in [
        ("cub", "cheetah-cub", "", STANDS, 12),
        ("oncilla", "oncilla", "", STANDS, 16),
        ("held", "oncilla", "", SPLAYED, 16),
        ("free", "oncilla", ", abduction = 'free'", SPLAYED, 16),
    ] {
        let text = format!(
            "robot = '{robot}'\nduration = '300 ms'\n\
             plant = {{ model = 'massless', ground = {{}}{plant} }}\n{controller}\n"
        );
        let scenario = folder.file(&format!("{name}.toml"), &text);
        let done = twin(&["run", "--json", "--out", &folder.join("out"), &scenario]);
        let recording = json(&done.out)[0]["recording"].as_str().unwrap().to_owned();
        let exported = twin(&["export", "urdf", robot]).out;
        let found = python::run(
            &python,
            script.as_ref(),
            &[recording.as_ref()],
            &json!(null),
        );
        let topics = &found["messages"];
        assert_eq!(topics["/robot_description"][0][1]["data"], exported);

        let joints = joints(&exported);
        let states = topics["/joint_states"].as_array().unwrap().last().unwrap();
        let (names, positions) = (&states[1]["name"], &states[1]["position"]);
        let names = names.as_array().unwrap().iter();
        let states: BTreeMap<&str, f64> = names
            .zip(positions.as_array().unwrap())
            .map(|(name, position)| (name.as_str().unwrap(), of_bits(position)))
            .collect();
        assert_eq!(states.len(), joints_of);
        // Servos beside a plant do not move its legs.
        let abducts = states
            .get("LF_abduction")
            .is_some_and(|angle| *angle > 0.05);
        assert_eq!(abducts, name == "free", "{states:?}");
        assert!(
            states.values().any(|angle| angle.abs() > 0.01),
            "{states:?}"
        );
        assert!(
            states
                .keys()
                .all(|name| joints.values().any(|joint| joint.name == *name))
        );

        let frames = Recording::open(recording.as_ref())
            .unwrap()
            .frames()
            .unwrap();
        assert_eq!(frames.links[0], ["world", "trunk"]);
        let last = &frames.numbers[frames.numbers.len() - 7 * frames.links.len()..];
        for ([parent, link], numbers) in frames.links.iter().zip(last.chunks_exact(7)).skip(1) {
            let joint = &joints[link];
            assert_eq!(*parent, joint.parent);
            // A hinge about x, or about −y.
            let (axis, sense) = if joint.abducts { (3, 1.0) } else { (4, -1.0) };
            let angle = states.get(joint.name.as_str()).unwrap_or(&0.0) - joint.pitch;
            let recorded = sense * 2.0 * libm::atan2(numbers[axis], numbers[6]);
            assert!(
                (angle - recorded).abs() < 1e-12,
                "{link}: {angle}, {recorded}"
            );
            for (place, expected) in numbers.iter().zip(joint.place) {
                assert!(
                    (place - expected).abs() < 1e-15,
                    "{link}: {place}, {expected}"
                );
            }
        }
    }
}

/// Recordings made before compliant constraints were the default have no note of the rules for
/// values that a scenario leaves open.
#[test]
fn recording_without_note_of_defaults_is_replayed_with_rigid_constraints_and_held_set_points() {
    let folder = Folder::new("former");
    let scenario = folder.file(
        "stands.toml",
        "robot = \"cheetah-cub\"\nduration = \"50 ms\"\n\
         plant = { model = \"massless\", ground = { friction = 0.6 } }\n\
         controller = { kind = \"cpg\", gait = \"trot\", period = \"2 ms\" }\n",
    );
    let former = ["plant.constraints=rigid", "actuator.set_point=held"];
    let run = |settings: &[&str]| {
        let words = ["run", &scenario, "--no-record", "--json"];
        let settings = settings.iter().flat_map(|it| ["--set", it]);
        let report = json(&twin(&words.into_iter().chain(settings).collect::<Vec<_>>()).out);
        report[0]["fingerprint"].clone()
    };
    let replayed = |recording: &str| json(&twin(&["replay", recording, "--json"]).out).remove(0);
    let present = twin(&["run", &scenario, "--json", "--out", &folder.join("out")]);
    let recording = json(&present.out)[0]["recording"]
        .as_str()
        .unwrap()
        .to_owned();
    assert_eq!(replayed(&recording)["fingerprint"], run(&[]));
    // The same recording under a note of another name of this length.
    let mut bytes = std::fs::read(&recording).unwrap();
    let note = bytes.windows(8).position(|it| it == b"defaults").unwrap();
    bytes[note..note + 8].copy_from_slice(b"unknown!");
    std::fs::write(&recording, bytes).unwrap();
    assert_eq!(replayed(&recording)["fingerprint"], run(&former));
    assert_ne!(run(&former), run(&[]));
}
