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
    let word: Vec<char> = word.chars().collect();
    let distance_max = (word.len() / 3).max(2);
    let mut found: Vec<(usize, &str)> = candidates
        .into_iter()
        .map(|candidate| {
            (
                edit_distance(&word, &candidate.chars().collect::<Vec<_>>()),
                candidate,
            )
        })
        .filter(|&(distance, candidate)| {
            (1..=distance_max).contains(&distance)
                && distance < candidate.chars().count().max(word.len())
        })
        .collect();
    found.sort_by_key(|&(distance, _)| distance);
    found.dedup();
    found.truncate(SUGGESTIONS_MAX);
    found.into_iter().map(|(_, candidate)| candidate).collect()
}

/// Edit distance with transpositions (optimal string alignment).
fn edit_distance(a: &[char], b: &[char]) -> usize {
    let mut before_last = vec![0; b.len() + 1];
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let replace = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = replace.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before_last[j - 2] + 1);
            }
        }
        before_last = std::mem::replace(&mut last, row);
    }
    last[b.len()]
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
        let chars = |s: &str| s.chars().collect::<Vec<_>>();
        assert_eq!(edit_distance(&chars("tort"), &chars("trot")), 1);
        assert_eq!(edit_distance(&chars(""), &chars("trot")), 4);
        assert_eq!(edit_distance(&chars("kitten"), &chars("sitting")), 3);
    }
}
