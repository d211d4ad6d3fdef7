//! Failures are kept beside the source file of their test, and replayed first.

use std::cell::RefCell;
use std::fs;

use crate::folder::Folder;
use crate::laws::{self, Case};
use proptest::test_runner::{TestError, TestRunner};

use super::{Flaw, setup};

/// Runs a law on a driver with a flaw, as a `proptest!` in this source file; returns its first
/// case, its failure, and the smallest case that fails.
fn run(source: &'static str) -> (Case, String, Case) {
    let mut config = laws::config();
    config.source_file = Some(source);
    let setup = setup(Some(Flaw::NeverResynchronises));
    let first = RefCell::new(None);
    let tested = TestRunner::new(config).run(&laws::cases(), |case| {
        first.borrow_mut().get_or_insert_with(|| case.clone());
        Ok(laws::recovers(&setup, &case)?)
    });
    let Err(TestError::Fail(reason, smallest)) = tested else {
        panic!("the flaw is not found: {tested:?}");
    };
    (first.into_inner().unwrap(), reason.to_string(), smallest)
}

#[test]
fn failures_are_kept_and_replayed_first() {
    let folder = Folder::new("laws");
    let source = folder.join("driver.rs");
    fs::write(&source, "").unwrap();
    let source: &'static str = Box::leak(source.into_boxed_str());
    let (_, reason, smallest) = run(source);
    assert!(reason.contains("recovers is violated at "), "{reason}");
    let path = folder.join("regressions/driver.txt");
    let kept = fs::read_to_string(&path).unwrap();
    let (seed, case) = kept.trim_end().split_once(" # ").unwrap();
    assert!(seed.starts_with("cc ") && seed.len() > 40, "{seed}");
    assert_eq!(case, format!("{smallest:?}"));

    // Two runs draw other cases, unless the first one of both is the kept one.
    let [one, other] = [(); 2].map(|()| run(source));
    assert_eq!(one.0, other.0);
    assert_eq!([&one.2, &other.2], [&smallest; 2]);
    assert_eq!(fs::read_to_string(&path).unwrap(), kept);
}
