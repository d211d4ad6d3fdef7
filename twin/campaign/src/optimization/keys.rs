//! Declarations of the keys of a search space.

use crate::sweep::{rows_of_keys, spec_keys};

spec_keys! {
    /// All keys of a search space, by table.
    SPACE_KEYS:
    NAME = "top level", "name", "text (the file's name)", "name in reports", "name = \"trot\"";
    MAXIMIZE = "top level", "maximize", "text; this or `minimize`",
        "expectation whose measured value is to be great", "maximize = \"forward speed\"";
    MINIMIZE = "top level", "minimize", "text; this or `maximize`",
        "expectation whose measured value is to be small", "minimize = \"roll, peak to peak\"";
    CONSTRAINTS = "top level", "constraints", "list of names, or `all` others (none)",
        "expectations that have to hold", "constraints = [\"goes straight\"]";
    METHOD = "top level", "method", "`cma-es` or `pso` (`cma-es`)",
        "CMA-ES, or a particle swarm", "method = \"pso\"";
    PARTICLES = "top level", "particles",
        "whole number (`pso`: 40; `cma-es`: 4 + 3 ln n for n dimensions)",
        "points of a generation", "particles = 120";
    ITERATIONS = "top level", "iterations", "whole number (100)",
        "generations after the first one", "iterations = 400";
    RESTARTS = "top level", "restarts", "whole number (0); with `cma-es`",
        "restarts after convergence, each with twice the particles", "restarts = 4";
    SEED = "top level", "seed", "whole number (1)", "seed of the search", "seed = 2";
    SET = "top level", "set", "table (none)", "keys of the scenario that are the same in all runs",
        "set = { duration = \"10 s\" }";
    DIMENSION = "top level", "dimension", "tables; *required*", "settings that are searched",
        "dimension = [{ key = \"frequency\", from = \"2 Hz\", to = \"5 Hz\" }]";
    CASE = "top level", "case", "tables (none)",
        "runs of every point, of which the worst one counts",
        "case = [{ name = \"lcp\", set = { plant.model = \"lcp\" } }]";
    KEY = "[[dimension]]", "key", "text; *required*",
        "dotted key of the scenario, or name of a process variable", "key = \"hip_height/fore\"";
    FROM = "[[dimension]]", "from", "quantity or number; *required*", "lower bound",
        "from = \"11 cm\"";
    TO = "[[dimension]]", "to", "quantity or number above `from`; *required*", "upper bound",
        "to = \"14 cm\"";
    SCALE = "[[dimension]]", "scale", "`linear` or `logarithmic` (`linear`)",
        "whether differences or ratios count", "scale = \"logarithmic\"";
    CASE_NAME = "[[case]]", "name", "text; *required*", "name in reports", "name = \"lcp\"";
    CASE_SET = "[[case]]", "set", "table (none)", "keys of the scenario in the runs of this case",
        "set = { plant.model = \"lcp\" }";
}

/// Returns the keys as a table of documentation, in Markdown.
pub fn space_key_table() -> String {
    rows_of_keys(SPACE_KEYS)
}
