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
    if class.is_empty() {
        format!("<{name}>{content}</{name}>")
    } else {
        format!("<{name} class=\"{class}\">{content}</{name}>")
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
