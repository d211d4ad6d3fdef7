use std::convert::identity;
use std::path::Path;

use proptest::prelude::*;
use twinrig_campaign::sweep::{Partition, RowStore, StoreError, SweepRow};

use twinrig_testing::folder::Folder;

use super::{key, row};

const COUNT: usize = 5;

fn open(folder: &Path, partition: &str) -> Result<RowStore<SweepRow>, StoreError> {
    let wanted = Some((0..COUNT).map(key).collect());
    RowStore::open(folder, partition.parse().unwrap(), wanted, identity)
}

/// Numbers of the rows that the store has, all of which are intact.
fn found(store: &RowStore<SweepRow>) -> Vec<usize> {
    let numbers = (0..COUNT).filter(|&number| {
        let found = store.get(&key(number));
        assert!(found.is_none_or(|found| *found == row(number)), "{found:?}");
        assert_eq!(store.row(key(number)).unwrap().as_ref(), found);
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
    let folder = Folder::new("sweep-truncated");
    let whole = write(folder.path());
    let path = folder.path().join("all.jsonl");
    let ends = whole.iter().enumerate();
    let ends: Vec<usize> = ends
        .filter(|(_, byte)| **byte == b'\n')
        .map(|(at, _)| at + 1)
        .collect();
    for length in ends[COUNT - 3]..whole.len() {
        std::fs::write(&path, &whole[..length]).unwrap();
        let complete = ends.iter().filter(|end| **end <= length).count();
        let mut store = open(folder.path(), "1/1").unwrap();
        assert_eq!(found(&store), (0..complete).collect::<Vec<_>>(), "{length}");
        assert_eq!(store.warnings().len(), usize::from(!ends.contains(&length)));
        for number in complete..COUNT {
            store.append(key(number), row(number)).unwrap();
        }
        drop(store);
        let store = open(folder.path(), "1/1").unwrap();
        assert_eq!(found(&store).len(), COUNT, "{length}");
        assert!(store.warnings().is_empty(), "{:?}", store.warnings());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn damaged_byte_costs_one_row_at_most(at: prop::sample::Index, byte: u8) {
        let folder = Folder::new("sweep-damaged");
        let mut bytes = write(folder.path());
        let at = at.index(bytes.len());
        prop_assume!(bytes[at] != byte);
        bytes[at] = byte;
        std::fs::write(folder.path().join("all.jsonl"), bytes).unwrap();
        let store = open(folder.path(), "1/1").unwrap();
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
    let folder = Folder::new("sweep-partitions");
    let mut one = open(folder.path(), "1/2").unwrap();
    let mut two = open(folder.path(), "2/2").unwrap();
    one.append(key(0), row(0)).unwrap();
    two.append(key(1), row(1)).unwrap();
    one.read_others().unwrap();
    assert_eq!(found(&one), [0, 1]);
    // Another number of partitions has other files.
    let mut three = open(folder.path(), "2/3").unwrap();
    three.append(key(2), row(2)).unwrap();
    assert_eq!(found(&open(folder.path(), "1/1").unwrap()), [0, 1, 2]);
}

/// In any order, of files that have grown since the store was opened.
#[test]
fn rows_are_read_from_where_they_are() {
    let folder = Folder::new("sweep-places");
    let mut one = open(folder.path(), "1/2").unwrap();
    let mut two = open(folder.path(), "2/2").unwrap();
    for number in [3, 0, 4] {
        one.append(key(number), row(number)).unwrap();
    }
    for number in [2, 1] {
        two.append(key(number), row(number)).unwrap();
        one.read_others().unwrap();
    }
    let mut reader = one.reader();
    for number in [0, 1, 2, 3, 4, 1, 0, 0] {
        let place = one.place(&key(number)).unwrap();
        assert_eq!(reader.row(key(number), place).unwrap(), row(number));
    }
    assert_eq!(one.row(key(COUNT)).unwrap(), None);
    // Another line in its place is no row.
    let place = one.place(&key(0)).unwrap();
    assert!(matches!(
        reader.row(key(1), place),
        Err(StoreError::Changed { .. })
    ));
    std::fs::write(folder.path().join("part-1-of-2.jsonl"), "shorter\n").unwrap();
    assert!(matches!(one.row(key(4)), Err(StoreError::Changed { .. })));
}

#[test]
fn store_without_wanted_keys_has_all_rows() {
    let folder = Folder::new("sweep-all");
    write(folder.path());
    std::fs::write(folder.path().join("other.jsonl"), "no row\n").unwrap();
    let open = || {
        RowStore::open(folder.path(), Partition::WHOLE, None, |row: SweepRow| {
            row.seed
        })
    };
    let mut store = open().unwrap();
    assert_eq!(store.get(&key(99)), Some(&row(99).seed));
    assert_eq!(store.row(key(99)).unwrap(), Some(row(99)));
    assert_eq!(store.warnings().len(), 1);
    store.append(key(100), row(100)).unwrap();
    assert_eq!(store.row(key(100)).unwrap(), Some(row(100)));
}

#[test]
fn store_in_memory_has_values_and_no_rows() {
    let mut store = RowStore::in_memory(|row: SweepRow| row.seed);
    store.append(key(1), row(1)).unwrap();
    store.read_others().unwrap();
    assert_eq!(store.get(&key(1)), Some(&row(1).seed));
    assert_eq!(store.row(key(1)).unwrap(), None);
}

#[test]
fn file_has_one_writer() {
    let folder = Folder::new("sweep-locked");
    let first = open(folder.path(), "1/2").unwrap();
    let second = open(folder.path(), "1/2").unwrap_err();
    assert!(matches!(second, StoreError::Locked { .. }), "{second}");
    drop(first);
    open(folder.path(), "1/2").unwrap();
}

#[test]
fn partitions_are_written_as_a_fraction() {
    let partition = |text: &str| text.parse::<Partition>();
    assert_eq!(partition("2/3"), Ok(Partition { part: 2, of: 3 }));
    for wrong in ["", "1", "0/2", "3/2", "1/0", "-1/2", "1/2/3"] {
        assert!(partition(wrong).is_err(), "{wrong}");
    }
}
