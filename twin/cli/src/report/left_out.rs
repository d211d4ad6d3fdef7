//! Text form of the parts that are left out of a scene.

use twinrig_scenario::LeftOut;

/// Common beginnings of the names of a group of parts.
const GROUPS: [&str; 2] = ["recording of ", "expectation that "];

/// Returns the names and the reason of each line, at the place of the first part: parts of one
/// group that are left out for the same reason share a line, as do the reasons of one name.
pub(crate) fn lines(left_out: &[LeftOut]) -> Vec<[String; 2]> {
    let mut lines: Vec<(&str, Vec<&str>, Vec<&str>)> = Vec::new();
    for LeftOut { part, why } in left_out {
        let group = GROUPS.into_iter().find(|group| part.starts_with(group));
        let group = group.unwrap_or_default();
        let (name, why) = (&part[group.len()..], why.as_str());
        let same = lines.iter_mut().find(|(known, names, reasons)| {
            *known == group && (*reasons == [why] || *names == [name])
        });
        match same {
            Some((_, names, reasons)) => {
                names.extend((!names.contains(&name)).then_some(name));
                reasons.extend((!reasons.contains(&why)).then_some(why));
            }
            None => lines.push((group, vec![name], vec![why])),
        }
    }
    let text = |(group, names, reasons): (&str, Vec<&str>, Vec<&str>)| {
        [group.to_owned() + &names.join(", "), reasons.join("; ")]
    };
    lines.into_iter().map(text).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(parts: &[(&str, &str)]) -> Vec<[String; 2]> {
        let left_out = parts.iter().map(|&(part, why)| LeftOut {
            part: part.to_owned(),
            why: why.to_owned(),
        });
        lines(&left_out.collect::<Vec<_>>())
    }

    fn text(lines: &[[&str; 2]]) -> Vec<[String; 2]> {
        let owned = lines.iter().map(|line| line.map(str::to_owned));
        owned.collect()
    }

    #[test]
    fn parts_of_one_group_and_reason_share_a_line() {
        let found = of(&[
            ("servos", "not simulated"),
            ("recording of a", "not named"),
            ("x", "not needed"),
            ("recording of b", "not named"),
            ("leg/*/y", "not needed"),
            ("expectation that it walks", "of lcp"),
        ]);
        let expected = text(&[
            ["servos", "not simulated"],
            ["recording of a, b", "not named"],
            ["x, leg/*/y", "not needed"],
            ["expectation that it walks", "of lcp"],
        ]);
        assert_eq!(found, expected);
    }

    #[test]
    fn reasons_of_one_name_share_a_line() {
        let found = of(&[("x", "of lcp"), ("x", "of mujoco"), ("x", "of lcp")]);
        assert_eq!(found, text(&[["x", "of lcp; of mujoco"]]));
    }

    #[test]
    fn other_groups_and_reasons_have_separate_lines() {
        let found = of(&[
            ("recording of a", "not named"),
            ("a", "not named"),
            ("recording of b", "rate is 0 Hz"),
            ("expectation that recording of a", "not named"),
        ]);
        let expected = text(&[
            ["recording of a", "not named"],
            ["a", "not named"],
            ["recording of b", "rate is 0 Hz"],
            ["expectation that recording of a", "not named"],
        ]);
        assert_eq!(found, expected);
    }
}
