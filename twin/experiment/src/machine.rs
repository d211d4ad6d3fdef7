//! Machine and build of a study, without which its run times have no meaning.

use serde::Serialize;

/// Machine and build.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Machine {
    /// Processor model, as the operating system reports it.
    pub cpu: String,
    /// Processors available to the program. A study uses one.
    pub cores: usize,
    /// Load average over the last minute when the study began; above 1, other programs shared the
    /// processor.
    pub load: Option<f64>,
    /// Operating system and instruction set.
    pub system: String,
    /// Program version and build profile.
    pub build: String,
}

impl Machine {
    /// Returns the present machine, with `build` as the program version, which cargo compiled in
    /// the profile `debug` or `release`.
    pub fn here(build: &str, profile: &str) -> Self {
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let profile = match profile {
            "debug" => "debug: run times are those of a build without optimisation",
            profile => profile,
        };
        Self {
            cpu: cpu(&read("/proc/cpuinfo")).unwrap_or_else(|| "unknown".to_owned()),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            load: load(&read("/proc/loadavg")),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            build: format!("{build} ({profile})"),
        }
    }
}

fn cpu(info: &str) -> Option<String> {
    let line = info.lines().find(|line| line.starts_with("model name"))?;
    let (_, name) = line.split_once(':')?;
    Some(name.trim().to_owned())
}

fn load(averages: &str) -> Option<f64> {
    averages.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_system_information_is_none() {
        let info = "processor\t: 0\nmodel name\t: Any CPU @ 3 GHz\ncache size\t: 1 KB\n";
        assert_eq!(cpu(info).as_deref(), Some("Any CPU @ 3 GHz"));
        assert_eq!(cpu("nothing"), None);
        assert_eq!(load("0.52 0.58 0.59 1/467 12345\n"), Some(0.52));
        assert_eq!(load(""), None);
    }
}
