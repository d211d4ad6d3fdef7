//! Classes of default attributes.

use std::collections::BTreeMap;

use roxmltree::Node;

use crate::xml::{child, children};

/// Name of the class of elements without one.
pub(super) const MAIN: &str = "main";

/// Attributes that elements have unless they say otherwise.
pub(super) struct Defaults<'n, 't> {
    /// Elements `<default>` with the names of the classes from which they inherit.
    classes: BTreeMap<&'n str, (Node<'n, 't>, Option<&'n str>)>,
}

impl<'n, 't: 'n> Defaults<'n, 't> {
    pub(super) fn new(root: Node<'n, 't>) -> Self {
        let mut classes = BTreeMap::new();
        let mut open: Vec<(Node, Option<&str>)> =
            children(root, "default").map(|node| (node, None)).collect();
        while let Some((node, parent)) = open.pop() {
            let name = node.attribute("class").unwrap_or(MAIN);
            // Of two classes with one name, which MuJoCo refuses, the first read; so the chain of
            // parents ends.
            if classes.contains_key(name) {
                continue;
            }
            classes.insert(name, (node, parent));
            open.extend(children(node, "default").map(|inner| (inner, Some(name))));
        }
        Self { classes }
    }

    /// Returns the element that has the attribute `name` of `node`, whose class is its own or
    /// else `class`: itself, or the nearest default.
    pub(super) fn holder(
        &self,
        node: Node<'n, 't>,
        class: &str,
        name: &str,
    ) -> Option<Node<'n, 't>> {
        if node.has_attribute(name) {
            return Some(node);
        }
        let mut class = Some(node.attribute("class").unwrap_or(class));
        while let Some((defaults, parent)) = class.and_then(|class| self.classes.get(class)) {
            let element = child(*defaults, node.tag_name().name());
            if let Some(element) = element.filter(|element| element.has_attribute(name)) {
                return Some(element);
            }
            class = *parent;
        }
        None
    }
}
