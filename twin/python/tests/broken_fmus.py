"""Broken FMUs: archives with one mistake each, and a part of the message that names it."""

from __future__ import annotations

import io
import stat
import struct
import warnings
import zipfile
from collections.abc import Iterator, Sequence

from fmus import LAG_2, LAG_3, LIBRARY_2, LIBRARY_3, library

DESCRIPTION = "modelDescription.xml"

def _archive(entries: Sequence[tuple[str | zipfile.ZipInfo, str | bytes]]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in entries:
            file.writestr(name, content)
    return buffer.getvalue()


def _sound(description: str = LAG_2, **options: str) -> list[tuple[str, bytes]]:
    return [(DESCRIPTION, description.encode()), (LIBRARY_2, library("lag2.c", **options))]


def _with(name: str | zipfile.ZipInfo, content: str | bytes = b"") -> bytes:
    return _archive([*_sound(), (name, content)])


def _described(old: str, new: str) -> bytes:
    assert old in LAG_2
    return _archive([*_sound(LAG_2.replace(old, new, 1))])


def _described_3(old: str, new: str) -> bytes:
    assert old in LAG_3
    description = LAG_3.replace(old, new, 1)
    return _archive([(DESCRIPTION, description), (LIBRARY_3, library("lag3.c"))])


def _raw(description: bytes | str) -> bytes:
    return _archive([(DESCRIPTION, description), *_sound()[1:]])


def _link() -> bytes:
    info = zipfile.ZipInfo("resources/link")
    info.create_system = 3
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    return _with(info, "/etc/passwd")


def _bomb() -> bytes:
    return _with("resources/zeros", bytes(300 << 20))


def _encrypted() -> bytes:
    data = bytearray(_with("resources/secret", b"secret"))
    place = data.rfind(b"PK\x01\x02")
    data[place + 8] |= 1
    return bytes(data)


def _damaged() -> bytes:
    # A wrong checksum of the description in the table of contents.
    data = bytearray(_archive([*_sound()]))
    place = data.find(b"PK\x01\x02")
    data[place + 16 : place + 20] = struct.pack("<I", 1)
    return bytes(data)


def _twice() -> bytes:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return _archive([*_sound(), _sound()[0]])


def _exchange() -> bytes:
    variable = ' canHandleVariableCommunicationStepSize="true"'
    description = LAG_2.replace("<CoSimulation", "<ModelExchange").replace(variable, "")
    return _archive([*_sound(description)])


def _laughs() -> str:
    entities = ['<!ENTITY a0 "ha">']
    entities += [f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 10)]
    return f"<!DOCTYPE bomb [{''.join(entities)}]><bomb>&a9;</bomb>"


_EXTERNAL = '<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]><x>&e;</x>'
_REAL = '<Real start="0" unit="mm"/>'
_COUNT = 'name="count" valueReference="0" causality="output" variability="discrete"'
_START = "<ModelVariables>"


def broken() -> Iterator[tuple[str, bytes, str]]:
    """Name, content and expected part of the message of each."""
    whole = _archive([*_sound()])
    yield "empty-file", b"", "not a ZIP archive"
    yield "not-a-zip", b"This is no archive, but a text.\n" * 9, "not a ZIP archive"
    yield "truncated", whole[: len(whole) // 2], "not a ZIP archive"
    yield "damaged", _damaged(), "damaged"
    yield "no-description", _archive([*_sound()][1:]), "has no `modelDescription.xml`"
    yield "no-binaries", _archive([*_sound()][:1]), "no binaries"
    yield "other-platform", _archive(
        [*_sound()[:1], ("binaries/win64/lag.dll", b"MZ")]
    ), "no binary for linux64: it has win64"
    yield "missing-binary", _archive(
        [*_sound()[:1], ("binaries/linux64/other.so", b"")]
    ), "no library `binaries/linux64/lag.so`"
    yield "parent-folder", _with("../outside.txt", "out"), "leads out"
    yield "deep-parent-folder", _with("resources/../../outside.txt", "out"), "leads out"
    yield "absolute-path", _with("/tmp/outside.txt", "out"), "leads out"
    yield "backslashes", _with("..\\outside.txt", "out"), "leads out"
    yield "drive", _with("C:/outside.txt", "out"), "leads out"
    yield "symbolic-link", _link(), "symbolic link"
    yield "bomb", _bomb(), "would extract to"
    yield "encrypted", _encrypted(), "encrypted"
    yield "twice", _twice(), "twice"
    yield "entity-bomb", _raw(_laughs()), "document type"
    yield "external-entity", _raw(_EXTERNAL), "document type"
    yield "not-xml", _raw("fmiModelDescription: none"), "not well-formed"
    yield "other-xml", _raw("<html/>"), "cannot be read"
    yield "wrong-token", _described('guid="lag"', 'guid="other"'), "returned no instance"
    yield "fmi-1", _described('fmiVersion="2.0"', 'fmiVersion="1.0"'), "FMI 1.0 is not supported"
    yield "fmi-99", _described('fmiVersion="2.0"', 'fmiVersion="99"'), "FMI 99 is not supported"
    yield "no-identifier", _described('modelIdentifier="lag"', ""), "modelIdentifier"
    yield "identifier-with-slash", _described(
        'modelIdentifier="lag"', 'modelIdentifier="../../lag"'
    ), "no identifier"
    yield "model-exchange", _exchange(), "no co-simulation interface: model exchange only"
    yield "start-nan", _described(_REAL, _REAL.replace('"0"', '"NaN"')), "not a finite number"
    yield "start-huge", _described(_REAL, _REAL.replace('"0"', '"1e999"')), "not a finite number"
    yield "start-text", _described(_REAL, _REAL.replace('"0"', '"zero"')), "zero"
    yield "no-start", _described(_REAL, '<Real unit="mm"/>'), "no start value"
    yield "unknown-unit", _described(_REAL, '<Real start="0" unit="furlong"/>'), "furlong"
    yield "unit-of-itself", _described(
        '<BaseUnit m="1" factor="0.001"/>', '<BaseUnit mm="1" factor="0.001"/>'
    ), "mm"
    yield "unit-of-nan", _described('factor="0.001"', 'factor="NaN"'), "`mm`"
    yield "unit-of-zero", _described('factor="0.001"', 'factor="0"'), "`mm`"
    yield "same-names", _described('name="gain"', 'name="u"'), "not unique"
    yield "reference-of-text", _described('valueReference="3"', 'valueReference="three"'), "three"
    yield "no-reference", _described(' valueReference="3"', ""), "valueReference"
    yield "wrong-causality", _described('causality="input"', 'causality="effect"'), "effect"
    yield "no-causality", _described(_COUNT, _COUNT.replace('causality="output" ', "")), "`count`"
    yield "no-variables", _described(_START, "<Model>"), "not well-formed"
    yield "not-a-library", _archive(
        [*_sound()[:1], (LIBRARY_2, b"\x7fELF, but no more than that")]
    ), "cannot be loaded"
    yield "no-functions", _archive([*_sound()[:1], (LIBRARY_2, library("empty.c"))]), "no function"
    yield "abort-on-load", _archive(_sound(fault="ABORT_ON_LOAD")), "SIGABRT"
    yield "no-instance", _archive(_sound(fault="NO_INSTANCE")), "returned no instance"
    yield "no-initialization", _archive(
        _sound(fault="NO_INITIALIZATION")
    ), "`fmi2ExitInitializationMode` failed"
    yield "negative-dimension", _described_3('start="3"', 'start="-3"'), ""
    yield "huge-dimension", _described_3('start="3"', 'start="99999999999"'), "dimension"
    yield "no-dimension", _described_3('<Dimension start="3"/>', "<Dimension/>"), ""
    yield "clock", _described_3(
        '<Int32 name="events"', '<Clock name="tick" valueReference="9" causality="input"'
        ' intervalVariability="triggered"/><Int32 name="events"'
    ), "clock"
