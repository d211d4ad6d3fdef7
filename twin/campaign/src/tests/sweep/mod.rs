//! Sweeps: specifications, designs, shares and stores.

mod designs;
mod morris;
mod results;
mod shares;
mod specs;
mod stores;

use twinrig_campaign::sweep::{
    ExpectationVerdict, RowExpectation, RowKey, RowVerdict, SweepRow, SweepSpec,
};
use twinrig_document::Document;

fn spec(text: &str) -> Result<SweepSpec, String> {
    let document = Document::parse("spec.toml", text).map_err(|error| error.to_string())?;
    SweepSpec::read(&document).map_err(|error| error.to_string())
}

fn key(number: usize) -> RowKey {
    RowKey::of([number.to_string().as_bytes()])
}

/// A row with all kinds of numbers and letters.
fn row(number: usize) -> SweepRow {
    let measured = 0.1 * number as f64;
    SweepRow {
        verdict: RowVerdict::Fail,
        seed: Some(u64::MAX),
        simulated_s: Some(1e-300 * number as f64),
        fell_at_s: None,
        fingerprint: Some(format!("{number:064x}")),
        error: Some("a \"quoted\" word\nand a line".to_owned()),
        expectations: vec![RowExpectation {
            name: "µ, stays".to_owned(),
            verdict: ExpectationVerdict::Unobserved,
            holds: false,
            measured: Some(measured),
            bound: Some(-0.0),
            margin: Some(measured - 0.3),
            unit: "m/s²".to_owned(),
            detail: String::new(),
        }],
    }
}
