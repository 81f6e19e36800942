"""Eigenpairs of small systems that are known."""

import numpy as np
import pytest
from scipy.sparse import csr_array, triu

from fea.modes import buckling, natural_modes
from fea.pattern import Pattern


def chain(size, ends):
    """Masses 2 kg and springs 50 N/m in a row; ``ends`` 1 clamps both ends, 0 leaves them free."""
    stiffness = (
        np.diag(np.full(size, 100.0)) - np.diag(np.full(size - 1, 50.0), 1) - np.diag(np.full(size - 1, 50.0), -1)
    )
    if not ends:
        stiffness[0, 0] = stiffness[-1, -1] = 50.0
    upper = csr_array(triu(csr_array(stiffness)))
    upper.sort_indices()
    pattern = Pattern(upper.indptr.astype(np.int32), upper.indices.astype(np.int32))
    mass = np.zeros_like(upper.data)
    mass[pattern.indptr[:-1]] = 2.0
    return pattern, upper.data, mass


@pytest.mark.parametrize("size", [20, 200])
@pytest.mark.parametrize("solver", ["pardiso", "superlu"])
def test_clamped_chain(size, solver):
    modes = natural_modes(*chain(size, 1), 5, solver=solver)
    expected = 2 * np.sqrt(25.0) * np.sin(np.arange(1, 6) * np.pi / (2 * (size + 1))) / (2 * np.pi)
    np.testing.assert_allclose(modes.frequencies, expected, rtol=1e-8)
    np.testing.assert_allclose(2.0 * modes.shapes @ modes.shapes.T, np.eye(5), atol=1e-8)
    assert modes.missed == (0 if solver == "pardiso" else None)


@pytest.mark.parametrize("size", [20, 200])
def test_free_chain_has_a_rigid_mode(size):
    modes = natural_modes(*chain(size, 0), 4)
    assert modes.frequencies[0] == 0.0
    expected = 2 * 5.0 * np.sin(np.arange(1, 4) * np.pi / (2 * size)) / (2 * np.pi)
    np.testing.assert_allclose(modes.frequencies[1:], expected, rtol=1e-7)
    np.testing.assert_allclose(modes.shapes[0], modes.shapes[0, 0], rtol=1e-5)
    assert modes.missed == 0


def test_modes_about_a_shift_say_what_lies_below():
    pattern, stiffness, mass = chain(200, 1)
    squares = 100.0 * np.sin(np.arange(1, 201) * np.pi / 402) ** 2
    modes = natural_modes(pattern, stiffness, mass, 2, shift=float(squares[10:12].mean()))
    np.testing.assert_allclose(modes.frequencies, np.sqrt(squares[10:12]) / (2 * np.pi), rtol=1e-8)
    assert modes.missed == 10


def test_unstable_states_have_negative_frequencies():
    pattern, stiffness, mass = chain(100, 1)
    modes = natural_modes(pattern, stiffness - 0.1 * mass, mass, 3)
    assert modes.frequencies[0] < 0 < modes.frequencies[-1]


@pytest.mark.parametrize("size", [20, 200])
def test_buckling_of_a_chain(size):
    pattern, stiffness, mass = chain(size, 1)
    geometric = -mass
    modes = buckling(pattern, stiffness, geometric, 3)
    expected = 100.0 * np.sin(np.arange(1, 4) * np.pi / (2 * (size + 1))) ** 2
    np.testing.assert_allclose(modes.factors, expected, rtol=1e-8)
    assert modes.missed == 0
    np.testing.assert_allclose(np.abs(modes.shapes).max(axis=1), 1.0)


def test_pulling_buckles_nothing():
    pattern, stiffness, mass = chain(50, 1)
    with pytest.raises(ValueError, match="buckles nothing"):
        buckling(pattern, stiffness, mass, 2)


@pytest.mark.parametrize("count", [0, 20])
def test_impossible_counts(count):
    with pytest.raises(ValueError, match="modes of 20"):
        natural_modes(*chain(20, 1), count)
