//! HTML text and elements.

/// Returns `text` with HTML special characters escaped.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // HTML does not allow control characters.
            letter if letter.is_control() => out.push(' '),
            letter => out.push(letter),
        }
    }
    out
}

/// Returns an element with a class and HTML content.
pub fn element(name: &str, class: &str, content: &str) -> String {
    format!("<{name}{}>{content}</{name}>", class_attribute(class))
}

/// Returns the attribute of a class, after a space; nothing without one.
pub(crate) fn class_attribute(class: &str) -> String {
    match class {
        "" => String::new(),
        class => format!(" class=\"{class}\""),
    }
}

/// Returns a paragraph of plain text.
pub fn paragraph(text: &str) -> String {
    element("p", "", &escaped(text)) + "\n"
}

/// Returns a unit as it stands behind the label of an axis: none for ratios.
pub fn in_unit(symbol: &str) -> String {
    match symbol {
        "" | "1" => String::new(),
        symbol => format!("  [{symbol}]"),
    }
}
