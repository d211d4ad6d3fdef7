//! Patterns of signal names.

/// Whether `name` matches `pattern`: `*` stands for any part of a name up to a slash, `**` for anything.
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

/// Whether `pattern` is one: a name with a `*` in it.
pub(crate) fn is_pattern(pattern: &str) -> bool {
    pattern.contains('*')
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn a_star_stays_within_its_part() {
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
