"""Draws a stride of a recorded trot: the robot from its right side, and the footfalls below.

    twin run scenarios/trot.toml --until "6 s" --set 'expect=[]' \\
        --set 'record.frames="500 Hz"' --out recordings/stride
    python3 docs/pictures/trot.py recordings/stride/*.mcap docs/pictures/trot.svg

All shapes are from the recording: joints from the coordinate frames of `/tf`, stances from
`/footsteps`. Only Python's standard library is needed; the chunks of the recording must not be
compressed, and those of the program are not.
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Iterator
from pathlib import Path

LEGS = ["LF", "RF", "LH", "RH"]
LINKS = ["upper", "middle", "lower", "foot"]
# Legs of a diagonal pair have one colour, which is readable on white and on black.
COLOURS = {"LF": "#2b86d9", "RH": "#2b86d9", "RF": "#db7a1d", "LH": "#db7a1d"}
GREY = "#808080"

FIRST_S = 5.0  # the gait is steady from here on
FIGURES = 7  # over one stride, the last one at its end
PITCH = 132.0  # between the figures [px]
PX_PER_M = 400.0
LEFT, GROUND, FOOTFALL, ROW = 88.0, 66.0, 86.0, 18.0

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class Cdr:
    """Reads the little-endian CDR encoding of a message."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 4  # behind the encapsulation header

    def numbers(self, kind: str, count: int) -> tuple:
        size = struct.calcsize(kind)
        self.at += -(self.at - 4) % size
        found = struct.unpack_from(f"<{count}{kind}", self.data, self.at)
        self.at += size * count
        return found

    def text(self) -> str:
        (length,) = self.numbers("I", 1)
        found = self.data[self.at : self.at + length - 1].decode()
        self.at += length
        return found


def records(data: bytes, start: int = 0) -> Iterator[tuple[int, bytes]]:
    """Opcode and content of the records of an MCAP file, or of a chunk."""
    while start + 9 <= len(data):
        opcode, length = struct.unpack_from("<BQ", data, start)
        yield opcode, data[start + 9 : start + 9 + length]
        start += 9 + length


def messages(path: Path) -> Iterator[tuple[str, float, Cdr]]:
    """Topic, seconds since the start of the run, and data of all messages."""
    topics: dict[int, str] = {}
    for opcode, content in records(path.read_bytes(), 8):
        if opcode != 0x06:  # chunk
            continue
        (length,) = struct.unpack_from("<I", content, 28)
        if length:
            sys.exit(f"{path}: compressed chunks")
        for inner, record in records(content, 40):
            if inner == 0x04:  # channel
                channel, _, size = struct.unpack_from("<HHI", record)
                topics[channel] = record[8 : 8 + size].decode()
            elif inner == 0x05:  # message; recordings begin at 1 s
                channel, _, time_ns = struct.unpack_from("<HIQ", record)
                yield topics[channel], time_ns * 1e-9 - 1.0, Cdr(record[22:])


def rotated(q: Quaternion, v: Vector) -> Vector:
    """`v` turned by the unit quaternion `q` = (x, y, z, w)."""
    x, y, z, w = q
    t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])]
    return (
        v[0] + w * t[0] + y * t[2] - z * t[1],
        v[1] + w * t[1] + z * t[0] - x * t[2],
        v[2] + w * t[2] + x * t[1] - y * t[0],
    )


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """The quaternion that turns by `b` and then by `a`."""
    return (
        a[3] * b[0] + b[3] * a[0] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] + b[3] * a[1] + a[2] * b[0] - a[0] * b[2],
        a[3] * b[2] + b[3] * a[2] + a[0] * b[1] - a[1] * b[0],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    )


def pose(message: Cdr) -> dict[str, Vector]:
    """Positions of all frames of a `TFMessage` in the world; parents come before children."""
    places: dict[str, tuple[Vector, Quaternion]] = {"world": ((0, 0, 0), (0, 0, 0, 1))}
    for _ in range(*message.numbers("I", 1)):
        message.numbers("I", 2)  # stamp
        parent, child = message.text(), message.text()
        offset, turn = message.numbers("d", 3), message.numbers("d", 4)
        origin, orientation = places[parent]
        moved = rotated(orientation, offset)
        here = tuple(a + b for a, b in zip(origin, moved, strict=True))
        places[child] = (here, product(orientation, turn))
    return {name: place for name, (place, _) in places.items()}


def read(path: Path) -> tuple[dict[float, dict[str, Vector]], dict[str, list]]:
    """Poses by time, and the stances of each leg as pairs of touch-down and lift-off."""
    poses: dict[float, dict[str, Vector]] = {}
    stances: dict[str, list] = {leg: [] for leg in LEGS}
    for topic, time_s, message in messages(path):
        if topic == "/tf" and time_s >= FIRST_S:
            poses[time_s] = pose(message)
        elif topic == "/footsteps":
            leg = message.text()
            stances[leg].append(message.numbers("d", 2))
    return poses, stances


def line(points: list[tuple[float, float]], style: str) -> str:
    return f'<polyline points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in points)}" {style}/>'


def figure(pose: dict[str, Vector], x_px: float, on_ground: set[str]) -> list[str]:
    """The robot from its right side, its trunk at `x_px`; the legs of the left side are faint."""
    middle = pose["trunk"][0]

    def px(frame: str) -> tuple[float, float]:
        x, _, z = pose[frame]
        return x_px + (x - middle) * PX_PER_M, GROUND - z * PX_PER_M

    parts = []
    for side, style in (("L", 'stroke-width="2" opacity="0.65"'), ("R", 'stroke-width="3.5"')):
        trunk = [px(f"{side}H_upper"), px(f"{side}F_upper")]
        parts.append(line(trunk, f'stroke="{GREY}" {style}'))
        for leg in (f"{side}H", f"{side}F"):
            colour = COLOURS[leg]
            points = [px(f"{leg}_{link}") for link in LINKS]
            parts.append(line(points, f'stroke="{colour}" {style}'))
            if leg in on_ground:
                x, y = points[-1]
                parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>')
    return parts


def text(x: float, y: float, words: str, anchor: str = "start") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{words}</text>'


def draw(poses: dict[float, dict[str, Vector]], stances: dict[str, list]) -> str:
    downs = [down for down, _ in stances["LF"] if down > FIRST_S]
    start, end = downs[0], downs[1]
    width = LEFT + (FIGURES - 1) * PITCH + 84.0
    px_per_s = (FIGURES - 1) * PITCH / (end - start)
    first, last = LEFT - 74.0, width - 10.0
    parts = [line([(first, GROUND), (last, GROUND)], f'stroke="{GREY}" stroke-width="1"')]
    for index in range(FIGURES):
        wanted = start + (end - start) * index / (FIGURES - 1)
        time = min(poses, key=lambda time: abs(time - wanted))
        x = LEFT + index * PITCH
        on_ground = {
            leg for leg in LEGS if any(down <= time <= off for down, off in stances[leg])
        }
        parts += figure(poses[time], x, on_ground)
        bottom = FOOTFALL + ROW * len(LEGS)
        parts.append(line([(x, FOOTFALL), (x, bottom)], f'stroke="{GREY}" stroke-width="0.5"'))
        parts.append(text(x, bottom + 14, f"{(wanted - start) * 1e3:.0f} ms", "middle"))
    for row, leg in enumerate(LEGS):
        top = FOOTFALL + ROW * row
        parts.append(text(first, top + 13, leg))
        for down, off in stances[leg]:
            left = max(first + 30.0, LEFT + (down - start) * px_per_s)
            right = min(last, LEFT + (off - start) * px_per_s)
            if left < right:
                bar = f'x="{left:.1f}" y="{top + 3:.1f}" width="{right - left:.1f}"'
                parts.append(f'<rect {bar} height="12" rx="2" fill="{COLOURS[leg]}"/>')
    height = FOOTFALL + ROW * len(LEGS) + 20
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
        'fill="none" stroke-linecap="round" stroke-linejoin="round">'
    )
    style = f"<style>text {{ font: 12px sans-serif; fill: {GREY}; }}</style>"
    title = "<title>One stride of a trot: the robot from its right side, and its footfalls</title>"
    return "\n".join([head, title, style, *parts, "</svg>", ""])


if __name__ == "__main__":
    recording, picture = map(Path, sys.argv[1:])
    picture.write_text(draw(*read(recording)), encoding="utf-8")
