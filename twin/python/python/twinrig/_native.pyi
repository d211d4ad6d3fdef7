from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Final, final

import numpy as np
import numpy.typing as npt
from typing_extensions import Self, disjoint_base

from twinrig._parts import Channels, LaneFailure
from twinrig._scenario import Native
from twinrig.laws import Case, Setup

__all__ = [
    "Lane",
    "Rig",
    "WorkerJob",
    "Workers",
    "VERSION",
    "case_ranges",
    "check",
    "check_law",
    "check_setup",
    "command",
    "forked",
    "main",
    "plan",
    "read",
    "rollout",
    "run",
    "step_all",
    "step_lanes",
]

VERSION: Final[str]

def case_ranges() -> dict[str, Any]: ...
def check(scenario: Native) -> tuple[str, list[tuple[str, str, str, int | None]]]: ...
def check_law(name: str, setup: Setup, case: Case) -> tuple[int, str] | None: ...
def check_setup(setup: Setup) -> None: ...
def command(arguments: Sequence[str]) -> tuple[int, str, str]: ...
def forked() -> None: ...
def main(arguments: Sequence[str]) -> int: ...
def plan(scenario: Native) -> str: ...
def read(path: str | PathLike[str]) -> dict[str, Any]: ...
def rollout(
    rigs: Sequence[Rig],
    is_shared: bool,
    build: Callable[[int], Rig],
    names: Channels,
    states: Sequence[bytes | None],
    variables: Sequence[tuple[str, Sequence[float]]],
    commands: npt.NDArray[np.float64],
    shape: tuple[int, int],
    step: float,
    workers: Workers,
) -> tuple[
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.bool_],
    list[bytes | None],
    list[LaneFailure | None],
    list[Rig],
]: ...
def run(
    scenario: Native,
    recording: tuple[str, bool] | None,
    controllers: Mapping[str, Any],
    plants: Mapping[str, Any],
) -> dict[str, Any]: ...
def step_all(
    rigs: Sequence[Rig], duration: float, workers: Workers
) -> list[BaseException | None]: ...
def step_lanes(
    lanes: Sequence[Lane], commands: npt.NDArray[np.float64], step: float, workers: Workers
) -> tuple[
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.bool_],
    list[LaneFailure | None],
]: ...
@final
class Lane:
    def __new__(cls, rig: Rig, names: Channels) -> Self: ...

@disjoint_base
class Rig:
    def __new__(
        cls,
        scenario: Native,
        controllers: dict[str, Any],
        plants: dict[str, Any],
        has_fingerprint: bool,
    ) -> Self: ...
    def step(self, *, until: float | None = None) -> float: ...
    @property
    def now(self) -> float: ...
    @property
    def period(self) -> float: ...
    @property
    def duration(self) -> float: ...
    @property
    def has_fallen(self) -> bool: ...
    @property
    def fingerprint(self) -> str: ...
    def signals(self) -> list[tuple[str, str, int]]: ...
    def read(self, names: str | Sequence[str]) -> npt.NDArray[np.float64]: ...
    def write(self, name: str, values: npt.NDArray[np.float64] | None) -> None: ...
    def set_variable(self, name: str, value: float) -> None: ...
    def variables(self) -> list[tuple[str, str, float, float, float]]: ...
    def save(self) -> bytes: ...
    def restore(self, state: bytes) -> None: ...
    def close(self) -> None: ...

@final
class WorkerJob:
    def __new__(cls, shared: bytes) -> Self: ...
    def run(self, tasks: Sequence[bytes]) -> list[tuple[bool, bytes] | None]: ...

@disjoint_base
class Workers:
    def __new__(cls, threads: int) -> Self: ...
