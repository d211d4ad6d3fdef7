//! XML with the place of every element and number.

use std::sync::Arc;

use roxmltree::{Attribute, Document, Node, ParsingOptions};
use twinrig_document::{Place, Problem, Source};

/// Maximum number of elements, texts and comments of a description.
const NODES_MAX: u32 = 1_000_000;

/// Maximum magnitude of a number; no quantity of a quadruped is larger, and products of a few
/// remain finite.
const NUMBER_MAX: f64 = 1e9;

/// Text of a description, from which problems take their place.
#[derive(Clone, Copy)]
pub(crate) struct Text<'t> {
    source: &'t Arc<Source>,
}

impl<'t> Text<'t> {
    pub(crate) fn new(source: &'t Arc<Source>) -> Self {
        Self { source }
    }

    /// Parses the text, whose root element must be `root`.
    pub(crate) fn parse(self, root: &str) -> Result<Document<'t>, Problem> {
        let options = ParsingOptions {
            nodes_limit: NODES_MAX,
            ..ParsingOptions::default()
        };
        let parsed = Document::parse_with_options(&self.source.text, options);
        let document = parsed.map_err(|error| self.syntax(&error))?;
        let found = document.root_element().tag_name().name();
        if found == root {
            return Ok(document);
        }
        let help = match (found, root) {
            ("mujoco", _) => "this is MJCF: twin import mjcf FILE",
            ("robot", _) => "this is URDF: twin import urdf FILE",
            ("sdf", _) => "this is SDF; it is not read. Export the robot as URDF or MJCF",
            (_, "robot") => "the root element of URDF is <robot>",
            _ => "the root element of MJCF is <mujoco>",
        };
        let message = format!("the root element is <{found}>");
        Err(self.problem(document.root_element(), message, help))
    }

    fn syntax(self, error: &roxmltree::Error) -> Problem {
        let text = &self.source.text;
        let position = error.pos();
        let mut starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1));
        let line = (position.row as usize).saturating_sub(1);
        let start = starts.nth(line).unwrap_or(text.len());
        let column = (position.col as usize).saturating_sub(1);
        let letters = text[start..].char_indices();
        let at = letters.map(|(at, _)| at).nth(column).unwrap_or_default() + start;
        let place = Place::new(Arc::clone(self.source), at..at + 1);
        // The place is beside the message.
        let message = error.to_string();
        let message = message.split(" at ").next().unwrap_or(&message);
        Problem::at(
            &place,
            format!("this is not XML: {message}"),
            "the file must be well-formed, without a document type definition (DTD)",
        )
    }

    /// Returns the place of the start tag of an element.
    pub(crate) fn place(self, node: Node<'_, '_>) -> Place {
        let span = node.range();
        let tag = self.source.text.get(span.clone()).unwrap_or_default();
        let length = tag.find('>').map_or(tag.len(), |end| end + 1);
        Place::new(Arc::clone(self.source), span.start..span.start + length)
    }

    pub(crate) fn problem(
        self,
        node: Node<'_, '_>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Problem {
        Problem::at(&self.place(node), message, help)
    }

    /// Returns a problem at the value of an attribute.
    pub(crate) fn wrong(
        self,
        attribute: Attribute<'_, '_>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Problem {
        let place = Place::new(Arc::clone(self.source), attribute.range_value());
        Problem::at(&place, message, help)
    }

    /// Returns the attribute `name`, which must be there.
    pub(crate) fn required<'n>(self, node: Node<'n, 't>, name: &str) -> Result<&'n str, Problem>
    where
        't: 'n,
    {
        node.attribute(name).ok_or_else(|| {
            let message = format!("<{}> has no `{name}`", node.tag_name().name());
            self.problem(node, message, "")
        })
    }

    /// Returns all numbers of the attribute `name`, none without it.
    pub(crate) fn list(self, node: Node<'_, '_>, name: &str) -> Result<Option<Vec<f64>>, Problem> {
        let Some(attribute) = node.attribute_node(name) else {
            return Ok(None);
        };
        let words = attribute.value().split_ascii_whitespace();
        let numbers = words.map(|word| match word.parse::<f64>() {
            Ok(number) if number.abs() <= NUMBER_MAX => Ok(number),
            Ok(_) => {
                let message = format!("`{word}` is not within ±1e9");
                Err(self.wrong(attribute, message, "all values are in SI units"))
            }
            Err(_) => {
                let help = if word.contains("${") || word.contains('$') {
                    "this is xacro: expand it first, by `xacro FILE > robot.urdf`"
                } else {
                    "numbers are separated by spaces and have a decimal point"
                };
                Err(self.wrong(attribute, format!("`{word}` is not a number"), help))
            }
        });
        numbers.collect::<Result<_, _>>().map(Some)
    }

    /// Returns the `N` numbers of the attribute `name`, none without it.
    pub(crate) fn numbers<const N: usize>(
        self,
        node: Node<'_, '_>,
        name: &str,
    ) -> Result<Option<[f64; N]>, Problem> {
        let Some(numbers) = self.list(node, name)? else {
            return Ok(None);
        };
        let count = numbers.len();
        numbers.try_into().map(Some).map_err(|_| {
            let message = format!("`{name}` has {count} numbers, {N} are required");
            match node.attribute_node(name) {
                Some(attribute) => self.wrong(attribute, message, ""),
                None => self.problem(node, message, ""),
            }
        })
    }

    pub(crate) fn number(self, node: Node<'_, '_>, name: &str) -> Result<Option<f64>, Problem> {
        Ok(self.numbers::<1>(node, name)?.map(|[number]| number))
    }
}

/// Returns the first child element with that name.
pub(crate) fn child<'n, 't>(node: Node<'n, 't>, name: &str) -> Option<Node<'n, 't>> {
    node.children().find(|child| child.has_tag_name(name))
}

/// Returns all child elements with that name.
pub(crate) fn children<'n, 't: 'n>(
    node: Node<'n, 't>,
    name: &'static str,
) -> impl Iterator<Item = Node<'n, 't>> {
    node.children()
        .filter(move |child| child.has_tag_name(name))
}
