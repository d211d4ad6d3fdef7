"""FMUs as plants: values, units, states and coupling, against closed forms."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import twinrig
from fmus import COMPILER, LAG_2, lag, lag3
from lags import (
    PERIOD_S,
    SCENARIO,
    Constant,
    Number,
    lagged,
    program,
    run,
    scenario,
    written,
)
from twinrig import Output

pytestmark = pytest.mark.skipif(
    COMPILER is None and "CI" not in os.environ, reason="there is no C compiler"
)


def test_lag_follows_its_closed_form_in_units_of_signals(folder: Path) -> None:
    # The FMU counts in millimetres.
    x = run(scenario(folder)).signals["x"]
    assert x.unit == "m"
    np.testing.assert_allclose(x, lagged(x.time), rtol=1e-12, atol=1e-15)


def test_own_process_and_this_process_give_the_same_bits(folder: Path) -> None:
    path = scenario(folder)
    fingerprints = {run(path, set={"plant.isolated": own}).fingerprint for own in (True, False)}
    assert len(fingerprints) == 1


def test_fmi_3_passes_events_and_vectors(folder: Path) -> None:
    for fault in ("NONE", "EARLY"):
        lag3(folder / "lag.fmu", fault)
        signals = run(written(folder), Number).signals
        x, events = signals["x"], signals["events"]
        np.testing.assert_allclose(x, lagged(x.time), rtol=1e-12, atol=1e-15)
        np.testing.assert_array_equal(signals["multiples"][:, 2], 3.0 * np.asarray(x))
        # An event every 0.1 s; those at instants of observation may be found one of them later.
        count = np.asarray(events.time) / 0.1
        assert np.all(np.asarray(events) <= np.floor(count + 1e-9))
        assert np.all(np.asarray(events) >= np.floor(count - 0.02 - 1e-9))


OFFSET = """
[plant.inputs]
"heat" = { variable = "u" }
[plant.outputs]
"temperature" = { variable = "x" }
"""


class Heat:
    """Commands zero degrees Celsius."""

    ports = (Output("heat", "K"),)

    def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
        outputs[0] = 273.15


def test_units_with_an_offset_are_converted_in_both_directions(folder: Path) -> None:
    celsius = LAG_2.replace('unit="mm"', 'unit="degC"')
    path = scenario(folder, OFFSET, description=celsius)
    temperature = run(path, Heat).signals["temperature"]
    assert temperature.unit == "K"
    # From 0 °C, towards 0 °C.
    np.testing.assert_allclose(temperature, 273.15, rtol=1e-15)


# Name of the FMU's unit, its definition in base units, unit of the signal, and its value for 1 mm.
UNITS = [
    ("deg", 'rad="1" factor="0.017453292519943295"', "rad", 0.017453292519943295),
    ("rpm", 'rad="1" s="-1" factor="0.10471975511965977"', "rad/s", 0.10471975511965977),
    ("N.m", 'kg="1" m="2" s="-2"', "N·m", 1.0),
    ("J", 'kg="1" m="2" s="-2"', "J", 1.0),
    ("kJ", 'kg="1" m="2" s="-2" factor="1000"', "N·m", 1000.0),
    ("Hz", 's="-1"', "Hz", 1.0),
    ("V/A", 'kg="1" m="2" s="-3" A="-2"', "Ω", 1.0),
    ("g/cm3", 'kg="1" m="-3" factor="1000"', "1", 1000.0),
    ("degF", 'K="1" factor="0.5555555555555556" offset="255.3722222222222"', "K", 255.92777777),
]


def test_units_are_matched_by_dimension_and_name(folder: Path) -> None:
    definitions, variables = "", ""
    for n, (name, base, _, _) in enumerate(UNITS):
        definitions += f'<Unit name="{name}"><BaseUnit {base}/></Unit>'
        variables += (
            f'<ScalarVariable name="y{n}" valueReference="2" causality="output" '
            f'variability="continuous" initial="calculated"><Real unit="{name}"/></ScalarVariable>'
        )
    description = LAG_2.replace("</UnitDefinitions>", f"{definitions}</UnitDefinitions>")
    description = description.replace("</ModelVariables>", f"{variables}</ModelVariables>")
    path = scenario(folder, "[plant.parameters]\ngain = 0.001\n", description=description)
    signals = run(path, set={"duration": "20 s", "observe.period": "1 s"}).signals
    for n, (name, _, symbol, value) in enumerate(UNITS):
        signal = signals[f"y{n}"]
        # The lag has settled at 1 of the unit.
        assert (name, signal.unit) == (name, symbol)
        assert float(signal[-1]) == pytest.approx(value, rel=1e-8)


def test_parameters_are_set_before_the_start(folder: Path) -> None:
    x = run(scenario(folder, "[plant.parameters]\ngain = 2.5\n")).signals["x"]
    np.testing.assert_allclose(x, 2.5 * lagged(x.time), rtol=1e-12, atol=1e-15)


def test_steps_are_divided(folder: Path) -> None:
    path = scenario(folder)
    steps = [
        int(run(path, set={"plant.step": step}).signals["count"][-1]) for step in ("2 ms", "0.3 ms")
    ]
    # 500 observations in 1 s; the fewest equal parts of 2 ms up to 0.3 ms are 7.
    assert steps == [500, 3500]


@pytest.mark.parametrize("own", [True, False])
@pytest.mark.parametrize("version", [2, 3])
def test_saved_state_continues_with_the_same_bits(folder: Path, own: bool, version: int) -> None:
    if version == 2:
        path, controller = scenario(folder), Constant
    else:
        lag3(folder / "lag.fmu", "EARLY")
        path, controller = written(folder), Number
    options: Any = {"controllers": {"constant": controller}, "set": {"plant.isolated": own}}
    with twinrig.Rig(path, **options) as rig, twinrig.Rig(path, **options) as other:
        rig.step(until=0.305)
        saved = rig.save()
        rig.step(until=1.0)
        for again in (rig, other):
            expected = rig.read("x").tobytes()
            again.restore(saved)
            again.step(until=1.0)
            assert again.read("x").tobytes() == expected


def test_restoring_needs_the_capability(folder: Path) -> None:
    description = LAG_2.replace('canSerializeFMUstate="true"', "")
    path = scenario(folder, description=description)
    with twinrig.Rig(path, controllers={"constant": Constant}) as rig:
        state = rig.save()
        with pytest.raises(ValueError, match="the FMU `lag` .* lacks `canSerializeFMUstate`"):
            rig.restore(state)


def test_recording_is_replayed_without_the_file(folder: Path) -> None:
    path = scenario(folder)
    path.write_text(SCENARIO.split("[controller]")[0] + "[plant]" + SCENARIO.split("[plant]")[1])
    assert program("run", "lag.toml", folder=folder).returncode == 0
    (folder / "lag.fmu").unlink()
    (recording,) = (folder / "recordings").iterdir()
    done = program("replay", str(recording), folder=folder)
    assert done.returncode == 0 and "identical" in done.stdout


def test_mistakes_are_reported_at_their_places(folder: Path) -> None:
    more = """
[plant.inputs]
"a" = { variable = "uu" }
"b" = { variable = "x" }
[plant.outputs]
"c" = { variable = "title" }
"d" = { variable = "x", unit = "N" }
"e f" = { variable = "x" }
"body/position" = { variable = "x" }
"g" = { variable = "x", unit = "mm" }
[plant.parameters]
gian = 2
"""
    with pytest.raises(twinrig.ScenarioError) as raised:
        run(scenario(folder, more))
    found = [(problem.message, problem.help) for problem in raised.value.problems]
    assert found == [
        ("the FMU has no variable `uu`", "did you mean `u`?"),
        ("`x` is no input of the FMU: it is an output", "map it in [plant.outputs]"),
        ("`title` is of type String", "signals are numbers"),
        ("`d` is in N, and the variable `x` in mm", "leave `unit` out"),
        (
            "`e f` is not the name of a signal",
            "names consist of letters, digits, `_`, `-` and `.`, separated by slashes",
        ),
        (
            "the standard signal body/position [m] × 3 has 1 elements here, in m",
            "give the variables another signal in [plant.outputs]",
        ),
        (
            "`mm` is not a unit of a signal",
            "signals are SI without prefixes: in m, values of this variable would be wrong by a "
            "factor of 1000; declare its unit in the FMU, or scale it there",
        ),
        ("the FMU has no variable `gian`", "did you mean `gain`?"),
    ]


TYPED = """
    <ScalarVariable name="teeth" valueReference="0" causality="parameter" variability="tunable">
      <Integer start="1"/></ScalarVariable>
    <ScalarVariable name="braked" valueReference="0" causality="parameter" variability="tunable">
      <Boolean start="false"/></ScalarVariable>
    <ScalarVariable name="share" valueReference="3" causality="parameter" variability="tunable">
      <Real start="0.5" min="0" max="1"/></ScalarVariable>
    <ScalarVariable name="order" valueReference="0" causality="parameter" variability="tunable">
      <Integer start="1" min="1"/></ScalarVariable>
  </ModelVariables>"""


def test_parameters_have_the_type_of_their_variable(folder: Path) -> None:
    path = scenario(folder, description=LAG_2.replace("</ModelVariables>", TYPED))
    whole = "it must be a whole number from -2147483648 to 2147483647"
    declared = "as the FMU declares it"
    for parameter, message, remedy in (
        ("share = 1.5", "`share` of type Real is 1.5", f"it must be from 0 to 1, {declared}"),
        ("order = 0", "`order` of type Integer is 0", f"it must be at least 1, {declared}"),
        ("teeth = 1.5", "`teeth` of type Integer is 1.5", whole),
        ("teeth = 3e10", "`teeth` of type Integer is 30000000000", whole),
        ("teeth = true", "`teeth` of type Integer is true", whole),
        ("braked = 2", "`braked` of type Boolean is 2", "it must be true or false"),
        ('title = "a"', "`title` is of type String", "strings cannot be set"),
        (
            'gain = "1 m"',
            '`gain` of type Real is "1 m"',
            "it must be a number without a unit, in the unit of the variable",
        ),
    ):
        path.write_text(f"{SCENARIO}[plant.parameters]\n{parameter}\n")
        with pytest.raises(twinrig.ScenarioError) as raised:
            run(path)
        (problem,) = raised.value.problems
        assert (problem.message, problem.help) == (message, remedy)
        assert problem.line == path.read_text().count("\n")
    # The value arrives: the lag counts its steps from `teeth`, and refuses all booleans.
    path.write_text(f"{SCENARIO}[plant.parameters]\nteeth = 1000\n")
    assert int(run(path).signals["count"][0]) == 1000
    path.write_text(f"{SCENARIO}[plant.parameters]\nbraked = true\n")
    with pytest.raises(twinrig.ScenarioError, match="`fmi2SetBoolean` failed"):
        run(path)


def test_missing_file_and_missing_package_have_their_remedies(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(folder)
    with pytest.raises(twinrig.ScenarioError, match="relative to the scenario's folder"):
        run(path)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(twinrig.ScenarioError, match="pip install fmpy"):
        run(path)


def test_signal_in_another_unit_is_a_near_miss(folder: Path) -> None:
    with pytest.raises(twinrig.ScenarioError, match=r"u \[1\]") as raised:
        run(scenario(folder), Number)
    assert "u [m]" in str(raised.value)


def test_fixed_step_requires_a_grid(folder: Path) -> None:
    variable = 'canHandleVariableCommunicationStepSize="true"'
    path = scenario(folder, description=LAG_2.replace(variable, ""))
    with pytest.raises(twinrig.ScenarioError, match='grid = "10.000 ms"'):
        run(path)
    more = 'coupling = { grid = "10 ms" }\n[observe]\nperiod = "10 ms"\n'
    path.write_text(path.read_text() + more)
    assert int(run(path).signals["count"][-1]) == 100


def test_coupling_error_of_held_commands_is_that_of_their_delay(folder: Path) -> None:
    description = LAG_2.replace(' unit="mm"', "")
    lag(folder / "lag.fmu", description=description)
    path = folder / "leg.toml"
    path.write_text(
        'duration = "200 ms"\n[plant]\nmodel = "fmu"\nfile = "lag.fmu"\nisolated = false\n'
        '[plant.inputs]\n"leg/LF/hip/command" = { variable = "u", unit = "rad" }\n'
        '[plant.outputs]\n"leg/LF/foot/position" = { variables = ["x", "x", "x"] }\n'
        '[controller]\nkind = "script"\nshape = "sine"\nperiod = "10 ms"\nfrequency = "2 Hz"\n'
        '[io]\ntransfer_time = "1.234 ms"\n'
    )
    done = program("study", "coupling", "leg.toml", "--json", folder=folder)
    rows = json.loads(done.stdout)["rows"]
    commands = twinrig.run(path).signals["leg/LF/hip/command"]
    samples = np.arange(1, 21) * 0.01
    exact = response(commands, 0.617e-3, None, samples)
    compared = {}
    for row in rows:
        if (row["method"], row["kind"]) == ("grid-held", "together"):
            step = row["step_s"]
            held = response(commands, 0.617e-3, step, samples)
            error = math.sqrt(3.0) * np.abs(held - exact).max()
            assert row["error_max_m"] == pytest.approx(error, rel=1e-6)
            compared[step] = row["error_max_m"]
    assert len(compared) == 8
    # First order: the error is the delay up to the next instant of the grid times a rate.
    assert 100.0 < compared[10e-3] / compared[0.05e-3] < 400.0


def response(commands: Any, delay: float, grid: float | None, samples: Any) -> Any:
    """Closed form of the lag under held commands, which act after a delay, on a grid if given."""
    at = np.asarray(commands.time) + delay
    if grid is not None:
        at = np.ceil(at / grid - 1e-9) * grid
    x, now, u = 0.0, 0.0, 0.0
    found = []
    changes = [*zip(at, np.asarray(commands).ravel(), strict=True), (math.inf, 0.0)]
    for sample in samples:
        while changes[0][0] <= sample + 1e-12:
            then, command = changes.pop(0)
            x, now, u = u + (x - u) * math.exp(-(then - now) / PERIOD_S), then, command
        x, now = u + (x - u) * math.exp(-(sample - now) / PERIOD_S), sample
        found.append(x)
    return np.array(found)
