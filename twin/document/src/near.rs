//! Suggestions for misspelt words.

use twinrig_kernel::near_misses;

/// Returns the candidate that `word` most probably stands for: the nearest in spelling, otherwise
/// one that begins or ends with `word` or with which `word` begins or ends. Ties are resolved in
/// favour of the earliest candidate.
///
/// ```
/// use twinrig_document::nearest;
///
/// assert_eq!(nearest("frequncy", ["period", "frequency"]), Some("frequency"));
/// assert_eq!(nearest("colour", ["period", "frequency"]), None);
/// ```
pub fn nearest<'c>(word: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<&'c str> {
    nearest_of(word, &candidates.into_iter().collect::<Vec<_>>())
}

fn nearest_of<'c>(word: &str, candidates: &[&'c str]) -> Option<&'c str> {
    const PART_MIN: usize = 3;
    let plain = |text: &str| text.to_lowercase().replace([' ', '-', '_', '.'], "");
    let same = |candidate: &&&str| plain(candidate) == plain(word);
    if let Some(same) = candidates.iter().find(same) {
        return Some(same);
    }
    let near = near_misses(word, candidates.iter().copied());
    near.first().copied().or_else(|| {
        candidates.iter().copied().find(|candidate| {
            let (short, long) = if word.len() < candidate.len() {
                (word, *candidate)
            } else {
                (*candidate, word)
            };
            short.len() >= PART_MIN && (long.starts_with(short) || long.ends_with(short))
        })
    })
}

/// Returns `` did you mean `x`? ``, otherwise the list of candidates after `label`; empty if there
/// are none.
///
/// A long list is truncated, with the number of omitted words.
pub fn suggestion<'c>(
    word: &str,
    label: &str,
    candidates: impl IntoIterator<Item = &'c str>,
) -> String {
    suggestion_of(word, label, &candidates.into_iter().collect::<Vec<_>>())
}

fn suggestion_of(word: &str, label: &str, candidates: &[&str]) -> String {
    const SHOWN_MAX: usize = 24;
    /// Room for the list in a line of a message.
    const LENGTH_MAX: usize = 210;
    if let Some(near) = nearest_of(word, candidates) {
        return format!("did you mean `{near}`?");
    }
    if candidates.is_empty() {
        return String::new();
    }
    let mut length = 0;
    let fits = |candidate: &&&str| {
        length += candidate.len() + 2;
        length <= LENGTH_MAX
    };
    let shown: Vec<&str> = candidates
        .iter()
        .take(SHOWN_MAX)
        .take_while(fits)
        .copied()
        .collect();
    let list = shown.join(", ");
    if candidates.len() > shown.len() {
        let left = candidates.len() - shown.len();
        return format!("{label}: {list}, and {left} more");
    }
    format!("{label}: {list}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transposition_is_one_edit() {
        assert_eq!(nearest("hgit", ["gait", "hgti"]), Some("hgti"));
    }

    #[test]
    fn tie_is_resolved_in_favour_of_the_earliest() {
        assert_eq!(nearest("LX", ["LF", "LH"]), Some("LF"));
    }

    #[test]
    fn candidates_are_listed_if_none_is_near() {
        assert_eq!(
            suggestion("zzz", "models", ["massless", "lcp"]),
            "models: massless, lcp"
        );
        assert_eq!(suggestion("zzz", "models", []), "");
    }
}
