"""Checks and extraction of the archive of an FMU.

An archive is input from outside: everything is checked against its table of contents and its
XML files before the first file is written.
"""

from __future__ import annotations

import stat
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from xml.parsers import expat

from twinrig._fmu._errors import Refusal

DESCRIPTION = "modelDescription.xml"
BUILD = "sources/buildDescription.xml"

_ENTRIES_MAX = 50_000
_BYTES_MAX = 4 << 30
_XML_BYTES_MAX = 256 << 20
# Small archives may be compressed at any ratio: tables of zeros are legitimate.
_UNSUSPECTED_BYTES = 256 << 20
_RATIO_MAX = 100

_MEGABYTE = 1 << 20

# Folders that an FMU may use while it runs.
_PARTS = ("binaries", "resources", "extra")


class Archive:
    """An archive whose table of contents has been checked."""

    def __init__(self, path: Path) -> None:
        try:
            self._zip = zipfile.ZipFile(path)
        except zipfile.BadZipFile as error:
            raise Refusal("it is not a ZIP archive, or an incomplete one") from error
        except (OSError, ValueError, NotImplementedError) as error:
            raise Refusal(f"it is not a ZIP archive: {error}") from error
        self._check_entries(path.stat().st_size)

    def close(self) -> None:
        """Close the file."""
        self._zip.close()

    def names(self) -> list[str]:
        """Names of the files."""
        return [info.filename for info in self._zip.infolist() if not info.is_dir()]

    def check_xml(self) -> str | None:
        """Refuse XML that is not well formed, or that declares entities.

        Return the version of FMI that the model description declares.
        """
        names = self.names()
        if DESCRIPTION not in names:
            raise Refusal(f"the archive has no `{DESCRIPTION}`")
        if BUILD in names:
            self._check_xml(BUILD)
        return self._check_xml(DESCRIPTION).get("fmiVersion")

    def extract(self, folder: Path, library: str) -> None:
        """Extract the files for a simulation; of the binaries those beside `library`."""
        platform = PurePosixPath(library).parent
        for info in self._zip.infolist():
            path = PurePosixPath(info.filename)
            if path.parts[0] not in _PARTS and info.filename != DESCRIPTION:
                continue
            if path.parts[0] == "binaries" and platform not in (path, *path.parents):
                continue
            try:
                self._zip.extract(info, folder)
            except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError) as error:
                raise Refusal(f"`{info.filename}` is damaged: {error}") from error
            except OSError as error:
                raise Refusal(f"`{info.filename}` cannot be extracted: {error}") from error
        # FMUs may rely on the folder of their resources.
        (folder / "resources").mkdir(exist_ok=True)

    def _check_entries(self, archive_bytes: int) -> None:
        infos = self._zip.infolist()
        if len(infos) > _ENTRIES_MAX:
            raise Refusal(f"it has {len(infos)} entries, more than {_ENTRIES_MAX}")
        seen: set[str] = set()
        for info in infos:
            _check_entry(info)
            # A directory has no contents of which one could be lost.
            if info.filename in seen and not info.is_dir():
                raise Refusal(f"`{info.filename}` is in the archive twice")
            seen.add(info.filename)
        total = sum(info.file_size for info in infos)
        suspect = total > _UNSUSPECTED_BYTES and total > _RATIO_MAX * archive_bytes
        if suspect or total > _BYTES_MAX:
            raise Refusal(
                f"its {archive_bytes / _MEGABYTE:.1f} MiB would extract to "
                f"{total / _MEGABYTE:.0f} MiB"
            )

    def _check_xml(self, name: str) -> dict[str, str]:
        """Check one file; return the attributes of its first element."""
        if self._zip.getinfo(name).file_size > _XML_BYTES_MAX:
            raise Refusal(f"`{name}` is larger than {_XML_BYTES_MAX // _MEGABYTE} MiB")
        parser = expat.ParserCreate()

        def doctype(*_: object) -> None:
            raise Refusal(f"`{name}` has a document type declaration, which FMI does not allow")

        root: dict[str, str] = {}

        def first(_: str, attributes: dict[str, str]) -> None:
            root.update(attributes)
            parser.StartElementHandler = None

        parser.StartDoctypeDeclHandler = doctype
        parser.StartElementHandler = first
        try:
            for chunk in self._chunks(name):
                parser.Parse(chunk)
            parser.Parse(b"", True)
        except expat.ExpatError as error:
            raise Refusal(f"`{name}` is not well-formed XML: {error}") from error
        return root

    def _chunks(self, name: str) -> Iterator[bytes]:
        try:
            with self._zip.open(name) as file:
                while chunk := file.read(_MEGABYTE):
                    yield chunk
        except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, OSError) as error:
            raise Refusal(f"`{name}` is damaged: {error}") from error


def _check_entry(info: zipfile.ZipInfo) -> None:
    # Names are compared as they are stored: the reader has replaced separators and cut at NUL.
    stored = info.orig_filename
    path = PurePosixPath(stored)
    outside = path.is_absolute() or ".." in path.parts or not path.parts
    if outside or "\\" in stored or "\0" in stored or ":" in path.parts[0]:
        raise Refusal(f"the entry `{_printable(stored)}` leads out of the archive")
    if stat.S_ISLNK(info.external_attr >> 16):
        raise Refusal(f"the entry `{_printable(stored)}` is a symbolic link")
    if info.flag_bits & 1:
        raise Refusal(f"the entry `{_printable(stored)}` is encrypted")


def _printable(text: str) -> str:
    return text.encode("unicode_escape").decode("ascii")[:200]
