//! Constructors of option declarations.

use twinrig_document::Range;
use twinrig_kernel::Unit;
use twinrig_scenario::{Accepts, OptionSpec, OptionValue};

/// Returns an option without a default.
pub fn option(name: &str, about: &str, accepts: Accepts) -> OptionSpec {
    OptionSpec {
        name: name.to_owned(),
        about: about.to_owned(),
        accepts,
        default: None,
    }
}

/// Returns an option that is one of `words`, by default the first.
pub fn choice<W: AsRef<str>>(name: &str, about: &str, words: &[W]) -> OptionSpec {
    let words: Vec<String> = words.iter().map(|word| word.as_ref().to_owned()).collect();
    OptionSpec {
        default: words.first().cloned().map(OptionValue::Text),
        ..option(name, about, Accepts::Choice(words))
    }
}

/// Returns the type of a dimensionless number, which may be given in per cent.
pub fn number(range: Range) -> Accepts {
    Accepts::Quantity {
        unit: Unit::One,
        range,
    }
}
