"""Addresses of Ray clusters, checked before Ray itself waits for an answer of minutes."""

from __future__ import annotations

import os
import secrets
import socket
from importlib import import_module

LOCAL = "local"
"""Address of a Ray of our own on this machine."""
AUTO = "auto"
"""Address of the cluster that this machine belongs to."""
CONNECT_S = 2.0
"""Time for a host to answer [s]."""

CHECK = "check host and port, and that a head runs: `ray start --head`"


class ClusterError(Exception):
    """A cluster that cannot do the job, with a remedy."""

    def __init__(self, message: str, help: str) -> None:
        super().__init__(message)
        self.help = help


def requested(address: str | None) -> str:
    """Return the address that is asked for, and prepare the environment in which Ray is imported."""
    address = address or os.environ.get("RAY_ADDRESS") or LOCAL
    if address.startswith("ray://"):
        raise ClusterError(
            f"`{address}` is the address of a Ray client",
            "start a node here, `ray start --address=HOST:PORT`, and name HOST:PORT or auto",
        )
    if address not in (LOCAL, AUTO):
        _host_and_port(address)
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    if address == LOCAL and "RAY_AUTH_MODE" not in os.environ:
        # A token of its own, where Ray would write one into the home folder.
        os.environ["RAY_AUTH_MODE"] = "token"
        os.environ["RAY_AUTH_TOKEN"] = secrets.token_hex(32)
    return address


def reachable(address: str) -> str:
    """Return the `HOST:PORT` of a requested address, at which something answers."""
    if address == LOCAL:
        return address
    try:
        # Ray's own rules: its file of the last cluster, and the host of a loop-back address.
        services = import_module("ray._private.services")
        found = str(services.canonicalize_bootstrap_address(address))
    except ConnectionError:
        raise ClusterError(
            "`auto` finds no cluster: no node of Ray runs on this machine",
            "start one, `ray start --address=HOST:PORT`, or name the HOST:PORT of a head",
        ) from None
    shown = f"`{address}`" if found == address else f"`{address}`, which is {found}"
    host, port = _host_and_port(found)
    try:
        socket.create_connection((host, port), timeout=CONNECT_S).close()
    except socket.gaierror:
        raise ClusterError(f"no cluster at {shown}: the host is unknown", CHECK) from None
    except TimeoutError:
        reason = f"no answer for {CONNECT_S:.0f} s"
        raise ClusterError(f"no cluster at {shown}: {reason}", CHECK) from None
    except OSError as error:
        reason = error.strerror or str(error)
        raise ClusterError(f"no cluster at {shown}: {reason}", CHECK) from None
    return found


def _host_and_port(address: str) -> tuple[str, int]:
    host, _, port = address.rpartition(":")
    if not host or not (port.isascii() and port.isdecimal()) or not 0 < int(port) < 1 << 16:
        raise ClusterError(
            f"`{address}` is no address of a cluster",
            "write HOST:PORT, or auto; the port is that of `ray start --head`, by default 6379",
        )
    return host.strip("[]"), int(port)
