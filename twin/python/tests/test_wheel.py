"""The installed module keeps what its platform tag promises."""

from __future__ import annotations

import os
import re
from importlib.metadata import distribution
from pathlib import Path

import pytest
from twinrig import _native


def test_platform_tag_names_the_newest_glibc_that_the_module_needs() -> None:
    wheel = distribution("twinrig").read_text("WHEEL") or ""
    if "-linux_" in wheel:
        assert not os.environ.get("CI"), "the wheel is for this machine only"
        pytest.skip("`pip install .` builds for this machine only")
    tag = re.search(r"^Tag: cp310-abi3-manylinux_(\d+)_(\d+)_\w+$", wheel, re.MULTILINE)
    assert tag, wheel
    promised = (int(tag[1]), int(tag[2]))
    # The module, and the library of FMUs where the wheel has it.
    for path in Path(_native.__file__ or "").parent.glob("*.so"):
        versions = re.findall(rb"\0GLIBC_(\d+)\.(\d+)(?:\.\d+)?(?=\0)", path.read_bytes())
        needed = max((int(major), int(minor)) for major, minor in versions)
        assert needed <= promised, f"{path} needs glibc {needed}, the tag promises {promised}"


@pytest.mark.parametrize("library", [b"libpython", b"libmujoco"])
def test_nothing_of_the_package_links(library: bytes) -> None:
    libraries = list(Path(_native.__file__ or "").parent.glob("*.so"))
    assert libraries
    for path in libraries:
        assert library not in path.read_bytes(), path
