//! Names of kinds, and distinct names of the elements of a list.

use std::collections::BTreeSet;

use twinrig_document::{Item, Reported};

use crate::catalogue::Kind;
use crate::language::Part;

/// Returns the kind that `item` names, if the build has it.
pub(super) fn kind<'k>(
    item: &Item<'_>,
    part: Part,
    kinds: &'k [Kind],
) -> Result<&'k Kind, Reported> {
    let (label, plural) = part.nouns();
    let name = item.text()?;
    let Some(kind) = kinds.iter().find(|kind| kind.name == name) else {
        let names = kinds.iter().map(|kind| kind.name.as_str());
        return Err(item.report_word(format!("there is no {label} `{name}`"), name, plural, names));
    };
    if let Some(remedy) = &kind.remedy {
        let message = format!("this build has no {label} `{name}`");
        return Err(item.report(message, remedy));
    }
    Ok(kind)
}

/// Reports the first element of a list that has the name of one before.
pub(super) fn distinct_names<T>(
    items: &[Item<'_>],
    read: &[T],
    name: impl Fn(&T) -> &str,
    elements: &str,
) -> Result<(), Reported> {
    let mut names = BTreeSet::new();
    for (item, one) in items.iter().zip(read) {
        if !names.insert(name(one)) {
            let message = format!("two {elements} have the name `{}`", name(one));
            return Err(item.report(message, "give each of them a distinct `name`"));
        }
    }
    Ok(())
}
