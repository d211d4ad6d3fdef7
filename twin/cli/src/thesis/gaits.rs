//! Gaits that several searches of one space found.

use std::path::Path;

use twinrig_campaign::optimization::SearchSpace;
use twinrig_document::Document;
use twinrig_scenario::Setting;

use crate::error::ThesisError;
use crate::error::TwinError;

/// Columns of a history before those of the settings.
const SUMMARY: usize = 6;
/// Keys of the settings of a space that belong to its gaits; the others are about the search.
const CONTROLLER: &str = "controller.";

/// Reads the settings of each gait of a search space: those of its controller, and those of each
/// line of the table of the same name, which has the form of a search's history.
///
/// # Errors
/// Errors of the space, and [`ThesisError::Gaits`] for a table without gaits or that cannot be
/// read.
pub(crate) fn read(space: &Path) -> Result<Vec<Vec<Setting>>, TwinError> {
    let of_space = SearchSpace::read(&Document::read(space)?)?;
    let path = space.with_extension("csv");
    let refused = |why: String| ThesisError::Gaits {
        path: path.clone(),
        why,
    };
    let text = std::fs::read_to_string(&path).map_err(|error| refused(error.to_string()))?;
    let gaits = settings(&text).map_err(refused)?;
    let own = of_space.set.iter();
    let own = own.filter(|(key, _)| key.starts_with(CONTROLLER));
    let own: Vec<Setting> = own.map(|(key, value)| setting(key, value)).collect();
    let with_own = |gait: Vec<Setting>| own.iter().cloned().chain(gait).collect();
    Ok(gaits.into_iter().map(with_own).collect())
}

/// Returns the settings in each line of a table, or the reason for which it has none.
fn settings(text: &str) -> Result<Vec<Vec<Setting>>, String> {
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    if header.len() <= SUMMARY {
        return Err(format!("it has no column after the first {SUMMARY}"));
    }
    let gait = |(index, line): (usize, &str)| {
        let cells: Vec<&str> = line.split(',').collect();
        if cells.len() != header.len() {
            let (line, found) = (index + 2, cells.len());
            let wanted = header.len();
            return Err(format!("line {line} has {found} columns, not {wanted}"));
        }
        let cells = header.iter().zip(cells).skip(SUMMARY);
        Ok(cells
            .map(|(column, value)| of_cell(column, value))
            .collect())
    };
    let gaits: Vec<Vec<Setting>> = lines.enumerate().map(gait).collect::<Result<_, _>>()?;
    if gaits.is_empty() {
        return Err("it has no gait".to_owned());
    }
    Ok(gaits)
}

/// Returns the setting of a column with key and unit, `controller.frequency [Hz]`.
fn of_cell(column: &str, value: &str) -> Setting {
    let (key, unit) = column.split_once(' ').unwrap_or((column, ""));
    let unit = unit.trim_matches(['[', ']']);
    setting(key, format!("{value} {unit}").trim_end())
}

fn setting(key: &str, value: &str) -> Setting {
    Setting {
        origin: "thesis".to_owned(),
        key: key.to_owned(),
        value: value.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "seed,evaluations,best [m/s],median [m/s],feasible,cost,\
                          controller.frequency [Hz],controller.duty_factor.fore";

    fn pairs(gaits: &[Vec<Setting>]) -> Vec<Vec<(&str, &str)>> {
        let gaits = gaits.iter();
        gaits
            .map(|gait| gait.iter().map(|it| (&*it.key, &*it.value)).collect())
            .collect()
    }

    #[test]
    fn lines_are_gaits_with_the_units_of_their_columns() {
        let text =
            format!("{HEADER}\n1,24,1.1,1.0,0.5,-0.5,3.5,0.1\n2,24,1.2,1.0,0.5,-0.5,3.6,0.2\n");
        let found = settings(&text).unwrap();
        let gait = |frequency, duty| {
            vec![
                ("controller.frequency", frequency),
                ("controller.duty_factor.fore", duty),
            ]
        };
        assert_eq!(
            pairs(&found),
            [gait("3.5 Hz", "0.1"), gait("3.6 Hz", "0.2")]
        );
    }

    #[test]
    fn tables_without_gaits_and_with_truncated_lines_are_refused() {
        for (text, why) in [
            (String::new(), "no column after the first 6"),
            ("seed,evaluations\n1,24\n".to_owned(), "no column"),
            (format!("{HEADER}\n"), "no gait"),
            (
                format!("{HEADER}\n1,24,1.1,1.0,0.5,-0.5,3.5\n"),
                "line 2 has 7 columns, not 8",
            ),
            (
                format!("{HEADER}\n1,24,1.1,1.0,0.5,-0.5,3.5,0.1\n\n"),
                "line 3 has 1 columns",
            ),
        ] {
            let refused = settings(&text).unwrap_err();
            assert!(refused.contains(why), "{text:?}: {refused}");
        }
    }

    #[test]
    fn gaits_of_both_loops_have_the_curves_and_the_step_length_of_the_thesis() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/optimizations");
        for name in ["fig-3-5", "fig-3-8"] {
            let gaits = read(&folder.join(format!("{name}.toml"))).unwrap();
            assert_eq!(gaits.len(), 5, "{name}");
            for gait in pairs(&gaits) {
                assert!(gait.iter().any(|(key, value)| {
                    *key == "controller.locus" && value.trim_matches('"') == "thesis"
                }));
                let length = gait
                    .iter()
                    .find(|(key, _)| *key == "controller.step_length");
                assert!(length.is_some_and(|(_, value)| value.trim_matches('"') == "126 mm"));
            }
        }
    }
}
