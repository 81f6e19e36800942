"""The rooms import each other as the table in the README says, and gmsh stays in one of them."""

import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LINT = [str(Path(sys.executable).with_name("lint-imports")), "--no-cache", "--config"]


def lint_imports(config: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*LINT, str(config)], cwd=folder, capture_output=True, text=True, check=False)


def test_rooms_import_only_what_they_may():
    outcome = lint_imports(ROOT / "pyproject.toml", ROOT)
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr


def test_a_forbidden_import_is_noticed(tmp_path):
    for room, line in {"fea": "import prb", "prb": "import numpy", "lab": "import gmsh"}.items():
        (tmp_path / room).mkdir()
        (tmp_path / room / "__init__.py").write_text(line + "\n")
    config = tmp_path / "contracts.toml"
    rules = [("fea", "prb", "no prb in fea"), ("lab", "gmsh", "no gmsh in lab"), ("prb", "fea", "no fea in prb")]
    config.write_text(
        '[tool.importlinter]\nroot_packages = ["fea", "prb", "lab"]\ninclude_external_packages = true\n'
        + "".join(
            f'[[tool.importlinter.contracts]]\nname = "{name}"\ntype = "forbidden"\n'
            f'source_modules = ["{source}"]\nforbidden_modules = ["{target}"]\n'
            for source, target, name in rules
        )
    )
    outcome = lint_imports(config, tmp_path)
    assert outcome.returncode == 1
    assert "no prb in fea BROKEN" in outcome.stdout
    assert "no gmsh in lab BROKEN" in outcome.stdout
    assert "no fea in prb KEPT" in outcome.stdout


def test_every_packed_room_has_a_contract():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]
    rooms = set(settings["hatch"]["build"]["targets"]["wheel"]["packages"])
    named = {room for contract in settings["importlinter"]["contracts"] for room in contract["source_modules"]}
    assert set(settings["importlinter"]["root_packages"]) == rooms
    assert named | {"pipeline"} == rooms
