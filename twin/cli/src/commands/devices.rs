//! Command `twin devices`: list of serial ports.

use serde::Serialize;
use twinrig_wire::{PortInfo, ports};

use super::{FAILURE, SUCCESS, Terminal};
use crate::args::DevicesArgs;
use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::DIM;

#[derive(Serialize)]
struct Port {
    path: String,
    usb: Option<Usb>,
    latency_timer_s: Option<f64>,
}

#[derive(Serialize)]
struct Usb {
    vendor: u16,
    product: u16,
    name: String,
    serial: Option<String>,
}

impl From<PortInfo> for Port {
    fn from(port: PortInfo) -> Self {
        let usb = port.usb.map(|usb| Usb {
            vendor: usb.vendor,
            product: usb.product,
            name: usb.name,
            serial: usb.serial,
        });
        Self {
            path: port.path.display().to_string(),
            usb,
            latency_timer_s: port.latency_timer.map(|timer| timer.as_secs_f64()),
        }
    }
}

pub(super) fn devices(args: &DevicesArgs, terminal: &mut Terminal<'_>) -> u8 {
    #[derive(Serialize)]
    struct Listing {
        ports: Vec<Port>,
    }
    let ports = match ports() {
        Ok(ports) => ports.into_iter().map(Port::from).collect(),
        Err(error) => {
            terminal.print_message(&format!("error: {error}"));
            return FAILURE;
        }
    };
    if args.json {
        terminal.print_json(&Listing { ports });
    } else if ports.is_empty() {
        terminal.print("no serial ports; `twin serve SCENARIO` creates emulated ones");
    } else {
        let text = grid(&ports).lines(0).join("\n");
        terminal.print(&text);
    }
    SUCCESS
}

fn grid(ports: &[Port]) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Left, Left]);
    for port in ports {
        let usb = port.usb.as_ref();
        let ids = usb.map(|usb| format!("{:04x}:{:04x}", usb.vendor, usb.product));
        let name = usb.map(|usb| {
            let serial = usb.serial.as_ref();
            let serial = serial.map(|serial| format!(" ({serial})"));
            format!("{}{}", usb.name, serial.unwrap_or_default())
        });
        let timer = port.latency_timer_s;
        let timer = timer.map(|timer| format!("latency timer {} ms", timer * 1e3));
        grid.row([
            port.path.as_str().into(),
            Cell::new(ids.unwrap_or_default(), DIM),
            name.unwrap_or_default().into(),
            Cell::new(timer.unwrap_or_default(), DIM),
        ]);
    }
    grid
}
