"""A specimen of a study with changes from the command line: a design that needs no study of its own."""

from collections.abc import Sequence

from lab.fields import changed, shown
from lab.specimens import Specimen
from pipeline.study import Study, StudyError


def design(study: Study, name: str, changes: Sequence[str]) -> tuple[Specimen, str]:
    """The specimen ``name`` (empty: the only one) with ``changes`` as ``twist=75 deg``, and both in words.

    Raises
    ------
    StudyError
        In one line, for an unknown specimen, or a change that does not fit it.
    """
    known = study.specimens
    if not name and len(known) > 1:
        raise StudyError(f"the study has several specimens; name one of {', '.join(known)}")
    name = name or next(iter(known))
    if name not in known:
        raise StudyError(f"no specimen {name!r}; there is {', '.join(known)}")
    specimen, said = known[name], []
    for change in changes:
        path, equals, value = change.partition("=")
        if not equals:
            raise StudyError(f"{change!r} is no change; write it like 'twist=75 deg'")
        try:
            specimen = changed(specimen, path.strip(), value.strip())
        except ValueError as error:
            raise StudyError(f"{change!r}: {error}") from None
        said.append(f"{path.strip()} {shown(specimen, path.strip())}")
    return specimen, ", ".join([name, *said])
