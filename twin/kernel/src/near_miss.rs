/// Maximum number of suggestions.
const SUGGESTIONS_MAX: usize = 3;

/// Returns the candidates close to the misspelt `word`, nearest first, ties in the order of
/// `candidates`. A candidate is close if its edit distance (insertion, deletion, replacement,
/// transposition of neighbours) is at most a third of the word's letters, or two. An exact match is
/// excluded.
///
/// ```
/// use twinrig_kernel::near_misses;
/// assert_eq!(near_misses("frequncy", ["period", "frequency"]), ["frequency"]);
/// ```
pub fn near_misses<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let letters = word.chars().count();
    let distance_max = (letters / 3).max(2);
    let mut found: Vec<(usize, &str)> = candidates
        .into_iter()
        .map(|candidate| (strsim::osa_distance(word, candidate), candidate))
        .filter(|&(distance, candidate)| {
            (1..=distance_max).contains(&distance)
                && distance < candidate.chars().count().max(letters)
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
    }

    #[test]
    fn transposition_is_one_edit() {
        // Two letters permit two edits, but not of all letters: a transposition is one edit.
        assert_eq!(near_misses("ab", ["ba"]), ["ba"]);
    }
}
