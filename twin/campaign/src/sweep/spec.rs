//! Reading specifications of sweeps.

use std::path::Path;

use twinrig_document::declaration::{
    Accepts, Declared, Key, Presence, Shape, TableReference, TableSpec, Type, choice, contextual,
    table,
};
use twinrig_document::{
    AssumedValue, Document, DocumentError, Item, Placed, Problem, Reported, Table, suggestion,
};

use super::design::{Design, DesignKind};
use super::dimension::{DimensionValues, SweepDimension, ValueInterval};
use super::read::{
    self, DIMENSIONS_MOST, POINTS_MOST, SETTINGS, check_dimensions, count, dimension,
    dimension_table, overlap, refuse, refuse_scenario,
};
use super::share::{ShareSpec, share, share_table};
use super::value::SweepValue;
use spec_table::{
    ASSUMED, DESIGN, DIMENSION, LEVELS, MEASURES, NAME, POINTS, SEED, SET, SHARE, TABLE,
    TRAJECTORIES,
};

/// Designs whose points are drawn.
const DRAWN: &[&str] = &["latin-hypercube", "random", "morris"];

table! {
    /// Keys of a specification.
    pub(super) spec_table = TableSpec::new("top level", "specification of a sweep")
        .selected_by("design");
    NAME: String = "name", Type::TEXT, "name in reports", r#"name = "step down""#,
        otherwise("the file's name");
    DESIGN: DesignKind = "design", choice(), "rule that chooses the points", r#"design = "random""#,
        default("'grid'");
    POINTS: usize = "points", count(1), "number of points", "points = 100", required(),
        only_with(&["latin-hypercube", "random"]);
    TRAJECTORIES: usize = "trajectories", count(1),
        "number of trajectories, each of a point more than there are dimensions",
        "trajectories = 20", required(), only_with(&["morris"]);
    LEVELS: usize = "levels",
        Type::new(Shape::One(Accepts::Natural(2..=POINTS_MOST as u64)), read::levels),
        "number of values of each dimension, which is even",
        "levels = 6", default("4"), only_with(&["morris"]);
    MEASURES: Vec<Placed<String>> = "measures", Type::NAMES,
        "names of the expectations whose measured values have effects",
        r#"measures = ["forward speed"]"#, otherwise("all"), only_with(&["morris"]);
    ASSUMED: Vec<Placed<String>> = "assumed", Type::NAMES,
        "keys and tables of the robot file whose assumed values are dimensions, by their intervals",
        r#"assumed = ["leg", "actuator.hip.lag"]"#, otherwise("none"), only_with(DRAWN);
    SEED: u64 = "seed", Type::NATURAL, "seed of the draws", "seed = 2", default("1"),
        only_with(DRAWN);
    SET: Vec<(String, String)> = "set", SETTINGS,
        "keys of the scenario that are the same in all runs", r#"set = { duration = "7 s" }"#,
        otherwise("none");
    DIMENSION: () = read::DIMENSION, contextual(Shape::Tables(dimension_table::TABLE)),
        "settings that are varied", r#"dimension = [{ key = "seed", from = 1, to = 20 }]"#,
        otherwise("none; required without `assumed`");
    SHARE: () = "share", contextual(Shape::Tables(share_table::TABLE)),
        "assertions about shares of the runs", r#"share = [{ of = "verdict", min = "80 %" }]"#,
        otherwise("none");
}

/// Specification of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepSpec {
    /// Name in reports.
    pub name: String,
    /// Name of the file in messages.
    pub file: String,
    /// Text of the file.
    pub text: String,
    /// Design.
    pub design: Design,
    /// Settings of all runs: keys and values in TOML.
    pub set: Vec<(String, String)>,
    /// Dimensions; at least one, once those of `assumed` are added.
    pub dimensions: Vec<SweepDimension>,
    /// Keys and tables of the robot file whose assumed values are dimensions, too; see
    /// [`SweepSpec::add_assumed`].
    pub assumed: Vec<Placed<String>>,
    /// Expectations with elementary effects; none for all.
    pub measures: Vec<Placed<String>>,
    /// Number of trajectories of the design; 0 if it has none.
    trajectories: usize,
    /// Asserted shares.
    pub shares: Vec<ShareSpec>,
}

impl SweepSpec {
    /// Returns the tables of a specification with their keys, beginning with the top level.
    pub fn tables() -> Vec<TableReference> {
        TableReference::of(TABLE)
    }

    /// Reads a specification from a document.
    ///
    /// # Errors
    /// All problems, each with its position.
    pub fn read(document: &Document) -> Result<Self, DocumentError> {
        refuse_scenario(document, "the specification of a sweep")?;
        document.check(|table| spec(document, table))
    }

    /// Returns the number of points of a trajectory; none for a design without.
    pub fn trajectory_points(&self) -> Option<usize> {
        self.design.levels.map(|_| self.dimensions.len() + 1)
    }

    fn count_trajectories(&mut self) {
        if let Some(length) = self.trajectory_points() {
            self.design.points = self.trajectories.saturating_mul(length);
        }
    }

    /// Adds a dimension for each of the robot's assumed values `known` that `assumed` names, or a
    /// table of which it names, by the intervals of the robot file. A value that a dimension sets
    /// already is left to it.
    ///
    /// # Errors
    /// Names that no assumed value has, and too many dimensions or points.
    pub fn add_assumed(&mut self, known: &[AssumedValue]) -> Result<(), DocumentError> {
        let mut problems = Vec::new();
        for name in &self.assumed {
            let named = known.iter();
            let named: Vec<_> = named
                .filter(|one| is_below(&name.value, &one.key))
                .collect();
            if named.is_empty() {
                let message = format!("the robot has no assumed value `{}`", name.value);
                let keys = known.iter().map(|one| one.key.as_str());
                let help = suggestion(&name.value, "assumed values", keys);
                problems.push(Problem::at(&name.place, message, help));
            }
            for one in named {
                let key = format!("{OVERRIDE}{}", one.key);
                let is_set = |it: &SweepDimension| it.keys().any(|set| overlap(&set.value, &key));
                if self.dimensions.iter().any(is_set) {
                    continue;
                }
                self.dimensions.push(SweepDimension {
                    key: Placed {
                        value: key,
                        place: name.place.clone(),
                    },
                    also: Vec::new(),
                    values: DimensionValues::Interval(ValueInterval {
                        from: one.from,
                        to: one.to,
                        unit: one.unit,
                        count: None,
                        logarithmic: false,
                    }),
                });
            }
        }
        self.count_trajectories();
        let is_many = self.dimensions.len() > DIMENSIONS_MOST || self.design.points > POINTS_MOST;
        if let Some(last) = self.assumed.last().filter(|_| is_many) {
            let message =
                format!("there are more than {DIMENSIONS_MOST} dimensions or {POINTS_MOST} points");
            problems.push(Problem::at(
                &last.place,
                message,
                "name fewer assumed values",
            ));
        }
        if problems.is_empty() {
            Ok(())
        } else {
            Err(DocumentError { problems })
        }
    }

    /// Returns the names of the shares that cannot pass, whichever runs hold: the intervals of so
    /// few points are too wide.
    pub fn undecidable_shares(&self) -> Vec<&str> {
        let points = self.design.points;
        let shares = self.shares.iter().filter(|share| !share.can_pass(points));
        shares.map(|share| share.of.value.as_str()).collect()
    }

    /// Returns the warning about shares that cannot pass.
    pub fn warning(&self) -> Option<String> {
        let names = self.undecidable_shares();
        let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        let points = self.design.points;
        (!names.is_empty()).then(|| {
            format!(
                "the share of {} cannot pass with {points} points, whichever of them hold: take \
                 more points, a bound that is further from the expected share, or a lower \
                 confidence",
                names.join(" and of ")
            )
        })
    }

    /// Returns the keys of all dimensions, further keys included.
    pub fn keys(&self) -> impl Iterator<Item = &Placed<String>> {
        self.dimensions.iter().flat_map(SweepDimension::keys)
    }

    /// Returns the points: a value for each of the keys.
    pub fn points(&self) -> Vec<Vec<SweepValue>> {
        let counts = self.dimensions.iter().map(|it| it.keys().count());
        let counts: Vec<usize> = counts.collect();
        let of_keys = |values: Vec<SweepValue>| {
            // Of many points, spare capacity would be most of the memory.
            let mut of_keys = Vec::with_capacity(counts.iter().sum());
            for (value, &count) in values.into_iter().zip(&counts) {
                of_keys.extend(std::iter::repeat_n(value, count));
            }
            of_keys
        };
        let points = self.design.points(&self.dimensions).into_iter();
        points.map(of_keys).collect()
    }
}

/// Table of a scenario with values of the robot.
const OVERRIDE: &str = "override.";

/// Whether a dotted key is `table` or below it.
fn is_below(table: &str, key: &str) -> bool {
    let rest = key.strip_prefix(table);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// Numbers of a design. A grid has none.
#[derive(Default)]
struct Numbers {
    points: usize,
    seed: u64,
    trajectories: usize,
    levels: Option<usize>,
}

fn numbers(keys: Declared<'_, '_>, kind: DesignKind) -> Result<Numbers, Reported> {
    let (points, seed) = (keys.get(&POINTS), keys.read(&SEED));
    let (trajectories, levels) = (keys.get(&TRAJECTORIES), keys.read(&LEVELS));
    let word = kind.word();
    let of_designs = TABLE.all_keys().into_iter();
    let of_designs = of_designs.filter(|key| !key.only_with.is_empty());
    let (own, foreign): (Vec<_>, Vec<_>) =
        of_designs.partition(|key| key.only_with.contains(&word));
    let foreign: Vec<_> = foreign.iter().map(|key| key.name).collect();
    let refused = refuse(&keys, &foreign, |key| {
        let design = match kind {
            DesignKind::Grid => "a grid".to_owned(),
            _ => format!("the design `{word}`"),
        };
        let help = "leave it out, or choose another `design`";
        (format!("{design} has no `{key}`"), help.to_owned())
    });
    let (points, seed, trajectories, levels) = (points?, seed?, trajectories?, levels?);
    let required = own.iter().find(|key| key.presence == Presence::Required);
    if let Some(key) = required.filter(|_| points.or(trajectories).is_none()) {
        return Err(keys.missing(key.name));
    }
    refused?;
    Ok(Numbers {
        points: points.unwrap_or(0),
        seed,
        trajectories: trajectories.unwrap_or(0),
        levels: (kind == DesignKind::Morris).then_some(levels),
    })
}

/// Reads the dimensions; there may be none beside assumed values.
fn dimensions(keys: Declared<'_, '_>, kind: DesignKind) -> Result<Vec<SweepDimension>, Reported> {
    let read = |item: &Item<'_>| item.each(|item| dimension(item, kind == DesignKind::Grid));
    let has_assumed = keys.has(&ASSUMED);
    let dimensions = if has_assumed {
        keys.get_with(&DIMENSION, read)?.unwrap_or_default()
    } else {
        keys.read_with(&DIMENSION, read)?
    };
    if !(has_assumed && dimensions.is_empty()) {
        check_dimensions(&keys, dimensions.iter().flat_map(SweepDimension::keys))?;
    }
    let mut checked = Ok(());
    for one in &dimensions {
        if kind == DesignKind::Morris && !matches!(one.values, DimensionValues::Interval(_)) {
            let message = format!("the values of `{}` are no interval", one.key.value);
            let help = "elementary effects require `from` and `to`, and no whole numbers";
            checked = Err(keys.report_at(&one.key.place, message, help));
        }
    }
    checked.map(|()| dimensions)
}

fn spec(document: &Document, table: &Table<'_>) -> Result<SweepSpec, Reported> {
    let keys = TABLE.of(table);
    let name = keys.get(&NAME);
    // Without a valid design, keys of all designs are accepted.
    let read = keys.read(&DESIGN);
    let kind = read.unwrap_or(DesignKind::Random);
    let numbers = match read {
        Ok(kind) => numbers(keys, kind),
        Err(reported) => {
            table.expect([POINTS.name, SEED.name, TRAJECTORIES.name, LEVELS.name]);
            Err(reported)
        }
    };
    let (assumed, measures) = (keys.get(&ASSUMED), keys.get(&MEASURES));
    let set = keys.get(&SET);
    let dimensions = dimensions(keys, kind);
    let shares = keys.get_with(&SHARE, |item| item.each(share));
    let (numbers, dimensions) = (numbers?, dimensions?);
    let points = match kind {
        DesignKind::Grid => grid_points(table, &dimensions)?,
        _ => numbers.points,
    };
    let file = document.file();
    let stem = || Path::new(file).file_stem();
    let mut spec = SweepSpec {
        name: name?
            .or_else(|| stem().map(|stem| stem.to_string_lossy().into_owned()))
            .unwrap_or_default(),
        file: file.to_owned(),
        text: document.text().to_owned(),
        design: Design {
            kind,
            points,
            seed: numbers.seed,
            levels: numbers.levels,
        },
        trajectories: numbers.trajectories,
        set: set?.unwrap_or_default(),
        dimensions,
        assumed: assumed?.unwrap_or_default(),
        measures: measures?.unwrap_or_default(),
        shares: shares?.unwrap_or_default(),
    };
    spec.count_trajectories();
    Ok(spec)
}

/// Number of points of a grid.
fn grid_points(table: &Table<'_>, dimensions: &[SweepDimension]) -> Result<usize, Reported> {
    let counts = dimensions.iter().map(|dimension| dimension.values.count());
    let product = counts.into_iter().try_fold(1_usize, |product, count| {
        product
            .checked_mul(count?)
            .filter(|product| *product <= POINTS_MOST)
    });
    product.ok_or_else(|| {
        let message = format!("the grid has more than {POINTS_MOST} points");
        let help = "take fewer values, or design = \"latin-hypercube\" with a number of points";
        table.report(DIMENSION.name, message, help)
    })
}
