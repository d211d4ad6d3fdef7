use std::collections::BTreeSet;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};

use twinrig_campaign::sweep::{SweepRow, run_points};
use twinrig_runtime::interrupt::{self, Token};

use crate::row;

fn jobs(count: usize) -> NonZeroUsize {
    NonZeroUsize::new(count).unwrap()
}

/// Runs the points; returns those with a row, in the order of their ends.
fn run(
    points: &[usize],
    count: usize,
    one: &(dyn Fn(usize) -> Option<SweepRow> + Sync),
) -> Vec<(usize, SweepRow)> {
    let mut rows = Vec::new();
    run_points(points, jobs(count), one, &mut |row| {
        rows.extend(row);
        true
    })
    .unwrap();
    rows
}

#[test]
fn each_point_is_run_once_on_any_number_of_threads() {
    let points: Vec<usize> = (0..100).map(|n| 3 * n).collect();
    for count in [1, 2, 7, 200] {
        let mut rows = run(&points, count, &|point| Some(row(point)));
        rows.sort_by_key(|(point, _)| *point);
        let expected: Vec<_> = points.iter().map(|&point| (point, row(point))).collect();
        assert_eq!(rows, expected);
    }
    assert!(run(&[], 3, &|_| None).is_empty());
}

#[test]
fn panic_of_one_run_is_one_row_with_an_error() {
    let rows = run(&[0, 1, 2, 3], 2, &|point| {
        assert!(point != 2, "no such point");
        Some(row(point))
    });
    let failed: Vec<_> = rows.iter().filter(|(point, _)| *point == 2).collect();
    let [(_, failed)] = failed[..] else {
        panic!("{failed:?}")
    };
    assert!(failed.error.as_ref().unwrap().contains("no such point"));
    assert_eq!(rows.len(), 4);
}

/// The threads inherit the token, and the runs that they have begun are not rows.
#[test]
fn interrupt_of_the_token_ends_the_sweep() {
    let token = Token::new();
    let points: Vec<usize> = (0..1000).collect();
    let begun = AtomicUsize::new(0);
    let rows = token.scope(|| {
        run(&points, 2, &|point| {
            if begun.fetch_add(1, Ordering::SeqCst) == 20 {
                token.request();
            }
            (!interrupt::is_requested()).then(|| row(point))
        })
    });
    let points: BTreeSet<usize> = rows.iter().map(|(point, _)| *point).collect();
    assert!((19..=21).contains(&rows.len()), "{}", rows.len());
    assert_eq!(points.len(), rows.len());
}

#[test]
fn caller_ends_the_sweep() {
    let points: Vec<usize> = (0..1000).collect();
    let mut count = 0;
    let mut observe = |row: Option<(usize, SweepRow)>| {
        count += usize::from(row.is_some());
        count < 10
    };
    let one = |point| {
        std::thread::sleep(std::time::Duration::from_micros(100));
        Some(row(point))
    };
    run_points(&points, jobs(2), &one, &mut observe).unwrap();
    assert!(count < 900, "{count}");
}
