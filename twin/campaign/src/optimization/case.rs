//! Cases of a search: settings with which every point is run.

use twinrig_document::declaration::{Key, Shape, TableSpec, Type, table};
use twinrig_document::{Item, Placed, Reported};

use crate::sweep::read::placed_settings;

table! {
    /// Keys of `[[case]]`.
    pub(super) case_table = TableSpec::new("[[case]]", "runs with settings of their own");
    NAME: Placed<String> = "name", Type::PLACED, "name in reports", r#"name = "lcp""#, required();
    SET: Vec<(Placed<String>, String)> = "set",
        Type::new(Shape::Settings, |item, _| placed_settings(item)),
        "keys of the scenario in the runs of this case", r#"set = { plant.model = "lcp" }"#,
        otherwise("none");
}

/// Greatest number of cases.
const CASES_MOST: usize = 100;

/// A case: every point of the search is run in it.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchCase {
    /// Name.
    pub name: Placed<String>,
    /// Settings of its runs: keys and values in TOML.
    pub set: Vec<(Placed<String>, String)>,
}

/// Reads the cases, whose names are unique.
pub(super) fn cases(item: &Item<'_>) -> Result<Vec<SearchCase>, Reported> {
    let cases = item.each(case)?;
    if cases.len() > CASES_MOST {
        let message = format!("there are more than {CASES_MOST} cases");
        return Err(item.report(message, "leave some of them out"));
    }
    for (index, case) in cases.iter().enumerate() {
        let Placed { value, place } = &case.name;
        if cases[..index]
            .iter()
            .any(|other| other.name.value == *value)
        {
            let message = format!("there are two cases `{value}`");
            return Err(item.report_at(place, message, "rename one of them"));
        }
    }
    Ok(cases)
}

fn case(item: &Item<'_>) -> Result<SearchCase, Reported> {
    let table = &item.table()?;
    let keys = case_table::TABLE.of(table);
    let (name, set) = (keys.read(&case_table::NAME), keys.get(&case_table::SET));
    Ok(SearchCase {
        name: name?,
        set: set?.unwrap_or_default(),
    })
}
