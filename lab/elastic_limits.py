"""How far a material may be stretched and still come back: criterion 3 of 3.3.1."""

from dataclasses import dataclass
from functools import cache

from lab.materials import Material, material
from lab.published import DATA


@dataclass(frozen=True)
class ElasticLimit:
    """Largest tensile strain without a lasting one.

    Parameters
    ----------
    name
        Data file of the material.
    strain
        Green-Lagrange strains compare with it as long as both are small.
    assumed
        Why this value: none is published.
    """

    name: str
    strain: float
    assumed: str


@cache
def elastic_limits() -> tuple[ElasticLimit, ...]:
    """All limits that ship as ``lab/data/elastic_limits.yaml``."""
    import yaml

    data = yaml.safe_load((DATA / "elastic_limits.yaml").read_text(encoding="utf-8"))
    return tuple(ElasticLimit(name, float(e["value"]), " ".join(e["assumed"].split())) for name, e in data.items())


def elastic_limit(of: Material) -> ElasticLimit | None:
    """The limit of the data file with this law, density and Poisson's ratio; moduli and damping may be fitted.

    Examples
    --------
    >>> elastic_limit(material("pet").model_copy(update={"youngs_modulus": 2.0e9})).name
    'pet'
    """

    def kind(one: Material) -> tuple[object, ...]:
        return one.law, one.density, one.poisson_ratio

    return next((limit for limit in elastic_limits() if kind(material(limit.name)) == kind(of)), None)
