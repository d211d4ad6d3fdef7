//! What MuJoCo says of a model that it refuses, whole.

use mujoco_rs::error::{MjEditError, MjModelError};
use mujoco_rs::wrappers::mj_editing::MjSpec;

use crate::engine::EngineError;

/// Room that the wrapper gives a message when it loads a model; a longer one is cut there \[bytes\].
const ROOM: usize = 99;

/// Where MuJoCo says the line, in its own words and in those of its XML parser.
const LINES: [&str; 2] = ["line ", "Line number="];

/// Why MuJoCo refuses a model, which is what it says when it takes the model in two steps, `parse` and compile: the second has
/// room for the whole of it, with the line at its end.
pub(crate) fn refused(
    why: &MjModelError,
    parse: impl FnOnce() -> Result<MjSpec, MjEditError>,
) -> EngineError {
    let compiled = parse().and_then(|mut spec| spec.compile());
    let message = match (compiled, why) {
        (Err(MjEditError::CompileFailed(message)), _) => message,
        (_, MjModelError::LoadFailed(message)) => {
            let end = if message.len() >= ROOM { "…" } else { "" };
            format!("{message}{end}")
        }
        (_, why) => why.to_string(),
    };
    let message = in_one_line(&message);
    EngineError::Model(
        message
            .strip_prefix("Error: ")
            .unwrap_or(&message)
            .to_owned(),
    )
}

/// A message of several lines in one.
pub(crate) fn in_one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The line that a message speaks of, counted from 1. One that may have lost digits is none.
pub(crate) fn line(message: &str) -> Option<usize> {
    let after = |word: &&str| Some(message.rfind(*word)? + word.len());
    let start = LINES.iter().filter_map(after).max()?;
    let rest = &message[start..];
    let end = rest.find(|c: char| !c.is_ascii_digit());
    let (digits, rest) = rest.split_at(end.unwrap_or(rest.len()));
    let whole = !rest.starts_with('…');
    digits.parse().ok().filter(|&line| line > 0 && whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_is_the_last_one_named_and_only_where_its_digits_are_whole() {
        assert_eq!(
            line("mass must be positive Element name 'line 7', id 1, line 32"),
            Some(32)
        );
        assert_eq!(
            line("Error=X ErrorID=14 (0xe) Line number=3: XMLElement name=free…"),
            Some(3)
        );
        assert_eq!(line("Element 'joint', line 1…"), None);
        assert_eq!(line("Element 'joint', line"), None);
        assert_eq!(line("Element 'joint', line 0"), None);
    }
}
