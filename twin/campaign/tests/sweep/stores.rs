use std::collections::BTreeSet;
use std::path::Path;

use proptest::prelude::*;
use twinrig_campaign::sweep::{Partition, RowStore, StoreError};

use crate::{Folder, key, row};

const COUNT: usize = 5;

fn open(folder: &Path, partition: &str) -> Result<RowStore, StoreError> {
    let wanted: BTreeSet<_> = (0..COUNT).map(key).collect();
    RowStore::open(folder, partition.parse().unwrap(), wanted)
}

/// Numbers of the rows that the store has, all of which are intact.
fn found(store: &RowStore) -> Vec<usize> {
    let numbers = (0..COUNT).filter(|&number| {
        let found = store.get(&key(number));
        assert!(found.is_none_or(|found| *found == row(number)), "{found:?}");
        found.is_some()
    });
    numbers.collect()
}

fn write(folder: &Path) -> Vec<u8> {
    let mut store = open(folder, "1/1").unwrap();
    for number in 0..COUNT {
        store.append(key(number), row(number)).unwrap();
    }
    // A row of another sweep is kept on disk, not in memory.
    store.append(key(99), row(99)).unwrap();
    std::fs::read(folder.join("all.jsonl")).unwrap()
}

/// As a process is killed within a write, at every byte of the last two lines.
#[test]
fn store_truncated_at_any_byte_has_the_complete_rows_and_continues() {
    let folder = Folder::new("truncated");
    let whole = write(&folder.0);
    let path = folder.0.join("all.jsonl");
    let ends = whole.iter().enumerate();
    let ends: Vec<usize> = ends
        .filter(|(_, byte)| **byte == b'\n')
        .map(|(at, _)| at + 1)
        .collect();
    for length in ends[COUNT - 3]..whole.len() {
        std::fs::write(&path, &whole[..length]).unwrap();
        let complete = ends.iter().filter(|end| **end <= length).count();
        let mut store = open(&folder.0, "1/1").unwrap();
        assert_eq!(found(&store), (0..complete).collect::<Vec<_>>(), "{length}");
        assert_eq!(store.warnings().len(), usize::from(!ends.contains(&length)));
        for number in complete..COUNT {
            store.append(key(number), row(number)).unwrap();
        }
        drop(store);
        let store = open(&folder.0, "1/1").unwrap();
        assert_eq!(found(&store).len(), COUNT, "{length}");
        assert!(store.warnings().is_empty(), "{:?}", store.warnings());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn damaged_byte_costs_one_row_at_most(at: prop::sample::Index, byte: u8) {
        let folder = Folder::new("damaged");
        let mut bytes = write(&folder.0);
        let at = at.index(bytes.len());
        prop_assume!(bytes[at] != byte);
        bytes[at] = byte;
        std::fs::write(folder.0.join("all.jsonl"), bytes).unwrap();
        let store = open(&folder.0, "1/1").unwrap();
        // A damaged line break damages two lines.
        prop_assert!(found(&store).len() >= COUNT - 2);
        prop_assert!(found(&store).len() == COUNT || !store.warnings().is_empty());
    }

    #[test]
    fn every_point_is_in_exactly_one_partition(of in 1_usize..20, index in 0_usize..1000) {
        let contains = |part: &usize| Partition { part: *part, of }.contains(index);
        prop_assert_eq!((1..=of).filter(contains).count(), 1);
    }
}

#[test]
fn partitions_are_separate_files_that_are_read_together() {
    let folder = Folder::new("partitions");
    let mut one = open(&folder.0, "1/2").unwrap();
    let mut two = open(&folder.0, "2/2").unwrap();
    one.append(key(0), row(0)).unwrap();
    two.append(key(1), row(1)).unwrap();
    one.read_others().unwrap();
    assert_eq!(found(&one), [0, 1]);
    // Another number of partitions has other files.
    let mut three = open(&folder.0, "2/3").unwrap();
    three.append(key(2), row(2)).unwrap();
    assert_eq!(found(&open(&folder.0, "1/1").unwrap()), [0, 1, 2]);
}

#[test]
fn file_has_one_writer() {
    let folder = Folder::new("locked");
    let first = open(&folder.0, "1/2").unwrap();
    let second = open(&folder.0, "1/2").unwrap_err();
    assert!(matches!(second, StoreError::Locked { .. }), "{second}");
    drop(first);
    open(&folder.0, "1/2").unwrap();
}

#[test]
fn partitions_are_written_as_a_fraction() {
    let partition = |text: &str| text.parse::<Partition>();
    assert_eq!(partition("2/3"), Ok(Partition { part: 2, of: 3 }));
    for wrong in ["", "1", "0/2", "3/2", "1/0", "-1/2", "1/2/3"] {
        assert!(partition(wrong).is_err(), "{wrong}");
    }
}
