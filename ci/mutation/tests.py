"""Tests of the workspace, crate by crate, in a copy in which single lines are altered."""

import contextlib
import fcntl
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

from .workspace import Workspace

ROOT = Path(__file__).resolve().parents[2]
COPY = Path(tempfile.gettempdir()) / f"twin-mutants-{zlib.crc32(str(ROOT).encode()):08x}"
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()
# As in ci/test; intermediate results make the next build of a crate short.
ENVIRONMENT = {
    "CI": "1", "PROPTEST_RNG_SEED": "26", "CARGO_PROFILE_DEV_DEBUG": "0", "CARGO_INCREMENTAL": "1",
} | os.environ | {"CARGO_TARGET_DIR": str(TARGET), "LD_LIBRARY_PATH": str(COPY / "vendor/lib")}
MUTANT_S, FULL_MUTANT_S, HANG_S, STOPPED_S = 600, 3600, 300, 10
MEMORY_BYTES, FILE_BYTES = 8 << 30, 4 << 30


class Clock:
    """Seconds in which this program was not stopped."""

    def __init__(self):
        self.stopped, self.last = 0.0, time.monotonic()

    def now(self):
        """To be read every second while something runs."""
        now = time.monotonic()
        self.stopped += now - self.last if now - self.last > STOPPED_S else 0
        self.last = now
        return now - self.stopped


clock = Clock()


def note(text):
    print(f"ci/mutants: {text}", file=sys.stderr, flush=True)


def git(*arguments, folder=COPY):
    done = subprocess.run(["git", *arguments], cwd=folder, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"ci/mutants: git {' '.join(arguments)} failed")
    return done.stdout


def prepare(commit, arguments):
    """The copy as of a commit, and its workspace. Files that are the same keep their age, so that
    little is built anew."""
    lock = open(f"{COPY}.lock", "w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        sys.exit(f"ci/mutants: another one runs in {COPY}")
    git("worktree", "prune", folder=ROOT)
    if not (COPY / ".git").exists():
        git("worktree", "add", "--quiet", "--force", "--detach", str(COPY), commit, folder=ROOT)
    # Of an unaltered file git learns here that its new time means nothing.
    git("status", "--porcelain")
    git("checkout", "--quiet", "--force", "--detach", commit)
    clean()
    TARGET.mkdir(parents=True, exist_ok=True)
    (ROOT / "target").mkdir(exist_ok=True)
    for place in ["target", *(f"vendor/lib/{file.name}" for file in ROOT.glob("vendor/lib/*.so*"))]:
        if not (COPY / place).is_symlink():
            (COPY / place).symlink_to(ROOT / place)
    subprocess.run(["cargo", "fetch", "--locked", "--quiet"], cwd=COPY, check=True)
    workspace = Workspace(COPY, arguments)
    workspace.lock = lock
    (COPY / "unified").mkdir(exist_ok=True)
    (COPY / "unified/main.rs").write_text("fn main() {}\n")
    (COPY / "unified/Cargo.toml").write_text(workspace.unified())
    manifest = (COPY / "Cargo.toml").read_text()
    (COPY / "Cargo.toml").write_text(manifest.replace("members = [", 'members = ["unified", ', 1))
    return workspace


def build(workspace):
    """Builds all tests, which crates share as they are built one by one."""
    profile = workspace.arguments.profile
    command = ["cargo", "test", "--workspace", "--no-run", "--offline"]
    status, text = run([*command, *(["--profile", profile] if profile else [])], FULL_MUTANT_S)
    if status != 0:
        sys.exit(f"ci/mutants: the tests do not build:\n{text[-2000:]}")


def clean():
    """Takes back what tests have left in the copy."""
    changed = git("diff", "--name-only", "--", ".", ":!Cargo.lock", ":!Cargo.toml").split()
    if changed:
        git("checkout", "--quiet", "--", *changed)
    git("clean", "-fdq", "-e", "/target", "-e", "/unified")


@contextlib.contextmanager
def mutated(path, text):
    """Alters a file of the copy. Afterwards it is as old as before, and what was built meanwhile is
    forgotten, so that cargo builds this anew and nothing else."""
    before, status = path.read_bytes(), path.stat()
    path.write_text(text)
    since = path.stat().st_mtime_ns
    try:
        yield
    finally:
        path.write_bytes(before)
        for stamp in TARGET.glob("*/.fingerprint/*/invoked.timestamp"):
            if stamp.stat().st_mtime_ns >= since:
                shutil.rmtree(stamp.parent)
        os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
        clean()


def limit_resources():
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_BYTES, FILE_BYTES))


def failed_test(text):
    found = re.search(r"^test (.+?)(?: - should panic)? \.\.\. FAILED$", text, re.M)
    return found and found[1]


def run(command, seconds):
    """Status and output of a command, up to its first test that fails; without a status at the end
    of its time. Its processes end with it."""
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(
            command, cwd=COPY, env=ENVIRONMENT, stdin=subprocess.DEVNULL, stdout=output,
            stderr=output, start_new_session=True, preexec_fn=limit_resources,
        )
        end, status, text = clock.now() + seconds, None, ""
        try:
            while status is None and clock.now() < end and not failed_test(text):
                with contextlib.suppress(subprocess.TimeoutExpired):
                    status = process.wait(0.2)
                text = os.pread(output.fileno(), 1 << 24, 0).decode(errors="replace")
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        return 1 if failed_test(text) else status, text


class Trial:
    """The tests of an alteration of a crate, within its time."""

    def __init__(self, workspace, crate):
        self.workspace, self.crate = workspace, crate
        self.full = workspace.arguments.full
        self.ran = []
        self.end = clock.now() + (FULL_MUTANT_S if self.full else MUTANT_S)

    def left(self):
        return max(0, self.end - clock.now())

    def cargo(self, package, program, *words):
        kind, _, name = program.rpartition(" ")
        flags = [f"--{program}"] if program in ("lib", "doc") else [f"--{kind or 'test'}", name]
        profile, features = self.workspace.arguments.profile, self.workspace.features(package, self.crate)
        flags += ["--profile", profile] if profile else []
        flags += ["--features", ",".join(features)] if features else []
        return ["cargo", "test", "--offline", "-p", package, "-p", "unified", *flags, *words]

    def builds(self, package, program):
        """Documentation is built as its tests run."""
        if program == "doc":
            return True
        status, text = run(self.cargo(package, program, "--no-run"), self.left())
        if status:
            note(f"{package} {program} does not compile: {re.findall('^error.*', text, re.M)[:1]}")
        return not status

    def fails(self, package, program, test=""):
        """The test that fails, empty where the program ends without one; None if all pass. One that
        hangs fails."""
        known = [name for *place, name in self.workspace.broken if place == [package, program]]
        # rustdoc would split the names of its tests.
        named = program != "doc"
        words = [test] if test and named else [word for name in known if named
                                               for word in ("--skip", name) if name]
        words += ["--exact"] if words else []
        words += ["--include-ignored"] if self.full else []
        command = self.cargo(package, program, "--", *words)
        status, text = run(command, min(HANG_S, self.left()))
        if status == 0 or "error: could not compile" in text or not status and self.left() == 0:
            return None
        running = re.findall(r"^test (.+) has been running for", text, re.M)
        found = failed_test(text) or test or (running[-1] if running else "")
        return None if found in known else found

    def killer(self, package, program):
        """The first test of a program that fails, alone too where it ends."""
        begin = clock.now()
        while (test := self.fails(package, program)) is not None:
            whole = not test or program == "doc" or clock.now() - begin >= HANG_S
            if whole or self.fails(package, program, test) is not None:
                return package, program, test
            note(f"{package} {program} {test} passes alone")
            self.workspace.broken.add((package, program, test))
        return None

    def search(self):
        """The first test that fails, as package, program and name; None, and False if the crate
        does not compile."""
        for package in self.workspace.order(self.crate):
            programs = self.workspace.programs(package)
            for program in programs:
                if not self.builds(package, program):
                    if package == self.crate:
                        return False
                elif self.left() and (killer := self.killer(package, program)):
                    return killer
                if not self.left():
                    note(f"no time is left after {package} {program}")
                    return None
            self.ran += [package] if programs else []
        return None

    def kills(self, path, text):
        """As `search`, with a file of the copy altered, of tests that pass without."""
        while True:
            with mutated(path, text):
                killer = self.search()
            if not killer:
                return killer
            self.end += MUTANT_S
            if self.fails(*killer) is None:
                return killer
            note(f"{' '.join(killer)} fails without the mutation too")
            self.workspace.broken.add(killer)
