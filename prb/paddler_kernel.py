"""Motion of a paddling half device, compiled: equations of motion, plate loads and the classical Runge-Kutta method.

Plane of the stroke: u outward from the tube's axis, v forwards, in which the device swims.  A link at the angle theta
from the tube's rear axis points along e = (sin theta, -cos theta); its normal is n = de/dtheta.
Coordinates: place of the body b (along v), widening of the tube x (along u), buckling of the fin q.  With the learned
turn g the links have theta_1 = g(x) and theta_2 = g(x) + q, so that a load on the fin pushes back on the tube.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: Columns of a path.
PATH = (
    "time", "body", "x1", "buckling", "body_speed", "x1_speed", "buckling_speed", "input_force", "work",
    "water_loss", "damper_loss", "pull_work", "reaction", "water_force", "kinetic", "potential",
)  # fmt: skip
#: Coordinates, their speeds, the force of the actuator, and four works.
STATE = 11


class Numbers(NamedTuple):
    """A half device in SI units.

    Parameters
    ----------
    turn
        Coefficients of theta_1 = g(x), rising powers of x in m, (5,), rad.
    tube
        Mass that moves outward (kg), stiffness (N/m), damping (N*s/m), widening of the flat tube (m), stiffness of the
        stop beyond it (N/m), (5,).
    hinge
        Place of the fin's hinge from its root (m), damping (N*m*s/rad), (2,).
    spring
        Coefficients a, b, c, d of a exp(b s) + c exp(d s) over the flattening s = x / widening, (2, 2, 4): opposite
        (q > 0) and equal sense; stiffness (N*m/rad) and limit moment (N*m).
    beyond
        Slope beyond the limit over that before, (2,).
    points
        Of the fin, (points, 5): link (0 or 1), distance along it (m), mass (kg), plate area (m^2), mass of water that
        moves with the plate's normal (kg).
    plate
        rho times the factor of the plate law, kg/m^3.
    body
        Mass that only swims (kg), drag (N*s^2/m^2), and a pull forwards (N), (3,).
    valve
        Force of the full pressure (N), times of filling and of venting (s), (3,).
    free
        Whether the body swims.
    """

    turn: Array
    tube: Array
    hinge: Array
    spring: Array
    beyond: Array
    points: Array
    plate: float
    body: Array
    valve: Array
    free: bool


@njit(cache=True, error_model="numpy")
def two_exponentials(coefficients: Array, s: float) -> tuple[float, float]:
    """a exp(b s) + c exp(d s) and its derivative, constant outside 0 <= s <= 1."""
    inside = min(max(s, 0.0), 1.0)
    first = coefficients[0] * (np.exp(coefficients[1] * inside) if coefficients[1] != 0.0 else 1.0)
    second = coefficients[2] * np.exp(coefficients[3] * inside) if coefficients[2] != 0.0 else 0.0
    slope = coefficients[1] * first + coefficients[3] * second
    return first + second, slope if inside == s else 0.0


@njit(cache=True, error_model="numpy")
def buckling_spring(q: float, s: float, n: Numbers) -> tuple[float, float, float]:
    """Moment that resists q, energy, and the energy's derivative by the flattening s.

    U = K q^2 / 2 up to the limit moment L; from there, with y = |q| - L / K, U = L |q| - L^2 / (2 K) + r K y^2 / 2.
    """
    side = 0 if q > 0.0 else 1
    k, dk = two_exponentials(n.spring[side, 0], s)
    limit, dlimit = two_exponentials(n.spring[side, 1], s)
    size, sign = abs(q), 1.0 if q > 0.0 else -1.0
    if k * size <= limit:
        return k * q, 0.5 * k * q * q, 0.5 * dk * q * q
    r, y = n.beyond[side], size - limit / k
    moment = limit + r * k * y
    energy = limit * size - 0.5 * limit * limit / k + 0.5 * r * k * y * y
    dy = -dlimit / k + limit * dk / k**2
    by_s = dlimit * size - limit * dlimit / k + 0.5 * limit * limit * dk / k**2 + 0.5 * r * dk * y * y + r * k * y * dy
    return sign * moment, energy, by_s


@njit(cache=True, error_model="numpy")
def turned(x: float, turn: Array) -> tuple[float, float, float]:
    """g(x), g'(x) and g''(x)."""
    g, first, second = 0.0, 0.0, 0.0
    for k in range(len(turn) - 1, -1, -1):
        second = second * x + 2.0 * first
        first = first * x + g
        g = g * x + turn[k]
    return g, first, second


@njit(cache=True, error_model="numpy")
def rates(state: Array, target: float, lag: float, n: Numbers, out: Array, told: Array) -> None:
    """Derivative of a state into ``out``; mount's force, water's force (forwards) and energies into ``told``."""
    x, q, vb, vx, vq, force = state[1], state[2], state[3], state[4], state[5], state[6]
    theta, dg, ddg = turned(x, n.turn)
    turn1, turn2 = dg * vx, dg * vx + vq
    e1u, e1v, n1u, n1v = np.sin(theta), -np.cos(theta), np.cos(theta), np.sin(theta)
    e2u, e2v = np.sin(theta + q), -np.cos(theta + q)
    n2u, n2v = -e2v, e2u
    root, gyre = n.hinge[0], ddg * vx * vx
    bb, bx, bq, xx, xq, qq = n.body[0] + n.tube[0], 0.0, 0.0, n.tube[0], 0.0, 0.0
    hb, hx, hq = 0.0, 0.0, 0.0
    water, load_x, load_q, lost = 0.0, 0.0, 0.0, 0.0
    for k in range(len(n.points)):
        outer, arm, mass, area, carried = n.points[k]
        if outer > 0.5:
            nu, nv, eu, ev, turning = n2u, n2v, e2u, e2v, turn2
            xu, xv = 1.0 + dg * (root * n1u + arm * n2u), dg * (root * n1v + arm * n2v)
            qu, qv, by_q = arm * n2u, arm * n2v, 1.0
            cu = gyre * (root * n1u + arm * n2u) - root * turn1**2 * e1u - arm * turn2**2 * e2u
            cv = gyre * (root * n1v + arm * n2v) - root * turn1**2 * e1v - arm * turn2**2 * e2v
        else:
            nu, nv, eu, ev, turning = n1u, n1v, e1u, e1v, turn1
            xu, xv, qu, qv, by_q = 1.0 + dg * arm * n1u, dg * arm * n1v, 0.0, 0.0, 0.0
            cu, cv = arm * (gyre * n1u - turn1**2 * e1u), arm * (gyre * n1v - turn1**2 * e1v)
        u, v = vx * xu + vq * qu, vb + vx * xv + vq * qv
        bb += mass
        bx += mass * xv
        bq += mass * qv
        xx += mass * (xu * xu + xv * xv)
        xq += mass * (xu * qu + xv * qv)
        qq += mass * (qu * qu + qv * qv)
        hb += mass * cv
        hx += mass * (xu * cu + xv * cv)
        hq += mass * (qu * cu + qv * cv)
        across, along = nu * u + nv * v, eu * u + ev * v
        nx, nq, ex, eq = nu * xu + nv * xv, nu * qu + nv * qv, eu * xu + ev * xv, eu * qu + ev * qv
        if carried > 0.0:
            # Kirchhoff: force -d(m w n)/dt and moment -m w (e v) of a plate that carries water along its normal.
            bb += carried * nv * nv
            bx += carried * nv * nx
            bq += carried * nv * nq
            xx += carried * nx * nx
            xq += carried * nx * nq
            qq += carried * nq * nq
            drift, swing = nu * cu + nv * cv - turning * along, across * turning
            hb += carried * (nv * drift - swing * ev)
            hx += carried * (nx * drift - swing * ex + dg * across * along)
            hq += carried * (nq * drift - swing * eq + by_q * across * along)
        push = -n.plate * np.sqrt(u * u + v * v) * across * area
        water += push * nv
        load_x += push * nx
        load_q += push * nq
        lost -= push * across
    s = x / n.tube[3]
    moment, bent, by_s = buckling_spring(q, s, n)
    over = max(x - n.tube[3], 0.0)
    qx = force - n.tube[1] * x - n.tube[2] * vx - n.tube[4] * over - by_s / n.tube[3] + load_x - hx
    qq_force = -moment - n.hinge[1] * vq + load_q - hq
    drag = -n.body[1] * abs(vb) * vb
    ab = 0.0
    if n.free:
        qb = n.body[2] + drag + water - hb
        # Schur complement of the body in the two joints.
        sxx, sxq, sqq = xx - bx * bx / bb, xq - bx * bq / bb, qq - bq * bq / bb
        fx, fq = qx - bx * qb / bb, qq_force - bq * qb / bb
    else:
        sxx, sxq, sqq, fx, fq, qb = xx, xq, qq, qx, qq_force, 0.0
    determinant = sxx * sqq - sxq * sxq
    ax, aq = (sqq * fx - sxq * fq) / determinant, (sxx * fq - sxq * fx) / determinant
    if n.free:
        ab = (qb - bx * ax - bq * aq) / bb
    out[0], out[1], out[2], out[3], out[4], out[5] = vb, vx, vq, ab, ax, aq
    out[6] = (target - force) / lag if lag > 0.0 else 0.0
    out[7], out[8] = force * vx, lost - drag * vb
    out[9], out[10] = n.tube[2] * vx * vx + n.hinge[1] * vq * vq, n.body[2] * vb
    told[0] = bb * ab + bx * ax + bq * aq + hb - water - drag
    told[1] = water
    told[2] = 0.5 * (bb * vb * vb + xx * vx * vx + qq * vq * vq) + bx * vb * vx + bq * vb * vq + xq * vx * vq
    told[3] = 0.5 * n.tube[1] * x * x + 0.5 * n.tube[4] * over * over + bent


@njit(cache=True, error_model="numpy")
def _write(path: Array, row: int, time: float, state: Array, told: Array) -> None:
    path[row, 0] = time
    path[row, 1:12] = state
    path[row, 12:] = told


@njit(cache=True, error_model="numpy", nogil=True)
def march(start: Array, phases: Array, cycles: int, n: Numbers) -> Array:
    """Path (rows, 16) of ``cycles`` strokes from a state (11,), one row per step and the start.

    ``phases`` has a row for each part of a cycle: force of the open or shut valve (N), lag (s), duration (s), steps.
    Without a lag the force follows at once.  A motion that runs away ends with NaN.
    """
    rows = 1
    for p in range(len(phases)):
        rows += cycles * int(phases[p, 3])
    path = np.full((rows, 16), np.nan)
    state, told, trial = start.copy(), np.zeros(4), np.zeros(STATE)
    slope, total = np.zeros(STATE), np.zeros(STATE)
    reach, weight = (0.0, 0.5, 0.5, 1.0), (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)
    row, time = 0, 0.0
    for _ in range(cycles):
        for p in range(len(phases)):
            target, lag, count = phases[p, 0], phases[p, 1], int(phases[p, 3])
            h = phases[p, 2] / count
            if lag == 0.0:
                state[6] = target
            for step in range(count):
                for stage in range(4):
                    for i in range(STATE):
                        trial[i] = state[i] + reach[stage] * h * slope[i] if stage > 0 else state[i]
                    rates(trial, target, lag, n, slope, told)
                    if stage == 0:
                        _write(path, row, time + step * h, state, told)
                    for i in range(STATE):
                        total[i] = slope[i] * weight[stage] if stage == 0 else total[i] + slope[i] * weight[stage]
                row += 1
                for i in range(STATE):
                    state[i] += h * total[i]
                if not (abs(state[4]) < 1e3 and abs(state[5]) < 1e5):
                    return path
            time += phases[p, 2]
    rates(state, phases[-1, 0], phases[-1, 1], n, slope, told)
    _write(path, row, time, state, told)
    return path
