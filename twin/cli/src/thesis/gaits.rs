//! Gaits that several searches found, from the record of their best points.

use std::path::Path;

use twinrig_scenario::Setting;

use crate::thesis::error::ThesisError;

/// Columns of a history before those of the settings.
const SUMMARY: usize = 6;

/// Reads the settings of each gait of `path`: a table of the form of a search's history, with a
/// gait in each line.
///
/// # Errors
/// [`ThesisError::Gaits`] for a file that cannot be read.
pub(crate) fn read(path: &Path) -> Result<Vec<Vec<Setting>>, ThesisError> {
    let text = std::fs::read_to_string(path).map_err(|source| ThesisError::Gaits {
        path: path.to_owned(),
        source,
    })?;
    Ok(settings(&text))
}

fn settings(text: &str) -> Vec<Vec<Setting>> {
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let gait = |line: &str| {
        let cells = header.iter().zip(line.split(',')).skip(SUMMARY);
        cells
            .map(|(column, value)| setting(column, value))
            .collect()
    };
    lines.map(gait).collect()
}

/// Returns the setting of a column with key and unit, `controller.frequency [Hz]`.
fn setting(column: &str, value: &str) -> Setting {
    let (key, unit) = column.split_once(' ').unwrap_or((column, ""));
    let unit = unit.trim_matches(['[', ']']);
    Setting {
        origin: "thesis".to_owned(),
        key: key.to_owned(),
        value: format!("{value} {unit}").trim_end().to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_gaits_with_the_units_of_their_columns() {
        let text = "seed,evaluations,best [m/s],median [m/s],feasible,cost,\
                    controller.frequency [Hz],controller.duty_factor.fore\n\
                    1,24,1.1,1.0,0.5,-0.5,3.5,0.1\n2,24,1.2,1.0,0.5,-0.5,3.6,0.2\n";
        let found: Vec<Vec<(String, String)>> = settings(text)
            .into_iter()
            .map(|gait| gait.into_iter().map(|it| (it.key, it.value)).collect())
            .collect();
        let gait = |frequency: &str, duty: &str| {
            vec![
                ("controller.frequency".to_owned(), frequency.to_owned()),
                ("controller.duty_factor.fore".to_owned(), duty.to_owned()),
            ]
        };
        assert_eq!(found, [gait("3.5 Hz", "0.1"), gait("3.6 Hz", "0.2")]);
    }
}
