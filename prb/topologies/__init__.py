"""Declared topologies that ship with the project, one YAML file each."""

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

from prb.declaration import Declaration, DeclaredParameter, Parameter, read_declaration

#: A kind of mechanism.
Topology = Declaration
_FOLDER = Path(__file__).parent


@cache
def _shipped(name: str) -> Declaration:
    return read_declaration(_FOLDER / f"{name}.yaml")


class _Shipped(Mapping[str, Declaration]):
    """Read when asked for; a declaration stands for itself, so that a model's topology may be looked up too."""

    def __getitem__(self, name: "str | Declaration") -> Declaration:
        if isinstance(name, Declaration):
            return name
        if name not in list(self):
            raise KeyError(name)
        return _shipped(name)

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(path.stem for path in _FOLDER.glob("*.yaml")))

    def __len__(self) -> int:
        return len(list(iter(self)))


#: Every shipped topology by the name that a study uses.
TOPOLOGIES = _Shipped()


def topology(written: str, beside: Path) -> Declaration:
    """Topology that a study names: a shipped one, or a YAML file beside the study.

    Raises
    ------
    ValueError
        In one line, where there is none or its file is wrong.
    """
    if written in TOPOLOGIES:
        return TOPOLOGIES[written]
    if Path(written).suffix in (".yaml", ".yml"):
        return read_declaration(beside / written)
    raise ValueError(f"there is no topology {written!r}; there are {', '.join(TOPOLOGIES)}, or a file 'NAME.yaml'")


__all__ = ["TOPOLOGIES", "DeclaredParameter", "Parameter", "Topology", "topology"]
