use std::fmt;

use twinrig_runtime::DeviceError;

/// Transport of a port over a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetworkTransport {
    /// The bytes of the port, unchanged.
    Tcp,
    /// Telnet with the COM port control option.
    Rfc2217,
}

/// Address of a port on a network: `tcp://HOST:PORT` or `rfc2217://HOST:PORT`.
///
/// ```
/// use twinrig_wire::{NetworkAddress, NetworkTransport};
///
/// let address = NetworkAddress::parse("rfc2217://[::1]:4000").unwrap()?;
/// assert_eq!(address.transport, NetworkTransport::Rfc2217);
/// assert_eq!((&*address.host, address.port), ("::1", 4000));
/// assert_eq!(NetworkAddress::parse("/dev/ttyUSB0"), None);
/// # Ok::<(), twinrig_runtime::DeviceError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetworkAddress {
    /// Transport of the bytes.
    pub transport: NetworkTransport,
    /// Name or address of the host, without the brackets of IPv6.
    pub host: String,
    /// Port of TCP.
    pub port: u16,
}

/// Host of a served port where none is given: this machine alone reaches it.
const LOOPBACK: &str = "127.0.0.1";

impl NetworkAddress {
    /// Returns the address of a server. None if `text` has no scheme: it is a path then.
    ///
    /// # Errors
    /// [`DeviceError::BadAddress`] with the reason.
    pub fn parse(text: &str) -> Option<Result<Self, DeviceError>> {
        let (scheme, rest) = text.split_once("://")?;
        let address = transport(scheme).and_then(|transport| {
            let (host, port) = rest.rsplit_once(':').ok_or("the port is missing")?;
            let address = Self::of(transport, host, port)?;
            if address.port == 0 {
                return Err("0 is not the port of a server");
            }
            Ok(address)
        });
        Some(address.map_err(|why| bad(text, why)))
    }

    /// Returns the address of a port to be served, `tcp://[HOST:]PORT` or `rfc2217://[HOST:]PORT`:
    /// loopback unless a host is given; port 0 is any free one.
    ///
    /// # Errors
    /// [`DeviceError::BadAddress`] with the reason.
    pub fn parse_served(text: &str) -> Result<Self, DeviceError> {
        let parsed = text.split_once("://").ok_or("the scheme is missing");
        let address = parsed.and_then(|(scheme, rest)| {
            let (host, port) = rest.rsplit_once(':').unwrap_or((LOOPBACK, rest));
            Self::of(transport(scheme)?, host, port)
        });
        address.map_err(|why| bad(text, why))
    }

    fn of(transport: NetworkTransport, host: &str, port: &str) -> Result<Self, &'static str> {
        let bracketed = host.strip_prefix('[').and_then(|it| it.strip_suffix(']'));
        let is_name = |c: char| c.is_alphanumeric() || "-._".contains(c);
        let is_address = |c: char| c.is_ascii_hexdigit() || ":.%".contains(c) || is_name(c);
        let host = match bracketed {
            Some(host) if host.contains(':') && host.chars().all(is_address) => host,
            Some(_) => return Err("no IPv6 address in the brackets"),
            None if host.is_empty() => return Err("the host is missing"),
            None if host.contains(':') => return Err("an IPv6 address needs brackets: [::1]"),
            None if host.chars().all(is_name) => host,
            None => return Err("no such name of a host is possible"),
        };
        // `parse` accepts a sign.
        let digits = port.bytes().all(|byte| byte.is_ascii_digit());
        let port = port.parse().ok().filter(|_| digits);
        Ok(Self {
            transport,
            host: host.to_owned(),
            port: port.ok_or("the port is not a number from 0 to 65535")?,
        })
    }
}

fn transport(scheme: &str) -> Result<NetworkTransport, &'static str> {
    match scheme {
        "tcp" => Ok(NetworkTransport::Tcp),
        "rfc2217" => Ok(NetworkTransport::Rfc2217),
        _ => Err("unknown scheme"),
    }
}

fn bad(text: &str, why: &str) -> DeviceError {
    DeviceError::BadAddress {
        place: text.to_owned(),
        why: why.to_owned(),
    }
}

impl fmt::Display for NetworkTransport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Tcp => "tcp",
            Self::Rfc2217 => "rfc2217",
        })
    }
}

impl fmt::Display for NetworkAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            transport,
            host,
            port,
        } = self;
        if host.contains(':') {
            write!(f, "{transport}://[{host}]:{port}")
        } else {
            write!(f, "{transport}://{host}:{port}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_parsed_and_shown_alike() {
        for text in [
            "tcp://robot.local:4000",
            "rfc2217://10.0.0.7:1",
            "tcp://[fe80::1%eth0]:65535",
        ] {
            let address = NetworkAddress::parse(text).unwrap().unwrap();
            assert_eq!(address.to_string(), text);
            assert_eq!(NetworkAddress::parse_served(text), Ok(address));
        }
        let served = NetworkAddress::parse_served("tcp://0").unwrap();
        assert_eq!(served.to_string(), "tcp://127.0.0.1:0");
    }

    #[test]
    fn malformed_addresses_are_refused() {
        for text in [
            "tcp://",
            "tcp://robot",
            "tcp://:4000",
            "tcp://robot:",
            "tcp://robot:65536",
            "tcp://robot:+1",
            "tcp://robot:1/x",
            "tcp://::1:4000",
            "tcp://[robot]:1",
            "tcp://a b:1",
            "socket://robot:4000",
            "tcp://robot:0",
        ] {
            let refused = NetworkAddress::parse(text).unwrap();
            assert!(
                matches!(refused, Err(DeviceError::BadAddress { .. })),
                "{text}"
            );
        }
        for text in [
            "4000",
            "tcp://",
            "tcp://:4000",
            "udp://4000",
            "/dev/ttyUSB0",
        ] {
            assert!(NetworkAddress::parse_served(text).is_err(), "{text}");
        }
    }
}
