//! A study as one page.
use crate::machine::Machine;
use crate::study::Study;
/// x
pub fn html(_: &Study, _: &Machine, _: &str) -> String {
    String::new()
}
