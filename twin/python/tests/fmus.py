"""FMUs for tests: archives around descriptions and libraries that are compiled here."""

from __future__ import annotations

import functools
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

SOURCES = Path(__file__).parent / "fmu_sources"
COMPILER = shutil.which("cc")

LIBRARY_2 = "binaries/linux64/lag.so"
LIBRARY_3 = "binaries/x86_64-linux/lag.so"

LAG_2 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="lag" guid="lag">
  <CoSimulation modelIdentifier="lag" canHandleVariableCommunicationStepSize="true"
    canGetAndSetFMUstate="true" canSerializeFMUstate="true"/>
  <UnitDefinitions>
    <Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit>
    <Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>
  </UnitDefinitions>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.01"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="1" causality="input" variability="continuous">
      <Real start="0" unit="mm"/></ScalarVariable>
    <ScalarVariable name="x" valueReference="2" causality="output" variability="continuous"
      initial="calculated"><Real unit="mm"/></ScalarVariable>
    <ScalarVariable name="gain" valueReference="3" causality="parameter" variability="tunable">
      <Real start="1"/></ScalarVariable>
    <ScalarVariable name="count" valueReference="0" causality="output" variability="discrete"
      initial="calculated"><Integer/></ScalarVariable>
    <ScalarVariable name="title" valueReference="0" causality="parameter" variability="fixed">
      <String start=""/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2"/><Unknown index="4"/></Outputs></ModelStructure>
</fmiModelDescription>
"""


@functools.cache
def library(source: str = "lag2.c", fault: str = "NONE", at: float = 0.5) -> bytes:
    """Compiled library of a source."""
    assert COMPILER is not None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "lag.so")
        options = ["-shared", "-fPIC", "-O1", f"-DFAULT={fault}", f"-DAT={at}"]
        subprocess.run(
            [COMPILER, *options, str(SOURCES / source), "-o", str(path), "-lm"], check=True
        )
        return path.read_bytes()


def archive(path: Path, entries: Mapping[str, str | bytes]) -> Path:
    """Archive with these files."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in entries.items():
            file.writestr(name, content)
    return path


def lag(path: Path, fault: str = "NONE", description: str = LAG_2, at: float = 0.5) -> Path:
    """FMU of a lag of first order, that may misbehave."""
    so = library("lag2.c", fault, at)
    return archive(path, {"modelDescription.xml": description, LIBRARY_2: so})


LAG_3 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="lag" instantiationToken="lag">
  <CoSimulation modelIdentifier="lag" canHandleVariableCommunicationStepSize="true"
    canGetAndSetFMUState="true" canSerializeFMUState="true" hasEventMode="true"
    mightReturnEarlyFromDoStep="true"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="u" valueReference="1" causality="input" start="0"/>
    <Float64 name="x" valueReference="2" causality="output" initial="calculated"/>
    <Float64 name="multiples" valueReference="3" causality="output" initial="calculated">
      <Dimension start="3"/></Float64>
    <Int32 name="events" valueReference="4" causality="output" variability="discrete"
      initial="calculated"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="2"/><Output valueReference="3"/><Output valueReference="4"/>
  </ModelStructure>
</fmiModelDescription>
"""


def lag3(path: Path, fault: str = "NONE", description: str = LAG_3) -> Path:
    """FMU of FMI 3.0 of a lag with events, that may misbehave."""
    return archive(
        path, {"modelDescription.xml": description, LIBRARY_3: library("lag3.c", fault)}
    )
