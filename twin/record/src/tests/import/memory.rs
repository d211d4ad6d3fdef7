//! Memory of an import: that of the selected columns.

use std::io::Read;

use twinrig_record::{LogFault, LogLimits, import_log_from};

use super::mapping;

/// Log of so many rows in one list, made as it is read, each with a long text that is not selected.
struct Rows {
    count: u64,
    next: u64,
    piece: Vec<u8>,
    at: usize,
}

impl Read for Rows {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.at == self.piece.len() && self.next <= self.count {
            let (n, text) = (self.next, "x".repeat(700));
            let start = if n == 0 { "{\"rows\": [\n" } else { ",\n" };
            self.piece = if n == self.count {
                b"]}".to_vec()
            } else {
                let row = format!(
                    "{}{{\"t\": {n}, \"a\": {}, \"text\": \"{text}\"}}",
                    start,
                    n % 7,
                );
                row.into_bytes()
            };
            (self.at, self.next) = (0, n + 1);
        }
        let count = (self.piece.len() - self.at).min(buffer.len());
        buffer[..count].copy_from_slice(&self.piece[self.at..self.at + count]);
        self.at += count;
        Ok(count)
    }
}

const MAPPING: &str = r#"
rows = "rows"
time = { column = "t", unit = "us" }
signal = [{ name = "a", column = "a", unit = "1" }]
"#;

fn rows(count: u64) -> Rows {
    Rows {
        count,
        next: 0,
        piece: Vec::new(),
        at: 0,
    }
}

#[test]
fn memory_is_that_of_the_selected_columns() {
    const ROWS: u64 = 50_000;
    let mapping = mapping(MAPPING);
    let mut kept = 0;
    let measured = allocation_counter::measure(|| {
        let log = import_log_from("log.json", rows(ROWS), &mapping, LogLimits::default());
        kept = log.unwrap().groups[0].signals[0].values.len();
    });
    assert_eq!(kept as u64, ROWS);
    // A time, a value and an interval of each row; while a vector grows, there are two of it.
    let most = 8 * ROWS * 3 * 2 + 400_000;
    assert!(
        measured.bytes_max < most,
        "{} of {most} bytes",
        measured.bytes_max
    );
    // The log is a dozen times as long.
    assert!(ROWS * 700 > 12 * most);
}

#[test]
fn bounds_are_errors_before_more_memory_is_taken() {
    let mapping = mapping(MAPPING);
    let fault = |limits| {
        let mut fault = None;
        let measured = allocation_counter::measure(|| {
            let result = import_log_from("log.json", rows(u64::MAX), &mapping, limits);
            fault = result.err().map(|error| *error.fault);
        });
        assert!(measured.bytes_max < 1_000_000, "{}", measured.bytes_max);
        fault.unwrap()
    };
    let limits = LogLimits::default();
    let bytes = fault(LogLimits {
        bytes: 1_000_000,
        ..limits
    });
    assert!(
        matches!(bytes, LogFault::TooLong { most: 1_000_000 }),
        "{bytes}"
    );
    let values = fault(LogLimits {
        values: 4000,
        ..limits
    });
    assert!(
        matches!(values, LogFault::TooManyValues { most: 4000 }),
        "{values}"
    );
}

#[test]
fn endless_tokens_take_no_memory() {
    let mapping = mapping(MAPPING);
    for start in [
        "{\"",
        "{\"t\": [\"",
        "[",
        "[{\"t\": 1",
        "{\"rows\": [{\"t\": \"",
        "{\"rows\": [{\"a\":",
    ] {
        let filler = start.chars().last().filter(|c| *c == '[').unwrap_or('1');
        let log = std::io::Cursor::new(start.to_owned());
        let log = log.chain(std::io::repeat(filler as u8).take(20_000_000));
        let mut error = None;
        let measured = allocation_counter::measure(|| {
            let result = import_log_from("log.json", log, &mapping, LogLimits::default());
            error = result.err();
        });
        assert!(error.is_some(), "{start}");
        assert!(
            measured.bytes_max < 1_000_000,
            "{start}: {}",
            measured.bytes_max
        );
    }
}
