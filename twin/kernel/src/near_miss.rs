/// Maximum number of suggestions.
const SUGGESTIONS_MAX: usize = 3;

/// Returns the candidates close to the misspelt `word`, nearest first, ties in the order of
/// `candidates`. A candidate is close if its edit distance (insertion, deletion, replacement,
/// transposition of neighbours) is at most a third of the word's letters, or two, and at most half
/// of the letters of the longer of both. An exact match is excluded.
///
/// ```
/// use twinrig_kernel::near_misses;
/// assert_eq!(near_misses("frequncy", ["period", "frequency"]), ["frequency"]);
/// ```
pub fn near_misses<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    near_misses_of(word, &candidates.into_iter().collect::<Vec<_>>())
}

fn near_misses_of<'a>(word: &str, candidates: &[&'a str]) -> Vec<&'a str> {
    let letters = word.chars().count();
    let distance_max = (letters / 3).max(2);
    // No edit distance is below the difference of the lengths, which is counted first: it rules out
    // most candidates, and scenarios may have thousands of misspelt words.
    let may_be_near =
        |candidate: &&str| candidate.chars().count().abs_diff(letters) <= distance_max;
    let mut found: Vec<(usize, &str)> = candidates
        .iter()
        .copied()
        .filter(may_be_near)
        .map(|candidate| (strsim::osa_distance(word, candidate), candidate))
        .filter(|&(distance, candidate)| {
            (1..=distance_max).contains(&distance)
                && 2 * distance <= candidate.chars().count().max(letters)
        })
        .collect();
    found.sort_by_key(|&(distance, _)| distance);
    found.dedup();
    found.truncate(SUGGESTIONS_MAX);
    found.into_iter().map(|(_, candidate)| candidate).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_are_sorted_by_distance_and_distant_ones_omitted() {
        let legs = [
            "leg/LF/hip/command",
            "leg/RF/hip/command",
            "leg/LF/knee/command",
            "body/position",
        ];
        assert_eq!(
            near_misses("leg/LF/hip/comand", legs)[..2],
            ["leg/LF/hip/command", "leg/RF/hip/command"]
        );
        assert!(near_misses("temperature", legs).is_empty());
        assert!(
            near_misses("body/position", legs).is_empty(),
            "an exact match is excluded"
        );
        assert!(near_misses("ab", ["xy"]).is_empty(), "nothing in common");
        assert!(
            near_misses("kp", ["hip"]).is_empty(),
            "one letter in common"
        );
    }

    #[test]
    fn lengths_rule_out_no_near_candidate() {
        let words = [
            "a",
            "ab",
            "abc",
            "abcd",
            "abcde",
            "abcdef",
            "abcdefgh",
            "abcdefghijkl",
        ];
        for word in words {
            for other in words.into_iter().filter(|other| *other != word) {
                let distance = strsim::osa_distance(word, other);
                let longest = word.len().max(other.len());
                let is_near = distance <= (word.len() / 3).max(2) && 2 * distance <= longest;
                assert_eq!(
                    near_misses(word, [other]).len(),
                    usize::from(is_near),
                    "{word} {other}"
                );
            }
        }
    }

    #[test]
    fn transposition_is_one_edit() {
        // Two letters permit two edits, but not of all letters: a transposition is one edit.
        assert_eq!(near_misses("ab", ["ba"]), ["ba"]);
    }
}
