"""The packages of the workspace as cargo describes them: sources, tests, features, dependants."""

import json
import subprocess
from pathlib import Path

from . import sites

# Their tests take minutes to build or to run.
SLOW = {"twinrig", "twinrig-experiment", "twinrig-lcp", "twinrig-tests"}
# Tests of documents, which know all packages.
NOT_RUN = {("twinrig-tests", "text")}


def lines(path):
    files = [path] if path.is_file() else path.rglob("*.rs")
    return sum(file.read_text().count("\n") for file in files)


class Workspace:
    """The packages of a folder, with the arguments of the command."""

    def __init__(self, folder, arguments):
        found = subprocess.run(
            ["cargo", "metadata", "--format-version=1", "--no-deps", "--offline"],
            cwd=folder, check=True, stdout=subprocess.PIPE, text=True,
        )
        self.packages = {package["name"]: package for package in json.loads(found.stdout)["packages"]}
        self.folders = {
            name: Path(package["manifest_path"]).parent for name, package in self.packages.items()
        }
        self.arguments = arguments
        self.broken = set()

    def sources(self, name):
        return sites.sources(self.folders[name] / "src")

    def crate_of(self, file):
        return next(name for name, folder in self.folders.items() if folder in file.parents)

    def programs(self, name):
        """Test programs of a package: unit tests, tests by their length, documentation."""
        units, tests, documentation = [], [], []
        for target in self.packages[name]["targets"]:
            kind, path = target["kind"][0], Path(target["src_path"])
            if target["test"] and kind == "test":
                length = lines(path.parent if path.name == "main.rs" else path)
                tests.append((length, target["name"]))
            elif target["test"] and kind not in ("bench", "example"):
                units.append(f"bin {target['name']}" if kind == "bin" else "lib")
            documentation += ["doc"] if target["doctest"] else []
        programs = units + [program for _, program in sorted(tests)] + documentation
        return [program for program in programs if (name, program) not in NOT_RUN]

    def order(self, name):
        """The package, and those that depend on it: nearest and smallest first, slow ones last."""
        distances, wave = {name: 0}, [name]
        while wave:
            wave = [
                other for other, package in self.packages.items() if other not in distances
                and any(dependency["name"] in wave for dependency in package["dependencies"])
            ]
            distances |= dict.fromkeys(wave, max(distances.values()) + 1)
        return sorted(distances, key=lambda other: (
            other != name, other in SLOW, distances[other], lines(self.folders[other])
        ))

    def features(self, name, crate):
        """Those asked for, and those that bear the name of the crate, as engines do."""
        named = [
            f"{name}/{feature}" for feature in self.packages[name]["features"]
            if crate == f"twinrig-{feature}"
        ]
        return named + [one for one in self.arguments.features if one.startswith(f"{name}/")]

    def unified(self):
        """Manifest of a package that depends on all that the workspace depends on: what is built
        beside it has the features, and so the dependencies, that it has in a build of all."""
        merged = {}
        for package in self.packages.values():
            for one in package["dependencies"]:
                path, key = one.get("path"), (one["target"], one["rename"] or one["name"])
                source = {"path": path} if path else {"version": one["req"], "package": one["name"]}
                entry = merged.setdefault(key, source | {"features": [], "default-features": False})
                entry["features"] = sorted({*entry["features"], *one["features"]})
                entry["default-features"] |= one["uses_default_features"]
        text = '[package]\nname = "unified"\nversion = "0.0.0"\nedition = "2024"\n'
        text += '[[bin]]\nname = "unified"\npath = "main.rs"\ntest = false\n'
        for (target, name), entry in sorted(merged.items(), key=str):
            text += f"[target.{json.dumps(target)}." if target else "["
            text += f"dependencies.{name}]\n"
            text += "".join(f"{key} = {json.dumps(value)}\n" for key, value in entry.items())
        return text
