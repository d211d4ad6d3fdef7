//! `twin diff`

use std::path::Path;

use serde::Serialize;
use twinrig_record::{Comparison, Divergence, Recording, first_divergence};

use super::{FINE, NOT_SO, Terminal, WRONG};
use crate::args::DiffArgs;
use crate::error::TwinError;

/// Where two recordings part, as it is printed.
#[derive(Serialize)]
pub(super) struct Difference {
    identical: bool,
    signals: usize,
    equal_samples: u64,
    first: Option<First>,
    only_in_a: Vec<String>,
    only_in_b: Vec<String>,
    fingerprint_a: Option<String>,
    fingerprint_b: Option<String>,
}

#[derive(Serialize)]
struct First {
    time_s: f64,
    time_ns: u64,
    group: String,
    signal: String,
    component: usize,
    a: Option<f64>,
    b: Option<f64>,
}

pub(super) fn diff(args: &DiffArgs, terminal: &mut Terminal<'_>) -> u8 {
    let opened = open(&args.a).and_then(|a| Ok((a, open(&args.b)?)));
    match opened {
        Ok((a, b)) => {
            let difference = Difference::of(&a, &b);
            if args.json {
                terminal.print_json(&difference);
            } else {
                let text = difference.text(terminal.paint);
                terminal.print(&text);
            }
            if difference.identical { FINE } else { NOT_SO }
        }
        Err(error) => {
            terminal.complain(&error);
            WRONG
        }
    }
}

pub(super) fn open(path: &Path) -> Result<Recording, TwinError> {
    Recording::open(path).map_err(|source| TwinError::Record {
        path: path.to_owned(),
        source,
    })
}

impl Difference {
    pub(super) fn of(a: &Recording, b: &Recording) -> Self {
        let Comparison {
            first,
            signals,
            equal_samples,
            only_in_a,
            only_in_b,
        } = first_divergence(a, b);
        let first = first.map(
            |Divergence {
                 time,
                 group,
                 signal,
                 component,
                 a,
                 b,
             }| First {
                time_s: time.as_secs_f64(),
                time_ns: time.as_nanos(),
                group,
                signal,
                component,
                a,
                b,
            },
        );
        Self {
            identical: first.is_none() && only_in_a.is_empty() && only_in_b.is_empty(),
            signals,
            equal_samples,
            first,
            only_in_a,
            only_in_b,
            fingerprint_a: a.fingerprint().map(str::to_owned),
            fingerprint_b: b.fingerprint().map(str::to_owned),
        }
    }

    /// A few lines for a person.
    pub(super) fn text(&self, paint: crate::paint::Paint) -> String {
        let mut lines = Vec::new();
        match &self.first {
            None => {
                let word = paint.green("equal");
                lines.push(format!(
                    "{word}: {} common signals, {} samples, bit for bit",
                    self.signals, self.equal_samples
                ));
            }
            Some(first) => {
                let signal = paint.bold(&format!("{}[{}]", first.signal, first.component));
                let word = paint.red("different");
                lines.push(format!(
                    "{word} from {} s on: {signal} ({}), after {} equal samples of {} common signals",
                    first.time_s, first.group, self.equal_samples, self.signals
                ));
                for (name, value) in [("a", first.a), ("b", first.b)] {
                    let value = value.map_or("no sample".to_owned(), |value| {
                        format!("{value:?}  (bits {:016x})", value.to_bits())
                    });
                    lines.push(format!("  {name}  {value}"));
                }
            }
        }
        for (name, only) in [("a", &self.only_in_a), ("b", &self.only_in_b)] {
            if !only.is_empty() {
                lines.push(format!("only in {name}: {}", only.join(", ")));
            }
        }
        lines.join("\n")
    }
}
