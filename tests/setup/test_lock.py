"""The lock is complete and hashed, and the README gives every direct dependency its reason."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LOCKS = ["requirements.lock", "setup/uv-requirements.txt", "setup/build-constraints.txt"]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def direct_dependencies() -> list[str]:
    wanted = PROJECT["project"]["dependencies"] + PROJECT["dependency-groups"]["dev"]
    return sorted(re.match(r"[A-Za-z0-9._-]+", line).group().lower() for line in wanted)


def locked(lock: str) -> dict[str, list[str]]:
    """Hashes by "name==version ; marker"."""
    entries = {}
    for line in (ROOT / lock).read_text().splitlines():
        words = line.removesuffix("\\").strip()
        if line.startswith("    --hash="):
            entries[name].append(words.removeprefix("--hash="))  # noqa: F821
        else:
            name = words
            entries[name] = []
    return entries


@pytest.mark.parametrize("lock", LOCKS)
def test_every_package_is_pinned_and_hashed(lock):
    entries = locked(lock)
    assert entries
    for name, hashes in entries.items():
        assert re.match(r"[a-z0-9-]+==[^ =]+( ; .+)?$", name), name
        assert hashes, name
        assert all(re.fullmatch(r"sha256:[0-9a-f]{64}", text) for text in hashes), name


@pytest.mark.parametrize("lock", LOCKS)
def test_the_lock_names_no_host(lock):
    assert "://" not in (ROOT / lock).read_text()


@pytest.mark.parametrize("dependency", direct_dependencies())
def test_direct_dependency_is_locked_and_explained(dependency):
    assert any(name.startswith(dependency + "==") for name in locked("requirements.lock"))
    rows = re.findall(rf"^\| {re.escape(dependency)} \|.*\w.*\|$", (ROOT / "README.md").read_text(), re.MULTILINE)
    assert len(rows) == 1, f"README.md should have one table row for {dependency}"
