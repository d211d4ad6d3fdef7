//! Tables of `twin cell fit`.

use super::{FitReport, Model, Models};
use crate::commands::cell::report::{CellReport, four};
use twinrig_report::text::grid::{Cell, Grid, Left, Right};
use twinrig_report::text::style::{BOLD, DIM, styled};

/// Conditions of the use of the models.
const NOTES: [&str; 4] = [
    "A coefficient is half the change of the response between the levels, other factors in the middle.",
    "Length·Width of coded factors is not the area: it is +1 for the smallest and for the largest cell.",
    "Glue·Length may be Shape·Width, whose main effects are the largest: it matters between the levels.",
    "Eight cells, each with two and with six layers: p-values take all measurements as independent.",
];

impl CellReport for FitReport {
    fn lines(&self) -> Vec<String> {
        let title = styled(BOLD, "16 cells, thesis table 4.4");
        let levels = "factors coded: glue no, yes; layers 2, 6; type A, B; length 8, 29 mm; \
                      width 5, 29 mm";
        let mut lines = vec![format!("{title}  {}", styled(DIM, levels)), String::new()];
        lines.extend(self.cells().lines(2));
        lines.push(String::new());
        lines.extend(self.aliases());
        for models in &self.models {
            lines.push(String::new());
            lines.extend(models.lines(self.threshold));
        }
        lines.push(String::new());
        lines.extend(NOTES.map(|note| format!("  {}", styled(DIM, note))));
        lines
    }
}

impl FitReport {
    fn cells(&self) -> Grid {
        let mut grid = Grid::new(&[Right; 9]);
        grid.header(
            "glue | layer | shape | length | width | sensitivity S/N | base conductance S | saturation N | R²",
        );
        for cell in &self.cells {
            let [glue, layer, shape, length, width] =
                cell.coded.map(|level| Cell::from(format!("{level:+}")));
            grid.row([
                glue,
                layer,
                shape,
                length,
                width,
                format!("{:.4e}", cell.sensitivity_s_per_n).into(),
                format!("{:.4e}", cell.base_conductance_s).into(),
                format!("{:.3}", cell.saturation_load_n).into(),
                Cell::new(format!("{:.6}", cell.r_squared), DIM),
            ]);
        }
        grid
    }

    fn aliases(&self) -> Vec<String> {
        let pairs: Vec<String> = self.aliased.iter().map(|pair| pair.join(" = ")).collect();
        let relation = self.defining_relation.join(" = ");
        let mut grid = Grid::new(&[Left, Left]);
        for (name, text) in [
            (
                "design",
                "2^(6−2) with E = ABC, F = BCD; without the temperature, which was not varied, 2^(5−1)".to_owned(),
            ),
            ("relation", format!("I = {relation}")),
            ("aliased", pairs.join(", ")),
            ("", "the cells cannot tell which of a pair acts".to_owned()),
        ] {
            grid.row([Cell::new(name, DIM), text.into()]);
        }
        grid.lines(2)
    }
}

impl Models {
    fn lines(&self, threshold: f64) -> Vec<String> {
        let facts = format!(
            "whole model p {}, printed {}; greatest difference from a printed figure {:.1e}",
            four(self.recomputed.p),
            four(self.printed.p),
            self.difference
        );
        let mut lines = vec![
            format!("{}  {}", styled(BOLD, &self.title), styled(DIM, &facts)),
            String::new(),
        ];
        let mut grid = header();
        rows(&mut grid, &self.recomputed, Some(&self.printed));
        lines.extend(grid.lines(2));
        lines.push(String::new());
        let removed = &self.elimination.removed;
        let last = removed.last();
        let last = last.map(|last| format!(", the last {} with p {}", last.effect, four(last.p)));
        let removed = format!("{} removed{}", removed.len(), last.unwrap_or_default());
        let heading = format!("  backward elimination at {} %", threshold * 100.0);
        if self.elimination.same {
            lines.push(format!("{heading} selects the printed effects ({removed})"));
        } else {
            lines.push(format!("{heading} selects other effects ({removed}):"));
            lines.push(String::new());
            let mut grid = header();
            rows(&mut grid, &self.elimination.model, None);
            lines.extend(grid.lines(2));
        }
        lines
    }
}

fn header() -> Grid {
    let mut grid = Grid::new(&[Left, Right, Right, Right, Right, Right, Right, Left]);
    grid.header("factor | coefficient | SumSq | DoF | MeanSq | F | p | aliased with");
    grid
}

/// Adds the rows of a model, each with the printed one below it.
fn rows(grid: &mut Grid, model: &Model, printed: Option<&Model>) {
    let constant = |grid: &mut Grid, of: &Model, name: Cell, style| {
        let coefficient = Cell::new(four(of.constant), style);
        grid.row([name, coefficient]);
    };
    constant(grid, model, "Constant".into(), BOLD);
    if let Some(printed) = printed {
        constant(grid, printed, label(), DIM);
    }
    let effect = |grid: &mut Grid, of: &Model, n: usize, name: Cell, alias: &str, style| {
        let row = &of.effects[n];
        let cell = |value| Cell::new(four(value), style);
        grid.row([
            name,
            cell(row.coefficient),
            cell(row.sum_of_squares),
            Cell::new("1", style),
            cell(row.sum_of_squares),
            cell(row.f),
            cell(row.p),
            Cell::new(alias, DIM),
        ]);
    };
    for (n, row) in model.effects.iter().enumerate() {
        let alias = row.alias.as_deref().unwrap_or_default();
        effect(grid, model, n, row.effect.as_str().into(), alias, BOLD);
        if let Some(printed) = printed {
            effect(grid, printed, n, label(), "", DIM);
        }
    }
    let residual = |grid: &mut Grid, of: &Model, name: Cell, style| {
        let of = &of.residual;
        grid.row([
            name,
            Cell::default(),
            Cell::new(four(of.sum_of_squares), style),
            Cell::new(of.degrees_of_freedom.to_string(), style),
            Cell::new(four(of.mean_square), style),
        ]);
    };
    residual(grid, model, "Error".into(), BOLD);
    if let Some(printed) = printed {
        residual(grid, printed, label(), DIM);
    }
}

/// Label of a printed row.
fn label() -> Cell {
    Cell::new("  printed", DIM)
}
