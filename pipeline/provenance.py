"""Where a result comes from: sources, versions, machine."""

import hashlib
import importlib.metadata
import platform
import subprocess
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("gmsh", "h5py", "meshio", "mujoco", "numba", "numpy", "pypardiso", "scikit-fem", "scipy", "snakemake")


@cache
def source_hash(*names: str) -> str:
    """SHA-256 (16 digits) over the source of packages and modules, so that an edited kernel re-runs its samples.

    Parameters
    ----------
    names
        Import names, as ``fea`` or ``results.store``.  Data files of a package count.
    """
    digest = hashlib.sha256()
    for name in names:
        place = ROOT.joinpath(*name.split("."))
        files = (
            [place.with_suffix(".py")] if not place.is_dir() else sorted(f for f in place.rglob("*") if _is_source(f))
        )
        for file in files:
            digest.update(f"{file.relative_to(ROOT)}\0".encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _is_source(path: Path) -> bool:
    return path.is_file() and path.suffix in {".py", ".json", ".csv", ".yaml", ".jinja"}


@cache
def versions() -> dict[str, str]:
    """Versions of the packages that a number can depend on."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


@cache
def git_state() -> tuple[str, bool]:
    """Commit and whether the tree differs from it; ``unknown`` outside a git checkout."""
    try:
        commit = _git("rev-parse", "HEAD")
        return commit, bool(_git("status", "--porcelain"))
    except (OSError, subprocess.CalledProcessError):
        return "unknown", False


def _git(*words: str) -> str:
    done = subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def provenance(sources: tuple[str, ...]) -> dict[str, object]:
    """What is stored with every result."""
    commit, dirty = git_state()
    return {
        "source_hash": source_hash(*sources),
        "git_commit": commit,
        "git_dirty": dirty,
        "versions": versions(),
        "platform": platform.platform(),
    }
