//! Truncated, damaged and foreign files cause neither panics nor wrong numbers.

use std::sync::LazyLock;

use super::common::*;
use proptest::prelude::*;
use twinrig_record::{
    ChangeMessage, EventMessage, FootstepMessage, RecordError, Recording, VerdictMessage,
};

const STEPS: u64 = 200;
static COMPLETE: LazyLock<Vec<u8>> = LazyLock::new(|| recorded(STEPS));

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn truncated_file_is_readable_up_to_its_last_flush(cut in any::<prop::sample::Index>()) {
        let len = cut.index(COMPLETE.len());
        let bytes = COMPLETE[..len].to_vec();
        match Recording::from_bytes(bytes) {
            Err(RecordError::NotMcap) => prop_assert!(len < 8),
            Err(error) => prop_assert!(false, "{error}"),
            Ok(recording) => {
                prop_assert!(!recording.is_complete());
                for (step, sample) in (0..).zip(recording.group("plant").iter().flat_map(|g| recording.samples(g))) {
                    prop_assert_eq!(sample.time.as_nanos(), step * PERIOD_NS);
                    prop_assert_eq!(sample.all().collect::<Vec<_>>(), plant_values(step));
                }
                // Samples make up most of the file; at most a chunk of 10 samples is lost.
                let samples = recording.group("plant").map_or(0, twinrig_record::SampledGroup::len);
                let expected = (len as f64 / COMPLETE.len() as f64 - 0.25) * STEPS as f64;
                prop_assert!(samples as f64 >= expected, "{} samples in {} bytes", samples, len);
            }
        }
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..2000), magic in any::<bool>()) {
        let mut file = if magic { mcap::MAGIC.to_vec() } else { Vec::new() };
        file.extend(bytes);
        if let Ok(recording) = Recording::from_bytes(file) {
            read_all(&recording);
        }
    }

    #[test]
    fn records_of_arbitrary_content_never_panic(
        records in prop::collection::vec((0..20_u8, prop::collection::vec(any::<u8>(), 0..80)), 0..20),
    ) {
        let mut file = mcap::MAGIC.to_vec();
        for (opcode, body) in records {
            file.push(opcode);
            file.extend((body.len() as u64).to_le_bytes());
            file.extend(body);
        }
        if let Ok(recording) = Recording::from_bytes(file) {
            read_all(&recording);
        }
    }

    #[test]
    fn flipped_byte_is_an_error_or_changes_no_number(at in any::<prop::sample::Index>(), flip in 1..=255_u8) {
        let mut bytes = COMPLETE.clone();
        let at = at.index(bytes.len());
        bytes[at] ^= flip;
        if let Ok(recording) = Recording::from_bytes(bytes) {
            for (group, values) in [("plant", plant_values as fn(u64) -> Vec<f64>), ("process-outputs", command_values)] {
                let Some(group) = recording.group(group) else { continue };
                for sample in recording.samples(group) {
                    prop_assert_eq!(sample.all().collect::<Vec<_>>(), values(sample.time.as_nanos() / PERIOD_NS));
                }
            }
            read_all(&recording);
        }
    }
}

fn read_all(recording: &Recording) {
    for group in recording.groups() {
        for sample in recording.samples(group) {
            let _ = sample.all().count();
        }
        for signal in &group.signals {
            let _ = recording.series(&signal.name);
        }
    }
    let _ = recording.messages::<EventMessage>();
    let _ = recording.messages::<ChangeMessage>();
    let _ = recording.messages::<FootstepMessage>();
    let _ = recording.messages::<VerdictMessage>();
    let _ = (
        recording.attachments().count(),
        recording.seed(),
        recording.fingerprint(),
        recording.reached(),
    );
    let _ = twinrig_record::first_divergence(recording, recording);
}

#[test]
fn compressed_file_is_rejected_with_the_name_of_the_compression() {
    // A chunk record with the compression `zstd`.
    let mut body = [0_u8; 28].to_vec();
    body.extend(4_u32.to_le_bytes());
    body.extend(b"zstd");
    body.extend(0_u64.to_le_bytes());
    let mut file = mcap::MAGIC.to_vec();
    file.push(6);
    file.extend((body.len() as u64).to_le_bytes());
    file.extend(body);
    let error = Recording::from_bytes(file).unwrap_err();
    assert!(
        matches!(&error, RecordError::Compressed { compression, .. } if compression == "zstd"),
        "{error}"
    );
}

#[test]
fn file_without_its_last_byte_is_incomplete() {
    for missing in 1..100 {
        assert!(
            !read(&COMPLETE[..COMPLETE.len() - missing]).is_complete(),
            "{missing}"
        );
    }
    assert!(read(&COMPLETE).is_complete());
}
