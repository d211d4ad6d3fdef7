//! Values of lists.

use twinrig_kernel::Unit;

use super::Item;
use crate::node::Value;
use crate::problems::Reported;
use crate::quantity;
use crate::range::Range;
use crate::toml_text::quoted;

impl<'d> Item<'d> {
    /// Returns the items of a list.
    ///
    /// # Errors
    /// The value has another type.
    pub fn list(&self) -> Result<Vec<Item<'d>>, Reported> {
        let Value::List(nodes) = &self.node.value else {
            return Err(self.no_list());
        };
        let item = |node| Item::new(node, self.path.clone(), self.problems);
        Ok(nodes.iter().map(item).collect())
    }

    /// Reads a list item by item with `read`; every item is read, even after a problem.
    ///
    /// # Errors
    /// The value is not a list, or `read` reported a problem.
    pub fn each<T>(
        &self,
        read: impl FnMut(&Item<'d>) -> Result<T, Reported>,
    ) -> Result<Vec<T>, Reported> {
        let read: Vec<_> = self.list()?.iter().map(read).collect();
        read.into_iter().collect()
    }

    /// Returns a list of strings.
    ///
    /// # Errors
    /// The value has another type.
    pub fn texts(&self) -> Result<Vec<&'d str>, Reported> {
        self.each(Item::text)
    }

    /// Returns the quantities of a list of `N`, as [`Item::quantity`] does; `help` says what they
    /// are.
    ///
    /// # Errors
    /// The value is no list, has another number of elements, or one of them is not accepted.
    pub fn quantities<const N: usize>(
        &self,
        unit: Unit,
        range: &Range,
        help: &str,
    ) -> Result<[f64; N], Reported> {
        if !self.is_list() && !self.is_table() {
            let element = match &self.node.value {
                Value::Text(text) if quantity::parse_quantity(text, unit).is_ok() => quoted(text),
                Value::Integer(digits) | Value::Float(digits) if unit != Unit::One => {
                    quoted(&format!("{digits} {}", unit.symbol()))
                }
                Value::Integer(digits) | Value::Float(digits) => digits.clone(),
                _ if unit == Unit::One => "0.5".to_owned(),
                _ => quoted(&format!("3 {}", unit.symbol())),
            };
            let list = vec![element; N].join(", ");
            let help = format!("{help}: write it as in {} = [{list}]", self.key());
            return Err(self.wrong_type_with_help("a list", help));
        }
        let values = self.each(|item| item.quantity(unit, range))?;
        let count = values.len();
        values.try_into().map_err(|_| {
            let message = format!("`{}` has {count} values, not {N}", self.key());
            self.report(message, help)
        })
    }

    /// Reports that the value is no list.
    fn no_list(&self) -> Reported {
        let key = self.key();
        if let Value::Text(text) = &self.node.value {
            let words: Vec<String> = elements(text).iter().map(|it| quoted(it)).collect();
            let help = format!("write it as in {key} = [{}]", words.join(", "));
            return self.wrong_type_with_help("a list", help);
        }
        let Value::Table(entries) = &self.node.value else {
            return self.wrong_type("a list");
        };
        let mut keys = entries.iter().map(|entry| entry.key.as_str());
        if let Some(index) = keys.find(|key| key.parse::<usize>().is_ok()) {
            let message = format!("there is no list `{key}` that has an element {index}");
            let help = format!("set the list as a whole: {key}=[{{ … }}]");
            return self.report(message, help);
        }
        let help = if self.toml().starts_with('[') {
            format!("write [[{}]] in place of [{}]", self.path, self.path)
        } else {
            format!("write it as in {key} = [{{ … }}]")
        };
        self.wrong_type_with_help("a list", help)
    }
}

/// Splits a text at commas and blanks, but not between a number and its unit.
fn elements(text: &str) -> Vec<String> {
    let mut elements: Vec<String> = Vec::new();
    for part in text.trim_matches(['[', ']', ' ']).split(',') {
        let mut follows = false;
        for word in part.split_whitespace() {
            match elements.last_mut().filter(|_| follows) {
                Some(last) if quantity::any_unit(&format!("{last} {word}")).is_ok() => {
                    *last = format!("{last} {word}");
                }
                _ => elements.push(word.to_owned()),
            }
            follows = word.parse::<f64>().is_ok();
        }
    }
    elements
}
