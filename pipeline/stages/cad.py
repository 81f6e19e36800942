"""Command ``cad``: a specimen as STEP or STL."""

from collections.abc import Sequence
from pathlib import Path

from pipeline.designs import design
from pipeline.study import Study, StudyError


def cad(study: Study, specimen: str, changes: Sequence[str], output: Path, part: str = "whole") -> str:
    """Write the body of a specimen with changed fields, or a ``part`` of it, to ``output``; return a line about it.

    Raises
    ------
    StudyError
        In one line, for an unknown specimen, a change that does not fit it, or what cannot be drawn.
    """
    chosen, about = design(study, specimen, changes)
    from meshes import write_cad  # loads gmsh

    output.parent.mkdir(parents=True, exist_ok=True)
    try:
        figures = write_cad(chosen, output, part=part)
    except ValueError as error:
        raise StudyError(str(error)) from None
    about += "" if part == "whole" else f", {part}"
    return f"{output}: {about}; {1e6 * figures['volume']:.4g} cm^3"
