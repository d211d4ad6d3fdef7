//! Command `twin draw`: a robot as SVG.

use std::path::{Path, PathBuf};

use twinrig_robot::RobotFile;

use super::{FAILURE, SUCCESS, Terminal};
use crate::args::DrawArgs;
use crate::drawing::drawing;
use crate::error::TwinError;
use twinrig_rig::error::Error;

pub(super) fn draw(args: &DrawArgs, terminal: &mut Terminal<'_>) -> u8 {
    match written(args, terminal) {
        Ok(()) => SUCCESS,
        Err(error) => {
            terminal.print_error(&error);
            FAILURE
        }
    }
}

fn written(args: &DrawArgs, terminal: &mut Terminal<'_>) -> Result<(), TwinError> {
    let file = RobotFile::find(&args.robot, Path::new(""))?;
    let robot = file.robot()?;
    let page = drawing(&file, &robot).map_err(|source| TwinError::Leg {
        robot: args.robot.clone(),
        source,
    })?;
    let path = args.out.clone().unwrap_or_else(|| {
        let robot = Path::new(&args.robot);
        let name = robot.file_stem().unwrap_or(robot.as_os_str());
        PathBuf::from(name).with_extension("svg")
    });
    if path.as_os_str() == "-" {
        terminal.print_plain(&page.text);
        return Ok(());
    }
    std::fs::write(&path, &page.text).map_err(|source| {
        TwinError::from(Error::Write {
            path: path.clone(),
            source,
        })
    })?;
    terminal.print(&format!("written {}", path.display()));
    Ok(())
}
