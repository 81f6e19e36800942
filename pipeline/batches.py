"""Samples in batches: one process makes many, where it costs more than a sample does."""

from collections import Counter
from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pipeline.study import digest

if TYPE_CHECKING:
    from pipeline.plan import Job

#: Most samples of a batch: what is lost when its process is killed, and what a longer sweep runs again.
MOST_IN_BATCH = 100


@dataclass(frozen=True)
class Batch:
    """Samples that one process makes, each with its own file.

    Parameters
    ----------
    id
        Name of the job.
    jobs
        What each of its samples would be alone.
    """

    id: str
    jobs: tuple["Job", ...]

    @property
    def inputs(self) -> tuple[str, ...]:
        """Files that its samples need."""
        return tuple(dict.fromkeys(file for job in self.jobs for file in job.inputs))

    @property
    def outputs(self) -> tuple[str, ...]:
        """Record files of its samples."""
        return tuple(job.output for job in self.jobs)

    @property
    def digest(self) -> str:
        """Hash of everything else that its answers depend on.

        The values themselves would be stored with each of its files, a hundred times a hundred.
        """
        return digest([[job.id, job.params] for job in self.jobs])


def in_batches(jobs: Iterable[tuple[str, Hashable, "Job"]]) -> dict[str, Batch]:
    """Batches by id, in the order of the jobs.

    Parameters
    ----------
    jobs
        Each with the name of its batch and what it must share with others in it.  Further batches of a name end in
        ``+2``, ``+3`` and so on, which no id of a sample does.
    """
    alike: dict[tuple[str, Hashable], list[Job]] = {}
    for name, shared, job in jobs:
        alike.setdefault((name, shared), []).append(job)
    found: dict[str, Batch] = {}
    numbers: Counter[str] = Counter()
    for (name, _), some in alike.items():
        for begin in range(0, len(some), MOST_IN_BATCH):
            numbers[name] += 1
            id = name if numbers[name] == 1 else f"{name}+{numbers[name]}"
            found[id] = Batch(id, tuple(some[begin : begin + MOST_IN_BATCH]))
    return found
