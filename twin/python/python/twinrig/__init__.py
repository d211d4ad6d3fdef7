"""Twinrig: deterministic co-simulation and digital-twin test rig for low-cost quadrupeds.

>>> import twinrig
>>> run = twinrig.run("scenarios/trot.toml")
>>> run.verdict
'pass'
>>> hip = run.signals["leg/LF/hip/position"]
>>> hip.unit, hip.time[-1]
('rad', 20.0)

A run is the same, bit for bit, as that of the program ``twin`` with the same scenario and
settings: `Run.fingerprint` is equal.
"""

from __future__ import annotations

import os

from twinrig import _native
from twinrig._commands import check, command, diff, page, parts, plan, read, robots, run, study
from twinrig._errors import (
    Problem,
    RecordingError,
    RunError,
    ScenarioError,
    ScenarioWarning,
    TwinError,
)
from twinrig._frames import Frame
from twinrig._parts import Controller, Input, Output, Plant, Variable
from twinrig._rig import Rig, Workers, step_all
from twinrig._rollout import LaneError, Rollout, Trajectories, rollout
from twinrig._run import Energy, Expectation, Page, Recording, Run
from twinrig._signal import Signal, SignalGroup, Signals
from twinrig._sweep import Share, Sweep, optimize, sweep

__version__ = _native.VERSION

__all__ = [
    "Controller",
    "Energy",
    "Expectation",
    "Frame",
    "Input",
    "LaneError",
    "Output",
    "Page",
    "Plant",
    "Problem",
    "Recording",
    "RecordingError",
    "Rig",
    "Rollout",
    "Run",
    "RunError",
    "ScenarioError",
    "ScenarioWarning",
    "Share",
    "Signal",
    "SignalGroup",
    "Signals",
    "Sweep",
    "Trajectories",
    "TwinError",
    "Variable",
    "Workers",
    "check",
    "command",
    "diff",
    "optimize",
    "page",
    "parts",
    "plan",
    "read",
    "robots",
    "rollout",
    "run",
    "step_all",
    "study",
    "sweep",
]

os.register_at_fork(after_in_child=_native.forked)
