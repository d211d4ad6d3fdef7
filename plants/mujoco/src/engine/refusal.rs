//! MuJoCo's messages on refused models, untruncated.

use mujoco_rs::error::{MjEditError, MjModelError};
use mujoco_rs::wrappers::mj_editing::MjSpec;

use super::error::EngineError;

/// Capacity of the wrapper's buffer for messages on loading a model; longer ones are truncated
/// \[bytes\].
const CAPACITY: usize = 99;

/// Texts before a line number, of MuJoCo and of its XML parser.
const LINE_MARKERS: [&str; 2] = ["line ", "Line number="];

/// Returns MuJoCo's reason to refuse a model, taken from a second attempt in two steps, `parse` and
/// compile: compilation reports the complete message, with the line at its end.
pub(crate) fn refused(
    why: &MjModelError,
    parse: impl FnOnce() -> Result<MjSpec, MjEditError>,
) -> EngineError {
    let compiled = parse().and_then(|mut spec| spec.compile());
    let message = match (compiled, why) {
        (Err(MjEditError::CompileFailed(message)), _) => message,
        (_, MjModelError::LoadFailed(message)) => {
            let end = if message.len() >= CAPACITY { "…" } else { "" };
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

/// Returns a message of several lines in one.
pub(crate) fn in_one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Returns the line number in a message, counted from 1; none if digits may have been truncated.
pub(crate) fn line(message: &str) -> Option<usize> {
    let after = |word: &&str| Some(message.rfind(*word)? + word.len());
    let start = LINE_MARKERS.iter().filter_map(after).max()?;
    let rest = &message[start..];
    let end = rest.find(|c: char| !c.is_ascii_digit());
    let (digits, rest) = rest.split_at(end.unwrap_or(rest.len()));
    let complete = !rest.starts_with('…');
    digits.parse().ok().filter(|&line| line > 0 && complete)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_is_the_last_one_with_complete_digits() {
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
