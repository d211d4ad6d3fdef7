"""Fetches FMUs made by others, for tests of the Python package: they are in source packages.

    python ci/fmus.py FOLDER

Where all are there it does nothing, and needs no network. The packages come from the index that pip
is configured for; they are not built, since their builds need more than these files.
"""

import hashlib
import io
import pathlib
import sys
import tarfile

# Package, version, checksum of the source package, and files: path in it, name in the folder.
PACKAGES = [
    (
        "sim_explorer",
        "0.2.2",
        "532a733289754bf9e3f046a6e48841d624e0ef7c002c390deae2e2f1d5f81666",
        {
            "tests/data/BouncingBall0/BouncingBall.fmu": "reference-ball.fmu",
            "tests/data/BouncingBall3D/BouncingBall3D.fmu": "needs-packages.fmu",
            "tests/data/identity.fmu": "fmi1.fmu",
        },
    ),
    (
        "PyFMI",
        "2.5",
        "f0485f786a40448c8ffb9e2b03a587d84cd1fe403c1056f50ab787de18f8ba0b",
        {
            "src/pyfmi/examples/files/FMUs/CS2.0/bouncingBall.fmu": "sdk-ball.fmu",
            "src/pyfmi/examples/files/FMUs/ME2.0/bouncingBall.fmu": "model-exchange.fmu",
        },
    ),
]


def source(package: str, version: str, checksum: str) -> bytes:
    """Source package from the index of pip."""
    # `pip download` would build its metadata; these parts of pip find and fetch only.
    from pip._internal.commands import create_command
    from pip._vendor.packaging.specifiers import SpecifierSet

    command = create_command("download")
    options, _ = command.parse_args(["--no-deps", "--no-binary", ":all:", package])
    with command.main_context():
        session = command.get_default_session(options)
        finder = command._build_package_finder(options, session)
        best = finder.find_best_candidate(package, SpecifierSet(f"=={version}")).best_candidate
        if best is None:
            sys.exit(f"ci/fmus.py: the package index has no source of {package} {version}")
        response = session.get(best.link.url_without_fragment)
        response.raise_for_status()
    if hashlib.sha256(response.content).hexdigest() != checksum:
        sys.exit(f"ci/fmus.py: {package} {version} is not the package that this was made with")
    return response.content


def main() -> None:
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for package, version, checksum, files in PACKAGES:
        if all((folder / name).exists() for name in files.values()):
            continue
        with tarfile.open(fileobj=io.BytesIO(source(package, version, checksum))) as archive:
            for path, name in files.items():
                member = archive.extractfile(f"{package}-{version}/{path}")
                assert member is not None, path
                part = folder / f"{name}.part"
                part.write_bytes(member.read())
                part.rename(folder / name)


if __name__ == "__main__":
    main()
