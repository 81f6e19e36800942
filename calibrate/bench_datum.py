"""A record of a known kind of bench, as the fits of hinges and of paddlers take it."""

from dataclasses import dataclass
from typing import Any, ClassVar

from pydantic import TypeAdapter

from lab.experiments import Experiment
from lab.records import Record
from lab.specimens import Specimen


@dataclass(frozen=True)
class BenchDatum:
    """A record that the fit sees (``used``) or is judged by, under its name in the result.

    Attributes
    ----------
    learner
        What is fitted, for messages.
    specimens, experiments
        Kinds that its records may be of.
    """

    label: str
    used: bool
    record: Record
    learner: ClassVar[str]
    specimens: ClassVar[tuple[type, ...]]
    experiments: ClassVar[tuple[type, ...]]

    @property
    def specimen(self) -> Any:
        """One of ``specimens``; ValueError for anything else."""
        return self._of(self.specimens, TypeAdapter(Specimen).validate_python(dict(self.record.specimen)))

    @property
    def experiment(self) -> Any:
        """One of ``experiments``; ValueError for anything else."""
        return self._of(self.experiments, TypeAdapter(Experiment).validate_python(dict(self.record.experiment)))

    def _of(self, kinds: tuple[type, ...], found: Any) -> Any:
        if not isinstance(found, kinds):
            wanted = " or ".join(kind.__name__ for kind in kinds)
            raise ValueError(f"{self.label} is of a {found.kind}; {self.learner} is learned from {wanted}")
        return found
