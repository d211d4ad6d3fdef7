//! Facts of a robot for readers.

use twinrig_document::escaped;

use super::{MARKS, RobotFacts, shown};
use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::{BOLD, DIM, styled};

impl RobotFacts {
    /// Returns the lines of a table for each part of the robot.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = vec![format!(
            "{}  {}",
            styled(BOLD, &self.name),
            styled(DIM, &self.file)
        )];
        let mut is_marked = false;
        for section in &self.sections {
            let legs = section.legs.join(", ");
            lines.push(
                format!("  {}  {}", styled(BOLD, &section.part), escaped(&legs))
                    .trim_end()
                    .to_owned(),
            );
            let mut grid = Grid::new(&[Left, Left, Left, Left]);
            for fact in &section.facts {
                let value = match fact.value.as_slice() {
                    [] => "–".to_owned(),
                    values => shown(values, fact.unit),
                };
                let mark = if fact.assumed.is_empty() { "" } else { "*" };
                is_marked |= !fact.assumed.is_empty();
                let note = Cell::new(fact.note.clone(), DIM);
                grid.row([fact.name.into(), value.into(), mark.into(), note]);
            }
            lines.extend(grid.lines(4));
        }
        if is_marked {
            let marks = MARKS.join(" or ");
            let file = &self.file;
            lines.push(format!(
                "  * follows from values that {file} marks {marks}; --json names them"
            ));
        }
        lines
    }
}
