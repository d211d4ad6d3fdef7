//! Patterns of signal names.

/// Returns whether `name` matches `pattern`: `*` matches any text without a slash, `**` any text.
///
/// ```
/// use twinrig_scenario::matches;
///
/// assert!(matches("leg/*/foot/load", "leg/LF/foot/load"));
/// assert!(!matches("leg/*", "leg/LF/foot/load"));
/// assert!(matches("leg/**", "leg/LF/foot/load"));
/// ```
pub fn matches(pattern: &str, name: &str) -> bool {
    let Some(star) = pattern.find('*') else {
        return pattern == name;
    };
    let (head, tail) = pattern.split_at(star);
    let Some(rest) = name.strip_prefix(head) else {
        return false;
    };
    let (tail, deep) = match tail.strip_prefix("**") {
        Some(tail) => (tail, true),
        None => (&tail[1..], false),
    };
    let ends = rest.char_indices().map(|(at, _)| at).chain([rest.len()]);
    ends.take_while(|&at| deep || !rest[..at].contains('/'))
        .any(|at| matches(tail, &rest[at..]))
}

/// Returns whether `pattern` contains a `*`.
pub(crate) fn is_pattern(pattern: &str) -> bool {
    pattern.contains('*')
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn single_star_does_not_match_a_slash() {
        assert!(matches("*", "energy"));
        assert!(!matches("*", "energy/kinetic"));
        assert!(matches("**", "energy/kinetic"));
        assert!(matches("leg/*F/hip/*", "leg/RF/hip/torque"));
        assert!(!matches("leg/*F/hip/*", "leg/RH/hip/torque"));
        assert!(matches("body/position", "body/position"));
        assert!(!matches("body/position", "body/position/x"));
        assert!(matches("body/position*", "body/position"));
    }
}
