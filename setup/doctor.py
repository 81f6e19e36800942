"""Say what this machine lacks, and whether the environment is up to date.

Only the standard library is used: this file runs before anything is installed.
"""

import argparse
import ctypes
import hashlib
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
TABLE = ROOT / "setup" / "system-libraries.txt"
ENVIRONMENT = ROOT / ".venv"
STAMP = ENVIRONMENT / "scram-stamp"
STAMPED = ("requirements.lock", "pyproject.toml", "setup/uv-requirements.txt", "setup/build-constraints.txt")
LOCK_DESCRIPTOR = 9

DRAW = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere(), color="red")
raise SystemExit(0 if plotter.screenshot(return_img=True).std() > 1 else 3)
"""


class Lack(NamedTuple):
    """Something that the system should have and has not."""

    need: str  # "setup", "meshes" or "pictures"
    thing: str
    package: str


def missing_libraries(table: Path = TABLE) -> list[Lack]:
    """Return the table's libraries that cannot be loaded here."""
    lacks = []
    for line in table.read_text(encoding="utf-8").splitlines():
        if not line or line.startswith("#"):
            continue
        soname, package, need = line.split()
        try:
            ctypes.CDLL(soname)
        except OSError:
            lacks.append(Lack(need, soname, package))
    return lacks


def missing_modules() -> list[Lack]:
    """Return the parts of Python itself that Debian packs apart."""
    if importlib.util.find_spec("ensurepip") and importlib.util.find_spec("venv"):
        return []
    return [Lack("setup", "ensurepip", f"python3.{sys.version_info.minor}-venv")]


def missing(table: Path = TABLE) -> list[Lack]:
    """Return all that is missing; the table of libraries is Linux's."""
    libraries = missing_libraries(table) if sys.platform == "linux" else []
    return missing_modules() + libraries


def stamp() -> str:
    """Return what the environment was, or would be, made from."""
    digest = hashlib.sha256()
    for name in STAMPED:
        digest.update((ROOT / name).read_bytes())
    major, minor = sys.version_info[:2]
    # A virtual environment holds absolute paths: a moved folder needs a new one.
    return f"{major}.{minor} {digest.hexdigest()} {ROOT}"


def wait_for_turn() -> None:
    """Hold the lock file that the shell opened until the shell closes it."""
    import fcntl

    try:
        fcntl.flock(LOCK_DESCRIPTOR, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        print("scram: another set-up is running in this folder; waiting for it.", file=sys.stderr)
        fcntl.flock(LOCK_DESCRIPTOR, fcntl.LOCK_EX)
    except OSError:
        pass  # a file system without locks: two set-ups at once are then the user's affair


def rendering() -> str:
    """Draw one picture in a child process, since a missing library is a segmentation fault."""
    python = ENVIRONMENT / "bin" / "python"
    if not STAMP.exists():
        return "not tried (no environment yet)"
    try:
        child = subprocess.run([python, "-c", DRAW], capture_output=True, timeout=120, check=False)
    except subprocess.TimeoutExpired:
        return "no (no answer in 120 s); reports come without 3D pictures"
    if child.returncode == 0:
        return "yes"
    return f"no (drawing ended with {child.returncode}); reports come without 3D pictures"


def memory_gib() -> float:
    """Return the machine's memory in GiB."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30


def environment_state() -> str:
    """Say whether the environment is there, from this version of the lock."""
    if not STAMP.exists():
        return "not made yet (./scram setup)"
    made_from = STAMP.read_text(encoding="utf-8").split(maxsplit=1)[1].strip()
    return "ready" if made_from == stamp().split(maxsplit=1)[1] else "stale: the next start brings it up to date"


def check(table: Path = TABLE) -> int:
    """Print a report on this machine; return 2 if the pipeline cannot run on it."""
    lacks = missing(table)
    if STAMP.exists():
        lacks = [lack for lack in lacks if lack.need != "setup"]
    free = shutil.disk_usage(ROOT).free / 2**30
    print(
        f"machine      {platform.system()} {platform.machine()}, {os.cpu_count()} cores, {memory_gib():.0f} GiB memory"
    )
    print(f"disk         {free:.0f} GiB free here")
    print(f"python       {platform.python_version()} ({sys.executable})")
    print(f"environment  {environment_state()}")
    for lack in lacks:
        print(f"missing      {lack.thing} ({lack.package}), needed for {lack.need}")
    if not lacks:
        print("libraries    all there")
    print(f"3D pictures  {rendering()}")
    if lacks:
        print("To add what is missing: " + apt_line(lacks))
    return 2 if any(lack.need != "pictures" for lack in lacks) else 0


def apt_line(lacks: list[Lack]) -> str:
    """Return the command for Debian and Ubuntu, or the bare names elsewhere."""
    if shutil.which("apt-get"):
        sudo = "sudo " if os.geteuid() else ""
        return f"{sudo}apt-get install -y " + " ".join(lack.package for lack in lacks)
    return "your system's packages that hold " + " ".join(lack.thing for lack in lacks)


def main() -> int:
    """Run one of the commands that the front door uses."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("command", choices=["check", "missing", "stamp", "wait"])
    parser.add_argument("--table", type=Path, default=TABLE, help="another list of libraries")
    options = parser.parse_args()
    if options.command == "check":
        return check(options.table)
    if options.command == "missing":
        for lack in missing(options.table):
            print(*lack)
    elif options.command == "stamp":
        print(stamp())
    else:
        wait_for_turn()
    return 0


if __name__ == "__main__":
    sys.exit(main())
