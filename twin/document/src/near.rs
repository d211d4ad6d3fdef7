//! The word that was probably meant.

use twinrig_kernel::near_misses;

/// The candidate that was probably meant by `word`, if there is one: the nearest in spelling, or else one of which `word`
/// is the beginning or the ending, or the other way round. Ties go to the earliest candidate.
///
/// ```
/// use twinrig_document::nearest;
///
/// assert_eq!(nearest("frequncy", ["period", "frequency"]), Some("frequency"));
/// assert_eq!(nearest("colour", ["period", "frequency"]), None);
/// ```
pub fn nearest<'c>(word: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<&'c str> {
    const PART_MIN: usize = 3;
    let candidates: Vec<&str> = candidates.into_iter().collect();
    let near = near_misses(word, candidates.iter().copied());
    near.first().copied().or_else(|| {
        candidates.into_iter().find(|candidate| {
            let (short, long) = if word.len() < candidate.len() {
                (word, *candidate)
            } else {
                (*candidate, word)
            };
            short.len() >= PART_MIN && (long.starts_with(short) || long.ends_with(short))
        })
    })
}

/// `did you mean `x`?`, or the list of what there is, or nothing where there is nothing.
///
/// A long list is cut, with the number of words left off.
pub fn suggestion<'c>(
    word: &str,
    what: &str,
    candidates: impl IntoIterator<Item = &'c str>,
) -> String {
    const SHOWN_MAX: usize = 24;
    let candidates: Vec<&str> = candidates.into_iter().collect();
    if let Some(near) = nearest(word, candidates.iter().copied()) {
        return format!("did you mean `{near}`?");
    }
    if candidates.is_empty() {
        return String::new();
    }
    let list = candidates
        .iter()
        .take(SHOWN_MAX)
        .copied()
        .collect::<Vec<_>>()
        .join(", ");
    if candidates.len() > SHOWN_MAX {
        let left = candidates.len() - SHOWN_MAX;
        return format!("{what}: {list}, and {left} more");
    }
    format!("{what}: {list}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_swap_counts_once() {
        assert_eq!(nearest("hgit", ["gait", "hgti"]), Some("hgti"));
    }

    #[test]
    fn a_tie_goes_to_the_earliest() {
        assert_eq!(nearest("LX", ["LF", "LH"]), Some("LF"));
    }

    #[test]
    fn nothing_near_lists_what_there_is() {
        assert_eq!(
            suggestion("zzz", "models", ["massless", "lcp"]),
            "models: massless, lcp"
        );
        assert_eq!(suggestion("zzz", "models", []), "");
    }
}
