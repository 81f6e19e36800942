"""Viscous stress in time: Kelvin-Voigt damping and Maxwell branches, as one linear function of the strain.

The stress of a material is S(E) + C0 : (viscosity E + past) at the end of every step (``fea.kernels``).
Kelvin-Voigt: C0 : tau dE/dt with the second-order backward difference on two steps of any length.  Branch i of a
generalised Maxwell model: g_i C0 : H_i with

    dH_i/dt + H_i / tau_i = dE/dt

solved exactly for a strain that is linear in the step (Simo & Hughes 1998, 10.3.3): second order, stable
for any step, right for steps far longer and far shorter than tau_i.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lab.materials import Material

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ViscousHistory:
    """What the viscous stress remembers at one instant; nothing here changes, a step makes a new one.

    Parameters
    ----------
    material
        Its ``viscous_time`` and ``prony``.
    strains, earlier
        Strains now, and ``step`` s before (infinitely long ago after ``begin``), shape of ``Body.strains``.
    step
        Last step, s.
    branches
        H_i of every branch, (branches, *strains' shape).
    """

    material: Material
    strains: Array
    earlier: Array
    step: float
    branches: Array

    @classmethod
    def begin(cls, material: Material, strains: Array) -> "ViscousHistory":
        """History of a body that has been still at ``strains`` for ever: every branch is relaxed."""
        return cls(material, strains, strains, np.inf, np.zeros((len(material.prony), *strains.shape)))

    @property
    def active(self) -> bool:
        """Whether the material has any viscous stress."""
        return self.material.viscous_time > 0 or bool(self.material.prony)

    def coefficients(self, step: float) -> tuple[float, Array | None]:
        """``viscosity`` and ``past`` at the end of a step, s, from here; 0 and None where nothing is viscous."""
        if not self.active:
            return 0.0, None
        ratio, tau = step / self.step, self.material.viscous_time / step
        # dE/dt = (c1 E1 - c0 E0 + c_ E_) / step
        viscosity = tau * (1 + 2 * ratio) / (1 + ratio)
        past = tau * (ratio**2 / (1 + ratio) * self.earlier - (1 + ratio) * self.strains)
        for branch, state in zip(self.material.prony, self.branches, strict=True):
            kept, taken = _decay(step / branch.time)
            viscosity += branch.ratio * taken
            past += branch.ratio * (kept * state - taken * self.strains)
        return viscosity, past

    def at_rate(self, rate: Array) -> tuple[float, Array | None]:
        """The same at this very instant, for the strain rate ``rate``, 1/s."""
        if not self.active:
            return 0.0, None
        past = self.material.viscous_time * rate
        for branch, state in zip(self.material.prony, self.branches, strict=True):
            past += branch.ratio * state
        # Kernels pass by what has no viscosity at all.
        return float(np.finfo(float).tiny), past

    def accept(self, strains: Array, step: float) -> "ViscousHistory":
        """History at the end of a step, s, that has led to ``strains``."""
        if not self.active:
            return self
        branches = np.empty_like(self.branches)
        for n, branch in enumerate(self.material.prony):
            kept, taken = _decay(step / branch.time)
            branches[n] = kept * self.branches[n] + taken * (strains - self.strains)
        return replace(self, strains=strains, earlier=self.strains, step=step, branches=branches)

    def stored_energy(self, modulus: Callable[[Array], Array], weights: Array) -> float:
        """Energy in the springs of the branches, J: the sum of g_i/2 H_i : C0 : H_i.

        ``modulus`` gives C0 : strains, Pa; ``weights`` (elements, points) are the reference volumes, m^3.
        """
        densities = (
            branch.ratio / 2 * np.einsum("...n,...n->...", state, modulus(state))
            for branch, state in zip(self.material.prony, self.branches, strict=True)
        )
        return float(sum(np.sum(weights * density) for density in densities))


def _decay(steps: float) -> tuple[float, float]:
    """exp(-x), and (1 - exp(-x)) / x, the part of a steady strain increment that is left at its end."""
    return float(np.exp(-steps)), float(-np.expm1(-steps) / steps) if steps > 0 else 1.0
