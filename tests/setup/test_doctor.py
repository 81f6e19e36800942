"""The doctor names what is missing, and the front door stops before anything is half done."""

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NEEDED = ["scram", "setup", "pyproject.toml", "requirements.lock"]


@pytest.fixture(scope="module")
def doctor():
    spec = importlib.util.spec_from_file_location("doctor", ROOT / "setup" / "doctor.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def checkout(tmp_path):
    """A copy of the front door, without an environment, in a folder with a space in its name."""
    folder = tmp_path / "a copy"
    folder.mkdir()
    for name in NEEDED:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, folder / name)
    return folder


def scram(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Start the front door of a copy, with this Python, and without leave to install anything."""
    environment = {"PATH": os.environ["PATH"], "HOME": str(folder), "SCRAM_APT": "no", "SCRAM_PYTHON": sys.executable}
    return subprocess.run([folder / "scram", *words], env=environment, capture_output=True, text=True, check=False)


def write_program(file: Path, body: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"#!/bin/sh\n{body}\n")
    file.chmod(0o755)


def with_missing_library(folder: Path, need: str) -> None:
    table = folder / "setup" / "system-libraries.txt"
    table.write_text(f"# a comment\nlibc.so.6 libc6 meshes\nlibnowhere.so.7 libnowhere7 {need}\n")


def test_only_the_missing_library_is_named(doctor, tmp_path):
    table = tmp_path / "table.txt"
    table.write_text("# a comment\nlibc.so.6 libc6 meshes\nlibnowhere.so.7 libnowhere7 pictures\n")
    assert doctor.missing_libraries(table) == [("pictures", "libnowhere.so.7", "libnowhere7")]


def test_every_line_of_the_table_is_complete():
    lines = (ROOT / "setup" / "system-libraries.txt").read_text().splitlines()
    rows = [line.split() for line in lines if not line.startswith("#")]
    assert rows
    assert all(len(row) == 3 and row[2] in ("meshes", "pictures") for row in rows)


def test_check_fails_only_for_what_numbers_need(doctor, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(doctor, "rendering", lambda: "no")
    table = tmp_path / "table.txt"
    for need, code in (("pictures", 0), ("meshes", 2)):
        table.write_text(f"libnowhere.so.7 libnowhere7 {need}\n")
        assert doctor.check(table) == code
        assert "libnowhere.so.7 (libnowhere7)" in capsys.readouterr().out


def test_drawing_that_dies_is_a_no(doctor, monkeypatch, tmp_path):
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "python").symlink_to(sys.executable)
    (tmp_path / "stamp").touch()
    monkeypatch.setattr(doctor, "ENVIRONMENT", tmp_path)
    monkeypatch.setattr(doctor, "STAMP", tmp_path / "stamp")
    monkeypatch.setattr(doctor, "DRAW", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    assert doctor.rendering().startswith("no (drawing ended with -11)")


@pytest.mark.skipif(sys.platform != "linux", reason="the table of libraries is Linux's")
@pytest.mark.parametrize("command", ["setup", "run", "test", "fea"])
def test_a_missing_library_stops_the_set_up(checkout, command):
    with_missing_library(checkout, "meshes")
    outcome = scram(checkout, command)
    assert outcome.returncode == 2
    assert "libnowhere" in outcome.stderr
    assert not (checkout / ".venv").exists()
    assert not (checkout / ".tools").exists()


def scram_with_tools(checkout: Path, tools: Path) -> subprocess.CompletedProcess[str]:
    """Start the front door where the path holds the shell's own tools, apt-get and nothing else."""
    tools.mkdir(exist_ok=True)
    for name in ["dirname", "readlink", "id", "sed", "paste", "apt-get", "sh"]:
        (tools / name).symlink_to(shutil.which(name) or "/bin/true")
    command = ["/bin/sh", checkout / "scram", "run"]
    outcome = subprocess.run(command, env={"PATH": str(tools)}, capture_output=True, text=True, check=False)
    assert outcome.returncode == 2
    assert outcome.stderr.count("\n") == 1
    assert sorted(path.name for path in checkout.iterdir()) == sorted(NEEDED)
    return outcome


def test_without_python_one_line_says_what_to_do(checkout, tmp_path):
    outcome = scram_with_tools(checkout, tmp_path / "tools")
    assert "apt-get install -y python3-venv libgl1 " in outcome.stderr


def test_an_unfit_python_is_named(checkout, tmp_path):
    (tmp_path / "tools").mkdir()
    write_program(tmp_path / "tools" / "python3", '[ "$1" = -V ] && echo Python 3.10.4')
    outcome = scram_with_tools(checkout, tmp_path / "tools")
    assert "Python 3.11, 3.12 or 3.13 is needed, and python3 is Python 3.10.4" in outcome.stderr


@pytest.mark.parametrize("words", [[], ["--help"], ["-h"], ["help"]])
def test_help_needs_nothing(checkout, words):
    outcome = scram(checkout, *words)
    assert outcome.returncode == 0
    assert "usage: ./scram COMMAND" in outcome.stdout
    assert not (checkout / ".venv").exists()


def test_the_stamp_follows_the_lock_and_the_folder(doctor, checkout):
    def stamp() -> str:
        command = [sys.executable, "-I", checkout / "setup" / "doctor.py", "stamp"]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    before = stamp()
    assert before == stamp()
    assert str(checkout) in before
    with (checkout / "requirements.lock").open("a") as lock:
        lock.write("\n")
    assert stamp() != before


@pytest.mark.parametrize(
    ("words", "handed_over"),
    [
        ("run", "-P -m pipeline run {root}/config/quick.yaml"),
        ("run --cores 2", "-P -m pipeline run {root}/config/quick.yaml --cores 2"),
        ("run my.yaml --cores 2", "-P -m pipeline run my.yaml --cores 2"),
        ("run --cores 2 my.yaml", "-P -m pipeline run --cores 2 my.yaml"),
        ("run mine", "-P -m pipeline run mine"),
        ("test", "-m pytest"),
        ("test -k word tests/fea", "-m pytest -k word tests/fea"),
        ("test -x --slow", "-m pytest -m slow or not slow -x"),
        ("fea --help", "-P -m pipeline fea --help"),
        ("check my.yaml", "-P -m pipeline check my.yaml"),
    ],
)
def test_words_are_handed_over(checkout, words, handed_over):
    # A finished environment whose Python only repeats what it is told.
    write_program(
        checkout / ".venv" / "bin" / "python",
        'for last; do :; done\ncase $last in stamp) echo made ;; missing) ;; *) echo "$@" ;; esac',
    )
    (checkout / ".venv" / "scram-stamp").write_text("made\n")
    outcome = scram(checkout, *words.split())
    assert outcome.returncode == 0, outcome.stderr
    assert outcome.stdout.strip() == handed_over.format(root=checkout)
