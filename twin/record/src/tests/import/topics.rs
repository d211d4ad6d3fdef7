//! Messages of topics: in JSON and in CDR, in files and in bags.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};
use proptest::prelude::*;
use twinrig_record::{LogFault, LogLimits, import_log};

use super::{import, mapping, recorded, series};
use crate::tests::common::{PERIOD_NS, plant_values, recorded as run};

/// A message: channel, log time, contents.
type Message = (usize, u64, Vec<u8>);

/// Writes an MCAP file; channels have topic, encoding, and name, encoding and text of a schema.
fn mcap(channels: &[[&str; 5]], messages: &[Message], compression: Option<Compression>) -> Vec<u8> {
    let options = WriteOptions::new()
        .compression(compression)
        .chunk_size(Some(1000));
    let mut file = Cursor::new(Vec::new());
    let mut writer = Writer::with_options(&mut file, options).unwrap();
    let add = |[topic, encoding, name, schema, text]: &[&str; 5]| {
        let schema = writer.add_schema(name, schema, text.as_bytes()).unwrap();
        writer
            .add_channel(schema, topic, encoding, &BTreeMap::new())
            .unwrap()
    };
    let channels: Vec<u16> = channels.iter().map(add).collect();
    for (channel, log_time, data) in messages {
        let header = MessageHeader {
            channel_id: channels[*channel],
            sequence: 0,
            log_time: *log_time,
            publish_time: 0,
        };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

const JSON: [&str; 5] = ["/servo", "json", "Servo", "jsonschema", "{}"];
const COMMANDS: [&str; 5] = ["/command", "json", "Command", "jsonschema", "{}"];

const MAPPING: &str = r#"
[[signal]]
name = "angle"
topic = "/servo"
field = "state.position[1]"
unit = "rad"
[[signal]]
name = "command"
topic = "/command"
field = "goal"
unit = "deg"
group = "commanded"
"#;

fn json(position: f64) -> Vec<u8> {
    format!("{{\"state\": {{\"position\": [0, {position}, 9]}}, \"x\": null}}").into_bytes()
}

#[test]
fn each_group_has_the_times_of_its_messages() {
    let second = 1_000_000_000;
    let start = 1_700_000_000 * second;
    let command = |goal: f64| format!("{{\"goal\": {goal}}}").into_bytes();
    let messages = [
        (1, start + 7, command(90.0)),
        (0, start + second, json(0.5)),
        // Files need not be in order.
        (0, start + 3 * second, json(0.25)),
        (0, start + 2 * second, json(-0.0)),
        (1, start + 2 * second, command(180.0)),
    ];
    let log = import(
        "log.mcap",
        &mcap(&[JSON, COMMANDS], &messages, None),
        &mapping(MAPPING),
    );
    let log = log.unwrap_or_else(|error| panic!("{error}"));
    let recording = recorded(&log);
    let (times, values) = series(&recording, "angle");
    assert_eq!(times, [second, 2 * second, 3 * second]);
    assert_eq!(values.map_bits(), [0.5, -0.0, 0.25].to_vec().map_bits());
    let (times, values) = series(&recording, "command");
    assert_eq!(
        (times, log.origin_ns),
        (vec![7, 2 * second], 1_700_000_000_000_000_000)
    );
    assert_eq!(
        values,
        [90.0, 180.0].map(|degrees| degrees * std::f64::consts::PI / 180.0)
    );
}

trait MapBits {
    fn map_bits(self) -> Vec<u64>;
}

impl MapBits for Vec<f64> {
    fn map_bits(self) -> Vec<u64> {
        self.into_iter().map(f64::to_bits).collect()
    }
}

#[test]
fn topics_of_one_group_hold_their_last_values() {
    let text = MAPPING.replace("group = \"commanded\"\n", "");
    let command = |goal: f64| format!("{{\"goal\": {goal}}}").into_bytes();
    let messages = [
        (0, 10, json(1.0)),
        (1, 20, command(0.0)),
        (0, 30, json(2.0)),
        (1, 30, command(180.0)),
        (0, 40, json(3.0)),
    ];
    let log = import(
        "log.mcap",
        &mcap(&[JSON, COMMANDS], &messages, None),
        &mapping(&text),
    );
    let log = log.unwrap();
    let recording = recorded(&log);
    assert_eq!(
        series(&recording, "angle"),
        (vec![20, 30, 40], vec![1.0, 2.0, 3.0])
    );
    let pi = std::f64::consts::PI;
    assert_eq!(
        series(&recording, "command"),
        (vec![20, 30, 40], vec![0.0, pi, pi])
    );
    assert_eq!(
        (log.left_out, recording.note("log.left_out")),
        (1, Some("1"))
    );
}

#[test]
fn stamps_of_messages_are_times() {
    let text = format!("time = {{ field = \"stamp\", origin = \"keep\" }}\n{MAPPING}");
    let text = text
        .replace("/command", "/servo")
        .replace("\"goal\"", "\"state.position.0\"");
    let log = |stamp: &str| {
        let message = format!("{{\"stamp\": {stamp}, \"state\": {{\"position\": [1, 2]}}}}");
        let file = mcap(&[JSON], &[(0, 5, message.into_bytes())], None);
        import("log.mcap", &file, &mapping(&text))
    };
    for (stamp, nanos) in [
        (r#"{"sec": 3, "nanosec": 4}"#, 3_000_000_004),
        (r#"{"secs": 3, "nsecs": 4}"#, 3_000_000_004),
        ("2.5", 2_500_000_000),
    ] {
        let log = log(stamp).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(log.span()[0].as_nanos(), nanos, "{stamp}");
    }
    assert!(matches!(
        *log("{}").unwrap_err().fault,
        LogFault::WrongType { .. }
    ));
    assert!(matches!(
        *log("[]").unwrap_err().fault,
        LogFault::WrongType { .. }
    ));
}

/// Fields of the synthetic run of `common`, which has CDR with schemas.
const RUN: &str = r#"
time = { origin = "keep" }
[[signal]]
name = "y"
topic = "/plant"
field = "body_position[1]"
unit = "m"
[[signal]]
name = "load"
topic = "/plant"
field = "leg_lf_foot_load"
unit = "kN"
[[signal]]
name = "z"
topic = "/odom"
field = "pose.pose.position.z"
unit = "m"
optional = true
group = "commanded"
"#;

#[test]
fn recordings_in_cdr_are_logs_too() {
    let log = import("run.mcap", &run(100), &mapping(RUN));
    let log = log.unwrap_or_else(|error| panic!("{error}"));
    let recording = recorded(&log);
    let steps = 0..100_u64;
    let times: Vec<u64> = steps
        .clone()
        .map(|step| 1_000_000_000 + step * PERIOD_NS)
        .collect();
    for (name, index, factor) in [("y", 1, 1.0), ("load", 10, 1000.0)] {
        let expected = steps.clone().map(|step| plant_values(step)[index] * factor);
        assert_eq!(
            series(&recording, name),
            (times.clone(), expected.collect()),
            "{name}"
        );
    }
    // Frames are written every 20 ms.
    let (times, values) = series(&recording, "z");
    assert_eq!((times.len(), times[1] - times[0]), (10, 20_000_000));
    assert!(values.iter().all(|&z| z == 0.14), "{values:?}");
    // The stamp of a header is the log time of that message.
    let text = RUN.replace("origin", "field = \"header.stamp\", origin");
    let without = |from: &str| text.find(from).unwrap();
    let text = format!(
        "{}{}",
        &text[..without("[[signal]]")],
        &text[without("[[signal]]\nname = \"z\"")..]
    );
    let stamped = import("run.mcap", &run(100), &mapping(&text)).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(
        stamped.groups[0]
            .times
            .iter()
            .map(|t| t.as_nanos())
            .collect::<Vec<_>>(),
        times
    );
}

#[test]
fn both_byte_orders_and_all_types_are_read() {
    let text = "bool a\nint8 b\nuint16 c\nint32 d\nuint64 e\nfloat32 f\nEmpty[] g\nstring h\n\
                float64 i\n===\nMSG: p/Empty\n";
    let channel = ["/t", "cdr", "p/msg/T", "ros2msg", text];
    let message = |big: bool| {
        let mut bytes = vec![0, u8::from(!big), 0, 0];
        let mut add = |value: &[u8], size: usize| {
            while !(bytes.len() - 4).is_multiple_of(size) {
                bytes.push(0);
            }
            let mut value = value.to_vec();
            if big {
                value.reverse();
            }
            bytes.extend(value);
        };
        add(&[1], 1);
        add(&[0xfe], 1);
        add(&40_000_u16.to_le_bytes(), 2);
        add(&(-70_000_i32).to_le_bytes(), 4);
        add(&(1_u64 << 53).to_le_bytes(), 8);
        add(&0.1_f32.to_le_bytes(), 4);
        add(&2_u32.to_le_bytes(), 4);
        add(&[0], 1);
        add(&[0], 1);
        add(&2_u32.to_le_bytes(), 4);
        add(b"x", 1);
        add(b"\0", 1);
        add(&0.1_f64.to_le_bytes(), 8);
        bytes
    };
    let expected = [
        1.0,
        -2.0,
        40_000.0,
        -70_000.0,
        9_007_199_254_740_992.0,
        f64::from(0.1_f32),
        0.1,
    ];
    for big in [false, true] {
        let file = mcap(&[channel], &[(0, 1, message(big))], None);
        for (field, expected) in ["a", "b", "c", "d", "e", "f", "i"].iter().zip(expected) {
            let signal = format!("[[signal]]\nname='s'\ntopic='/t'\nfield='{field}'\nunit='1'");
            let log = import("t.mcap", &file, &mapping(&signal)).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(log.groups[0].signals[0].values, [expected], "{field} {big}");
        }
    }
}

/// Checks the error of a log.
fn fails(log: &[u8], text: &str, parts: &[&str]) {
    let error = import("log.mcap", log, &mapping(text))
        .unwrap_err()
        .to_string();
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in\n{error}");
    }
}

#[test]
fn faults_of_topics_have_place_and_remedy() {
    let file = |messages: &[Message]| mcap(&[JSON, COMMANDS], messages, None);
    let both = [(0, 10, json(1.0)), (1, 20, b"{\"goal\": 1}".to_vec())];
    fails(b"", MAPPING, &["not an MCAP file"]);
    let text = MAPPING.replace("/servo", "/sevro");
    fails(
        &file(&both),
        &text,
        &["no topic `/sevro`", "did you mean `/servo`?"],
    );
    fails(&file(&both[..1]), MAPPING, &["no messages of `/command`"]);
    let same = [both[0].clone(), both[0].clone(), both[1].clone()];
    fails(
        &file(&same),
        MAPPING,
        &["two rows have the time 0.00000001 s"],
    );
    fails(
        &file(&[(0, 1, b"{\"state".to_vec())]),
        MAPPING,
        &["truncated", "(row 1)"],
    );
    let stamped = format!("time = {{ field = 't' }}\n{MAPPING}");
    let back = [2, 1].map(|t| {
        (
            0,
            1,
            format!("{{\"t\": {t}, \"state\": {{\"position\": [0, 1]}}}}").into_bytes(),
        )
    });
    fails(
        &file(&back),
        &stamped,
        &["time goes back by 1 s", "(row 2)"],
    );

    let cdr = [
        "/servo",
        "cdr",
        "p/T",
        "ros2msg",
        "float64 angle\nwstring w\nfloat64[] list\n",
    ];
    let of =
        |field: &str| format!("[[signal]]\nname='s'\ntopic='/servo'\nfield='{field}'\nunit='1'");
    let message = [&[0, 1, 0, 0][..], &0.5_f64.to_le_bytes(), &[0; 16]].concat();
    let log = mcap(&[cdr], &[(0, 1, message.clone())], None);
    assert!(import("log.mcap", &log, &mapping(&of("angle"))).is_ok());
    fails(
        &log,
        &of("angel"),
        &["no field `angel`", "did you mean `angle`?", "(row 1)"],
    );
    fails(&log, &of("angle.x"), &["no field `angle.x`"]);
    fails(&log, &of("angle[0]"), &["`angle` is no list"]);
    fails(&log, &of("list[0]"), &["a wide text is before the field"]);
    fails(
        &mcap(&[cdr], &[(0, 1, message[..7].to_vec())], None),
        &of("angle"),
        &["ends before"],
    );
    fails(
        &mcap(&[cdr], &[(0, 1, vec![0, 7, 0, 0])], None),
        &of("angle"),
        &["not plain CDR"],
    );
    let list = ["/servo", "cdr", "p/T", "ros2msg", "float64[] list\n"];
    let log = mcap(&[list], &[(0, 1, vec![0, 1, 0, 0, 0, 0, 0, 0])], None);
    fails(&log, &of("list"), &["is a list, of which `[0]`"]);
    fails(&log, &of("list[2]"), &["`list` has 0 elements, not 2"]);
    let wrong = ["/servo", "cdr", "p/T", "ros2msg", "Other o\n"];
    fails(
        &mcap(&[wrong], &[], None),
        &of("o"),
        &["the type `p/Other` is not defined"],
    );
    let other = ["/servo", "protobuf", "p/T", "protobuf", ""];
    fails(
        &mcap(&[other], &[], None),
        &of("o"),
        &["encoded as `protobuf`", "`ros2msg`"],
    );
    fails(
        &mcap(&[list], &[], None),
        &of("o"),
        &["no messages of `/servo`"],
    );
}

/// Marks the chunks of a file as compressed, which takes no compressor.
#[test]
fn compressed_chunks_are_refused_with_a_remedy() {
    let file = mcap(&[JSON], &[(0, 10, json(1.0))], None);
    let mut compressed = Vec::new();
    let mut rest = &file[8..];
    compressed.extend(&file[..8]);
    while rest.len() > 9 {
        let length = usize::try_from(u64::from_le_bytes(rest[1..9].try_into().unwrap())).unwrap();
        let body = &rest[9..9 + length];
        if rest[0] == mcap::records::op::CHUNK {
            let named = [&body[..28], &4_u32.to_le_bytes(), b"zstd", &body[32..]].concat();
            compressed.push(rest[0]);
            compressed.extend((named.len() as u64).to_le_bytes());
            compressed.extend(named);
        } else {
            compressed.extend(&rest[..9 + length]);
        }
        rest = &rest[9 + length..];
    }
    fails(
        &compressed,
        MAPPING,
        &["compressed with `zstd`", "mcap decompress", "mcap filter"],
    );
}

#[test]
fn truncated_file_is_read_up_to_its_last_record() {
    let messages: Vec<Message> = (1..200).map(|n| (0, 10 * n, json(n as f64))).collect();
    let text = &MAPPING[..MAPPING.rfind("[[signal]]").unwrap()];
    let file = mcap(&[JSON], &messages, None);
    let log = import("log.mcap", &file[..file.len() / 2], &mapping(text)).unwrap();
    assert!((20..180).contains(&log.rows), "{}", log.rows);
    let at = log.truncated_at.unwrap();
    assert!(at < file.len() as u64 / 2);
    assert_eq!(
        recorded(&log).note("log.truncated_at"),
        Some(at.to_string().as_str())
    );
    assert_eq!(
        import("log.mcap", &file, &mapping(text))
            .unwrap()
            .truncated_at,
        None
    );
}

#[test]
fn bag_is_read_file_by_file() {
    let folder = std::env::temp_dir().join(format!("twinrig-bag-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let text = &MAPPING[..MAPPING.rfind("[[signal]]").unwrap()];
    for (name, time) in [("a_0.mcap", 10), ("a_1.mcap", 20)] {
        let file = mcap(&[JSON], &[(0, time, json(time as f64))], None);
        fs::write(folder.join(name), file).unwrap();
    }
    let read = |metadata: &str| {
        fs::write(folder.join("metadata.yaml"), metadata).unwrap();
        import_log(&folder, &mapping(text), LogLimits::default())
    };
    let start = "rosbag2_bagfile_information:\n  version: 9\n  relative_file_paths:\n";
    let log = read(&format!(
        "{start}    - a_0.mcap\n    - \"a_1.mcap\"\n  files:\n    - path: x\n"
    ));
    let log = log.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(log.groups[0].signals[0].values, [10.0, 20.0]);
    let fault = |metadata: &str| read(metadata).unwrap_err().to_string();
    let sqlite = fault(&format!("{start}    - a_0.db3\n"));
    assert!(
        sqlite.contains("SQLite") && sqlite.contains("ros2 bag convert"),
        "{sqlite}"
    );
    for name in ["../a_0.mcap", "/a_0.mcap", "a_0.mcap.zstd"] {
        let outside = fault(&format!("{start}    - {name}\n"));
        assert!(outside.contains("is not an MCAP file in it"), "{outside}");
    }
    assert!(fault(start).contains("it has no files"));
    assert!(fault("x: y").contains("no `relative_file_paths`"));
    let absent = fault(&format!("{start}    - a_2.mcap\n"));
    assert!(
        absent.contains("a_2.mcap") && absent.contains("cannot be read"),
        "{absent}"
    );
    fs::remove_file(folder.join("metadata.yaml")).unwrap();
    let none = import_log(&folder, &mapping(text), LogLimits::default()).unwrap_err();
    assert!(
        none.to_string().contains("metadata.yaml cannot be read"),
        "{none}"
    );
    fs::remove_dir_all(folder).unwrap();
}

proptest! {
    #[test]
    fn damaged_files_are_errors_or_logs(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8),
        end in any::<prop::sample::Index>(),
    ) {
        let mut file = Cow::from(run(20)).into_owned();
        for (index, byte) in changes {
            let at = index.index(file.len());
            file[at] = byte;
        }
        file.truncate(end.index(file.len()));
        if let Ok(log) = import("run.mcap", &file, &mapping(RUN)) {
            recorded(&log);
        }
    }

    #[test]
    fn garbage_in_definitions_and_messages_is_an_error(
        text in "((bool|uint8|string|float64|A|B)(\\[[0-3]?\\])? [abx]\n|===\nMSG: p/[AB]\n){0,8}",
        body in prop::collection::vec(any::<u8>(), 0..60),
        field in "[abx](\\[[01]\\])?(\\.[abx])?",
    ) {
        let message = [&[0, 1, 0, 0][..], &body].concat();
        let file = mcap(&[["/t", "cdr", "p/T", "ros2msg", &text]], &[(0, 1, message)], None);
        let signal = format!("[[signal]]\nname='s'\ntopic='/t'\nfield='{field}'\nunit='1'");
        let _ = import("t.mcap", &file, &mapping(&signal));
    }
}
