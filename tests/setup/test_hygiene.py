"""No file of the project names a machine, a home folder or a package registry."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# Written in pieces, so that this file passes its own test.
HOSTS = ["py" + "pi.org", "python" + "hosted.org", "debian" + ".org", "ana" + "conda.org", "npm" + "js.org"]
FOLDERS = [r"/ho" + r"me/\w", r"/Us" + r"ers/\w", r"/ro" + r"ot/\w", r"(?<![\w.])/wo" + r"rk/\w"]
CHECKOUT = [re.escape(str(ROOT)) + r"\b"] if len(ROOT.parts) > 2 else []  # "/app" could be anything
PATTERN = re.compile("|".join([*map(re.escape, HOSTS), *FOLDERS, *CHECKOUT]))


def made(parts: tuple[str, ...]) -> bool:
    """Whether a path, given in parts, is something that running the project left behind."""
    hidden = any(part.startswith(".") and part not in (".ci", ".gitignore") for part in parts)
    return hidden or parts[0] == "runs" or "__pycache__" in parts


def project_files() -> list[Path]:
    """What git holds or would take, or all files but the made ones in a copy without git."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    try:
        listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
        files = [ROOT / name for name in listed.split("\0") if name]
    except (OSError, subprocess.CalledProcessError):
        files = [path for path in ROOT.rglob("*") if not made(path.relative_to(ROOT).parts)]
    return [path for path in files if path.is_file()]


def text_of(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:  # HDF5 files and pictures: their readable strings count too
        return path.read_bytes().decode("latin-1")


def test_no_file_names_a_machine_or_a_registry():
    found = [(path, hit.group()) for path in project_files() for hit in PATTERN.finditer(text_of(path))]
    assert not found


@pytest.mark.parametrize("text", ["see https://py" + "pi.org/x", "/ho" + "me/someone/x"])
def test_the_pattern_finds_them(text):
    assert PATTERN.search(text)
