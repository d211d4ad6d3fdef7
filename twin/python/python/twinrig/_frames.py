"""Coordinate frames of the trunk and of the leg segments over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twinrig._signal import Floats


@dataclass(frozen=True, eq=False)
class Frame:
    """Position and orientation of a frame over time."""

    name: str
    """``trunk``, ``LF_upper``, ``LF_middle``, ``LF_lower``, ``LF_foot``, …: links of the URDF."""
    parent: str
    """Frame that moves it: ``world`` for ``trunk``; ``trunk`` or, of a leg with a joint of abduction,
    ``LF_abductor`` for ``LF_upper``."""
    relative_to: str
    """Frame in which the numbers are: ``world``, or the parent."""
    time: Floats
    """Times [s], of shape (n,)."""
    position: Floats
    """Origin x, y, z [m], of shape (n, 3)."""
    orientation: Floats
    """Unit quaternion w, x, y, z, of shape (n, 4), as the signal ``body/orientation``."""


def product(a: Floats, b: Floats) -> Floats:
    """Return the products of quaternions w, x, y, z, of shape (n, 4)."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a.T, b.T
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=1,
    )


def rotated(orientation: Floats, points: Floats) -> Floats:
    """Rotate points of shape (n, 3) by quaternions of shape (n, 4)."""
    axis = orientation[:, 1:]
    once = np.cross(axis, points)
    turned: Floats = points + 2.0 * (orientation[:, :1] * once + np.cross(axis, once))
    return turned


def frames(
    links: Sequence[tuple[str, str]], time: Floats, numbers: Floats, *, in_parents: bool
) -> dict[str, Frame]:
    """Return frames by name; `numbers` are x, y, z and x, y, z, w of each time and link."""
    table = numbers.reshape(len(time), len(links), 7)
    found: dict[str, Frame] = {}
    for column, (parent, name) in enumerate(links):
        position, orientation = table[:, column, :3], table[:, column, [6, 3, 4, 5]]
        relative_to = parent
        if not in_parents and parent in found:
            above = found[parent]
            position = above.position + rotated(above.orientation, position)
            orientation = product(above.orientation, orientation)
            relative_to = above.relative_to
        found[name] = Frame(name, parent, relative_to, time, position, orientation)
    return found
