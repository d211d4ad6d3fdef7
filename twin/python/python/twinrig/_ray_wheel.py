"""The package of this process as a wheel, for the workers of a cluster."""

from __future__ import annotations

import base64
import hashlib
import io
import sysconfig
import zipfile
from pathlib import Path

import twinrig


def wheel() -> bytes:
    """Return a wheel of the package as it was imported, be it installed or in a source folder.

    It names no dependency: NumPy is what the workers have.
    """
    package = Path(twinrig.__file__).parent
    version = twinrig.__version__
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    info = f"twinrig-{version}.dist-info"
    files = {
        path.relative_to(package.parent).as_posix(): path.read_bytes()
        for path in sorted(package.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    }
    files[f"{info}/METADATA"] = (
        f"Metadata-Version: 2.1\nName: twinrig\nVersion: {version}\n"
    ).encode()
    files[f"{info}/WHEEL"] = (
        "Wheel-Version: 1.0\nGenerator: twinrig\nRoot-Is-Purelib: false\n"
        f"Tag: cp310-abi3-{platform}\n"
    ).encode()
    record = "".join(f"{name},{_digest(data)},{len(data)}\n" for name, data in files.items())
    files[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return written.getvalue()


def _digest(data: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest())
    return f"sha256={digest.rstrip(b'=').decode()}"
