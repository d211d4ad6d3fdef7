//! Text form of the parts that are left out of a scene.

use twinrig_scenario::LeftOut;

const RECORDING: &str = "recording of ";
const EXPECTATION: &str = "expectation that ";

/// Common beginnings of the names of a group of parts.
const GROUPS: [&str; 2] = [RECORDING, EXPECTATION];

/// Returns the numbers of the expectations, recordings and other parts, and the command that gives
/// their reasons; none without parts.
pub(crate) fn summary(left_out: &[LeftOut]) -> Option<String> {
    let count = |is: &dyn Fn(&str) -> bool, [one, many]: [&str; 2]| {
        let parts = left_out.iter().filter(|it| is(&it.part)).count();
        let noun = if parts == 1 { one } else { many };
        (parts > 0).then(|| format!("{parts} {noun}"))
    };
    let is_other = |part: &str| !GROUPS.iter().any(|group| part.starts_with(group));
    let counts = [
        count(
            &|part| part.starts_with(EXPECTATION),
            ["expectation", "expectations"],
        ),
        count(
            &|part| part.starts_with(RECORDING),
            ["recording", "recordings"],
        ),
        count(&is_other, ["part", "parts"]),
    ];
    let counts: Vec<String> = counts.into_iter().flatten().collect();
    (!counts.is_empty()).then(|| format!("{}; twin plan gives the reasons", counts.join(", ")))
}

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
    fn summary_counts_expectations_recordings_and_parts() {
        let of = |names: &[&str]| {
            let left_out = names.iter().map(|&part| LeftOut {
                part: part.to_owned(),
                why: String::new(),
            });
            summary(&left_out.collect::<Vec<_>>())
        };
        assert_eq!(of(&[]), None);
        let counted = |names: &[&str]| {
            let text = of(names).unwrap();
            text.split_once(';').unwrap().0.to_owned()
        };
        assert_eq!(counted(&["bus"]), "1 part");
        let names = [
            "bus",
            "expectation that a",
            "recording of a",
            "controller",
            "recording of b",
        ];
        assert_eq!(counted(&names), "1 expectation, 2 recordings, 2 parts");
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
