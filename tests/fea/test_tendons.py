"""Tendons and loads as terms: forces are slopes of energies, tangents slopes of forces, and tendons do not push."""

import numpy as np
import pytest

from fea.tendons import BlockLoad, Line, Ramp, Tendons

POINTS = np.array([[0.0, 1.0, 0.0], [0.2, 1.1, 0.0], [0.0, -1.0, 0.1], [1.0, 0.2, 0.0], [-1.0, 0.0, 0.0]])
LINES = [
    Line(np.array([0, 1, 2]), np.array([0.5, 0.5, -1.0]), np.zeros(3)),
    Line(np.array([3, 4]), np.array([1.0, -1.0]), np.zeros(3)),
]
SHARES = np.array([0.6, 0.8])
STIFFNESS = 50.0


def tendons(part: float = 1.0) -> Tendons:
    result = Tendons(POINTS, LINES, STIFFNESS, 0.05, part)
    result.pull(np.zeros_like(POINTS), SHARES, 0.0, 1.0, 0.4)
    return result


def near(scale: float = 0.05) -> np.ndarray:
    return scale * np.random.default_rng(1).normal(size=POINTS.shape)


def check_slopes(term: Tendons | BlockLoad, x: np.ndarray, t: float) -> None:
    nodes, step = term.cells[0], 1e-6
    tangent = term.tangent(x, t)[0]
    assert np.allclose(tangent, tangent.T)
    force = np.zeros_like(x)
    for row, node in enumerate(nodes):
        for axis in range(3):
            ends = [x.copy(), x.copy()]
            ends[0][node, axis] += step
            ends[1][node, axis] -= step
            force[node, axis] = (term.energy(ends[0], t) - term.energy(ends[1], t)) / (2 * step)
            slope = (term.force(ends[0], t) - term.force(ends[1], t))[nodes] / (2 * step)
            assert np.allclose(tangent[:, 3 * row + axis], slope.ravel(), atol=1e-6 * STIFFNESS)
    assert np.allclose(term.force(x, t), force, atol=1e-6)


@pytest.mark.parametrize("t", [0.1, 0.9])
def test_together(t: float) -> None:
    term, x = tendons(), near()
    forces = term.forces(x, t)
    assert forces[0] / forces[1] == pytest.approx(0.6 / 0.8)
    assert term.joint_force(x, t) * SHARES == pytest.approx(forces)
    check_slopes(term, x, t)


def test_held_one_by_one() -> None:
    term, x = tendons(), near()
    before = term.forces(x, 0.8)
    term.hold(x, 0.8)
    assert term.forces(x, 0.8) == pytest.approx(before)
    # What shortens the first line only slackens the first tendon.
    x[2, 1] += 0.02
    assert term.forces(x, 0.8)[0] < before[0]
    assert term.forces(x, 0.8)[1] == pytest.approx(before[1])
    check_slopes(term, x, 0.8)


def test_kept_only_in_between() -> None:
    term, x = tendons(), near()
    before = term.tangent(x, 0.8)
    with term.kept(x, 0.8):
        held = term.tangent(x, 0.8)
    assert not np.allclose(held, before)
    assert np.array_equal(term.tangent(x, 0.8), before)


def test_slack_tendons_do_not_push() -> None:
    term, x = tendons(), np.zeros_like(POINTS)
    x[[0, 1], 1], x[2, 1] = -0.5, 0.5
    assert not term.force(x, 0.3).any()
    assert not term.tangent(x, 0.3).any()
    term = tendons()
    term.hold(near(), 1.0)
    term.release(1.0, 2.0)
    assert term.forces(near(), 1.0).min() > 0
    assert not term.forces(near(0.0), 2.0).any()


def test_pairs_that_are_not_pulled_stay_slack_when_held() -> None:
    term, x = Tendons(POINTS, LINES, STIFFNESS, 0.05), np.zeros_like(POINTS)
    term.pull(x, np.array([1.0, 0.0]), 0.0, 1.0, 0.4)
    term.hold(x, 1.0)
    x[3, 0] += 0.3
    assert term.forces(x, 1.0)[1] == 0.0


def test_part_of_a_device() -> None:
    x = near()
    assert tendons(1 / 8).force(x, 0.7) == pytest.approx(tendons().force(x, 0.7) / 8)
    assert tendons(1 / 8).forces(x, 0.7) == pytest.approx(tendons().forces(x, 0.7))


def test_block_load() -> None:
    direction = np.array([0.0, -1.0, 0.0])
    term, x = BlockLoad(np.array([0, 3]), np.array([0.25, 0.75]), direction, STIFFNESS), near()
    term.load.goes(0.0, 1.0, 3.0)
    assert term.total(x, 0.5) == pytest.approx(1.5)
    assert term.force(x, 0.5).sum(axis=0) == pytest.approx(-1.5 * direction)
    term = BlockLoad(np.array([0, 3]), np.array([0.25, 0.75]), direction, STIFFNESS)
    term.push(x, 0.0, 1.0, 0.2)
    assert term.total(x, 0.0) == pytest.approx(0.0)
    assert term.total(x, 1.0) == pytest.approx(0.2 * STIFFNESS)
    check_slopes(term, x, 0.6)
    with term.loose():
        assert term.total(x, 1.0) == 0.0


def test_ramp_goes_on_from_where_it_is() -> None:
    ramp = Ramp(1.0)
    ramp.goes(0.0, 2.0, 3.0)
    ramp.goes(1.0, 2.0, 0.0)
    assert [ramp(t) for t in (0.0, 0.5, 1.0, 1.5, 2.0, 9.0)] == pytest.approx([1.0, 1.5, 2.0, 1.0, 0.0, 0.0])
