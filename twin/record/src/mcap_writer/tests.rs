//! Comparison with the writer of the crate `mcap`, and errors of the output.

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use proptest::prelude::*;

use super::*;

#[derive(Debug, Clone)]
enum Step {
    Message(u16, u64, Vec<u8>),
    Flush,
    Attach(String, Vec<u8>),
    Metadata(String, BTreeMap<String, String>),
}

const TYPES: [[&str; 3]; 2] = [["a/A", "ros2msg", "float64 x"], ["b/B", "ros2msg", ""]];
/// Topic and type of each channel.
const CHANNELS: [(&str, usize); 3] = [("/one", 0), ("/two", 1), ("/three", 0)];

fn step() -> impl Strategy<Value = Step> {
    let data = || prop::collection::vec(any::<u8>(), 0..60);
    let map = prop::collection::btree_map("\\PC{0,5}", "\\PC{0,5}", 0..3);
    prop_oneof![
        8 => (0..3_u16, any::<u64>(), data()).prop_map(|(c, t, d)| Step::Message(c, t, d)),
        1 => Just(Step::Flush),
        1 => ("\\PC{0,9}", data()).prop_map(|(name, data)| Step::Attach(name, data)),
        1 => ("\\PC{0,9}", map).prop_map(|(name, map)| Step::Metadata(name, map)),
    ]
}

fn of_channel(topic: &str) -> BTreeMap<String, String> {
    BTreeMap::from([("of".to_owned(), topic.to_owned())])
}

fn written(steps: &[Step]) -> Vec<u8> {
    let mut writer = McapWriter::new(Vec::new(), "ros2", "test").unwrap();
    let channels =
        CHANNELS.map(|(topic, of)| writer.add_channel(topic, "cdr", TYPES[of], &of_channel(topic)));
    for step in steps {
        match step {
            Step::Message(channel, time, data) => {
                let channel = channels[usize::from(*channel)];
                let fill = |room: &mut [u8]| room.copy_from_slice(data);
                writer.message(channel, *time, data.len(), fill);
            }
            Step::Flush => writer.flush().unwrap(),
            Step::Attach(name, data) => {
                let attachment = Attachment {
                    name,
                    media_type: "text/plain",
                    time: 7,
                    data,
                };
                writer.attach(&attachment).unwrap();
            }
            Step::Metadata(name, map) => writer.metadata(name, map).unwrap(),
        }
    }
    writer.finish().unwrap()
}

/// The same by the crate `mcap`.
fn reference(steps: &[Step]) -> Vec<u8> {
    let options = mcap::WriteOptions::new().compression(None).chunk_size(None);
    let options = options
        .profile("ros2")
        .library("test")
        .disable_seeking(true);
    let mut writer = options.create(NoSeek::new(Vec::new())).unwrap();
    let channels = CHANNELS.map(|(topic, of)| {
        let [name, encoding, definition] = TYPES[of];
        let schema = writer.add_schema(name, encoding, definition.as_bytes());
        let metadata = of_channel(topic);
        writer
            .add_channel(schema.unwrap(), topic, "cdr", &metadata)
            .unwrap()
    });
    let mut sequences = [0; 3];
    for step in steps {
        match step {
            Step::Message(channel, time, data) => {
                let channel = usize::from(*channel);
                let header = MessageHeader {
                    channel_id: channels[channel],
                    sequence: sequences[channel],
                    log_time: *time,
                    publish_time: *time,
                };
                sequences[channel] += 1;
                writer.write_to_known_channel(&header, data).unwrap();
            }
            Step::Flush => writer.flush().unwrap(),
            Step::Attach(name, data) => {
                let attachment = mcap::Attachment {
                    log_time: 7,
                    create_time: 7,
                    name: name.clone(),
                    media_type: "text/plain".to_owned(),
                    data: data.into(),
                };
                writer.attach(&attachment).unwrap();
            }
            Step::Metadata(name, map) => {
                let (name, metadata) = (name.clone(), map.clone());
                writer.write_metadata(&Metadata { name, metadata }).unwrap();
            }
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

proptest! {
    #[test]
    fn files_equal_those_of_the_reference_writer(steps in prop::collection::vec(step(), 0..60)) {
        prop_assert_eq!(written(&steps), reference(&steps));
    }
}

#[test]
fn dropped_writer_ends_its_file() {
    let file = std::env::temp_dir().join(format!("twinrig-mcap-{}", std::process::id()));
    let out = std::fs::File::create(&file).unwrap();
    drop(McapWriter::new(out, "ros2", "test").unwrap());
    let bytes = std::fs::read(&file).unwrap();
    std::fs::remove_file(&file).unwrap();
    assert!(bytes.ends_with(mcap::MAGIC) && mcap::Summary::read(&bytes).unwrap().is_some());
}

#[test]
fn nothing_is_written_after_an_error() {
    /// Output that accepts a number of writes.
    struct Full<'c>(usize, &'c std::cell::Cell<usize>);
    impl Write for Full<'_> {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.1.set(self.1.get() + 1);
            if self.1.get() > self.0 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let writes = std::cell::Cell::new(0);
    let mut writer = McapWriter::new(Full(1, &writes), "ros2", "test").unwrap();
    let channel = writer.add_channel("/one", "cdr", TYPES[0], &BTreeMap::new());
    writer.message(channel, 0, 8, |_| ());
    assert!(writer.flush().is_err());
    writer.message(channel, 1, 8, |_| ());
    drop(writer);
    assert_eq!(writes.get(), 2);
}
