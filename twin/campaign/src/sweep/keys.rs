//! Declarations of the keys of a specification.

/// Declaration of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpecKey {
    /// Table: `top level`, `[[dimension]]` or `[[share]]`.
    pub table: &'static str,
    /// The key.
    pub name: &'static str,
    /// Its values, with the default in brackets.
    pub value: &'static str,
    /// One-line description.
    pub about: &'static str,
    /// Line of TOML.
    pub example: &'static str,
}

/// Declares keys: a constant with the name of each, and `$list` of all of them, by table.
macro_rules! spec_keys {
    (
        $(#[$about_list:meta])* $list:ident:
        $($constant:ident = $table:literal, $name:literal, $value:literal, $about:literal, $example:literal;)*
    ) => {
        $(pub(super) const $constant: &str = $name;)*
        $(#[$about_list])*
        pub const $list: &[$crate::sweep::SpecKey] = &[$($crate::sweep::SpecKey {
            table: $table,
            name: $name,
            value: $value,
            about: $about,
            example: $example,
        }),*];
    };
}

pub(crate) use spec_keys;

spec_keys! {
    /// All keys of a specification, by table.
    SPEC_KEYS:
    NAME = "top level", "name", "text (the file's name)", "name in reports", "name = \"step down\"";
    DESIGN = "top level", "design", "`grid`, `latin-hypercube`, `random` or `morris` (`grid`)",
        "rule that chooses the points", "design = \"random\"";
    POINTS = "top level", "points", "whole number; required with `latin-hypercube` and `random`",
        "number of points", "points = 100";
    TRAJECTORIES = "top level", "trajectories", "whole number; required with `morris`",
        "number of trajectories, each of a point more than there are dimensions",
        "trajectories = 20";
    LEVELS = "top level", "levels", "even number (4); with `morris`",
        "number of values of each dimension", "levels = 6";
    MEASURES = "top level", "measures", "list of texts (all); with `morris`",
        "names of the expectations whose measured values have effects",
        "measures = [\"forward speed\"]";
    ASSUMED = "top level", "assumed", "list of texts (none); not with `grid`",
        "keys and tables of the robot file whose assumed values are dimensions, by their intervals",
        "assumed = [\"leg\", \"actuator.hip.lag\"]";
    SEED = "top level", "seed", "whole number (1); not with `grid`", "seed of the draws",
        "seed = 2";
    SET = "top level", "set", "table (none)", "keys of the scenario that are the same in all runs",
        "set = { duration = \"7 s\" }";
    DIMENSION = "top level", "dimension", "tables; *required* without `assumed`", "settings that are varied",
        "dimension = [{ key = \"seed\", from = 1, to = 20 }]";
    SHARE = "top level", "share", "tables (none)", "assertions about shares of the runs",
        "share = [{ of = \"verdict\", min = \"80 %\" }]";
    KEY = "[[dimension]]", "key", "text; *required*",
        "dotted key of the scenario, or name of a process variable", "key = \"plant.ground.at\"";
    ALSO = "[[dimension]]", "also", "list of texts (none)",
        "further keys, which have the same value as the key in every run",
        "also = [\"obstacle_distance\"]";
    VALUES = "[[dimension]]", "values", "list, or `from` and `to`", "the values",
        "values = [\"trot\", \"walk\"]";
    FROM = "[[dimension]]", "from", "quantity or number", "lower end", "from = \"2.5 m\"";
    TO = "[[dimension]]", "to", "quantity or number above `from`", "upper end", "to = \"2.76 m\"";
    COUNT = "[[dimension]]", "count", "whole number above 1; with `grid`",
        "number of values, at equal distances with both ends", "count = 10";
    SCALE = "[[dimension]]", "scale", "`linear` or `logarithmic` (`linear`)",
        "whether differences or ratios count", "scale = \"logarithmic\"";
    WHOLE = "[[dimension]]", "whole", "true or false (true for `seed`, otherwise false)",
        "only whole numbers, in a grid all of them", "whole = true";
    OF = "[[share]]", "of", "text; *required*",
        "name of an expectation, or `verdict` for all of a run together",
        "of = \"does not fall\"";
    MIN = "[[share]]", "min", "share, 0 or more and below 1", "least share", "min = \"80 %\"";
    MAX = "[[share]]", "max", "share, above 0, up to 1", "greatest share", "max = 0.05";
    CONFIDENCE = "[[share]]", "confidence", "share above 0 and below 1 (`\"95 %\"`)",
        "confidence of the interval", "confidence = \"99 %\"";
}

/// Returns the keys as a table of documentation, in Markdown.
pub fn key_table() -> String {
    rows_of_keys(SPEC_KEYS)
}

pub(crate) fn rows_of_keys(keys: &[SpecKey]) -> String {
    let mut lines = vec![
        "| table | key | value | meaning | example |".to_owned(),
        "|---|---|---|---|---|".to_owned(),
    ];
    lines.extend(keys.iter().map(|key| {
        let SpecKey {
            table,
            name,
            value,
            about,
            example,
        } = key;
        format!("| {table} | `{name}` | {value} | {about} | `{example}` |")
    }));
    lines.join("\n")
}
