//! Command `twin list`: kinds of parts and robots of a build.

use std::ops::Bound;
use std::path::Path;

use serde::Serialize;
use twinrig_document::{Range, escaped};
use twinrig_robot::{Robot, RobotFile};
use twinrig_scenario::{Accepts, Kind, TableReference, language};

use super::{FAILURE, SUCCESS, Terminal};
use crate::args::ListArgs;
use crate::error::TwinError;
use crate::robot_facts::{RobotFacts, robot_facts};
use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::{BOLD, DIM, styled};
use twinrig_rig::registry::Registry;

/// Robot whose process variables are listed if none is named.
const DEFAULT: &str = "cheetah-cub";

#[derive(Serialize)]
struct Listing {
    /// Null without a robot on the command line.
    robot: Option<RobotFacts>,
    plants: Vec<Part>,
    controllers: Vec<Part>,
    buses: Vec<Part>,
    robots: Vec<String>,
    tables: Vec<Table>,
}

/// A table of scenarios, with the keys that every kind has.
#[derive(Serialize)]
struct Table {
    name: &'static str,
    about: &'static str,
    keys: Vec<Opt>,
}

#[derive(Serialize)]
struct Part {
    name: String,
    about: String,
    /// Null if the part is in this build.
    remedy: Option<String>,
    options: Vec<Opt>,
    variables: Vec<Variable>,
}

#[derive(Serialize)]
struct Opt {
    name: String,
    about: String,
    accepts: String,
}

#[derive(Serialize)]
struct Variable {
    name: String,
    unit: &'static str,
    range: String,
    /// Least and greatest value; null if there is none.
    min: Option<f64>,
    max: Option<f64>,
    /// Ends that do not belong to the range: `min`, `max`.
    open: Vec<&'static str>,
    default: f64,
}

pub(super) fn list(registry: &Registry, args: &ListArgs, terminal: &mut Terminal<'_>) -> u8 {
    let (robot, facts) = match robot_and_facts(args.robot.as_deref()) {
        Ok(found) => found,
        Err(error) => {
            terminal.report_error(&error, args.json);
            return FAILURE;
        }
    };
    let catalogue = registry.catalogue(Some(&robot));
    let parts = |kinds: &[Kind]| kinds.iter().map(part).collect::<Vec<_>>();
    let listing = Listing {
        robot: facts,
        plants: parts(&catalogue.plants),
        controllers: parts(&catalogue.controllers),
        buses: parts(&catalogue.buses),
        robots: RobotFile::names(Path::new("")),
        tables: language().iter().map(table).collect(),
    };
    if args.json {
        terminal.print_json(&listing);
    } else {
        let text = text(&listing);
        terminal.print(&text);
    }
    SUCCESS
}

/// Returns the robot whose process variables are listed, with its facts if it is named.
fn robot_and_facts(name: Option<&str>) -> Result<(Robot, Option<RobotFacts>), TwinError> {
    let file = RobotFile::find(name.unwrap_or(DEFAULT), Path::new(""))?;
    let robot = file.robot()?;
    let facts = name.map(|name| {
        robot_facts(&file, &robot).map_err(|source| TwinError::Leg {
            robot: name.to_owned(),
            source,
        })
    });
    Ok((robot, facts.transpose()?))
}

fn table(table: &TableReference) -> Table {
    let keys = table.keys.iter().map(|key| Opt {
        name: key.name.to_owned(),
        about: key.about.to_owned(),
        accepts: key.value.clone(),
    });
    Table {
        name: table.name,
        about: table.about,
        keys: keys.collect(),
    }
}

/// Returns the value at an end of a range.
fn end(bound: Bound<f64>) -> Option<f64> {
    match bound {
        Bound::Included(value) | Bound::Excluded(value) => Some(value),
        Bound::Unbounded => None,
    }
}

/// Returns the names of the ends that do not belong to a range.
fn open_ends(range: &Range) -> Vec<&'static str> {
    let ends = [("min", range.min), ("max", range.max)].into_iter();
    let open = ends.filter(|(_, bound)| matches!(bound, Bound::Excluded(_)));
    open.map(|(name, _)| name).collect()
}

fn part(kind: &Kind) -> Part {
    let variables = kind.variables.iter().map(|variable| Variable {
        name: variable.name.clone(),
        unit: variable.unit.symbol(),
        range: variable.range.to_string(),
        min: end(variable.range.min),
        max: end(variable.range.max),
        open: open_ends(&variable.range),
        default: variable.default,
    });
    let options = kind.options.iter().map(|option| Opt {
        name: option.name.clone(),
        about: option.about.clone(),
        accepts: accepts(&option.accepts),
    });
    Part {
        name: kind.name.clone(),
        about: kind.about.clone(),
        remedy: kind.remedy.clone(),
        options: options.collect(),
        variables: variables.collect(),
    }
}

fn accepts(accepted: &Accepts) -> String {
    match accepted {
        Accepts::Quantity { unit, .. } => format!("a quantity in {unit}"),
        Accepts::Duration => "a duration".to_owned(),
        Accepts::PositiveDuration => "a duration longer than 0".to_owned(),
        Accepts::Natural(range) => {
            format!("an integer from {} to {}", range.start(), range.end())
        }
        Accepts::Boolean => "true or false".to_owned(),
        Accepts::Scalar => "a number, true or false, or a text".to_owned(),
        Accepts::Text => "a text".to_owned(),
        Accepts::Name => "a name".to_owned(),
        Accepts::Names => "a list of names".to_owned(),
        Accepts::Choice(words) => words.join(" | "),
        Accepts::Time => "a duration, a distribution of durations, or a trace of them".to_owned(),
        Accepts::Group(options) => {
            let keys: Vec<_> = options.iter().map(|option| option.name.as_str()).collect();
            format!("{{ {} }}", keys.join(", "))
        }
        Accepts::Table(one) => format!("{} by name", accepts(one)),
        Accepts::Each(one) => format!("{}, for all or by name", accepts(one)),
    }
}

fn text(listing: &Listing) -> String {
    let mut lines = Vec::new();
    if let Some(facts) = &listing.robot {
        lines.extend(facts.lines());
    }
    let mut section = |title: &str, parts: &[Part]| {
        lines.push(styled(BOLD, title));
        let mut grid = Grid::new(&[Left, Left]);
        for part in parts {
            let remedy = part.remedy.as_ref();
            let missing = remedy.map(|remedy| format!(" (not in this build: {remedy})"));
            let about = format!("{}{}", part.about, missing.unwrap_or_default());
            grid.row([part.name.as_str().into(), about.into()]);
            for option in &part.options {
                let line = format!("{} = {}: {}", option.name, option.accepts, option.about);
                grid.row(["".into(), Cell::new(line, DIM)]);
            }
            if !part.variables.is_empty() {
                let names = part.variables.iter().map(|variable| variable.name.as_str());
                let names = names.collect::<Vec<_>>().join(", ");
                let names = Cell::new(format!("variables: {names}"), DIM);
                grid.paragraph("".into(), &names, 90);
            }
        }
        if parts.is_empty() {
            grid.row([Cell::new("none in this build", DIM)]);
        }
        lines.extend(grid.lines(2));
    };
    section("plants", &listing.plants);
    section("controllers", &listing.controllers);
    section("drivers", &listing.buses);
    lines.push(styled(BOLD, "robots"));
    lines.extend(listing.robots.iter().map(|robot| format!("  {robot}")));
    lines.push(styled(BOLD, "tables of scenarios (keys: --json)"));
    let mut grid = Grid::new(&[Left, Left]);
    for table in &listing.tables {
        grid.row([table.name.into(), table.about.into()]);
    }
    lines.extend(grid.lines(2));
    if let Some(facts) = &listing.robot {
        lines.push(format!(
            "what follows from {} is at the beginning of this list",
            escaped(&facts.file)
        ));
    }
    lines.join("\n")
}
