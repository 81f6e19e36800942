"""Error measures and signal measures, on arrays only."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Definition printed wherever the percentage appears.
TRACKING_ERROR_DEFINITION = (
    "tracking error in % = norm of the difference over the norm of the reference's displacement from rest, "
    "all markers, coordinates and samples; the text's own percentage has no published definition"
)


def tracking_rms(markers: Array, reference: Array) -> float:
    """Objective of eq. 5.13 in metres.

    Root of the mean over samples and markers of the squared distance; the sum over i = 1..3 of
    eq. 5.13 is read as the three markers, each with its three coordinates.

    Parameters
    ----------
    markers, reference
        Displacements from rest, (samples, markers, 3), m.
    """
    return float(np.sqrt(np.mean(np.sum((markers - reference) ** 2, axis=-1))))


def tracking_error(markers: Array, reference: Array) -> float:
    """Relative tracking error, see ``TRACKING_ERROR_DEFINITION``; a fraction, not a percentage."""
    return float(np.linalg.norm(markers - reference) / np.linalg.norm(reference))


def relative_error(value: float, reference: float) -> float:
    """(value - reference) / |reference|; NaN for a zero reference."""
    return (value - reference) / abs(reference) if reference else float("nan")


def dominant_mode(time: Array, motion: Array, modes: int = 2) -> tuple[float, float]:
    """Damped frequency (Hz) and damping ratio of the strongest decaying oscillation.

    Matrix pencil (Hua & Sarkar 1990) on the leading principal component of the motion: poles of a
    sum of ``2 * modes`` damped exponentials, the strongest oscillating one taken.

    Parameters
    ----------
    time
        Evenly spaced, (n,), s.
    motion
        Displacement from rest, (n, coordinates), any unit.

    Returns
    -------
    frequency, damping
        Both NaN when no oscillating pole is found (over-damped motion).
    """
    signal = motion @ np.linalg.svd(motion, full_matrices=False)[2][0]
    n, step = len(signal), float(time[1] - time[0])
    pencil = n // 2
    hankel = np.lib.stride_tricks.sliding_window_view(signal, pencil + 1)
    basis = np.linalg.svd(hankel, full_matrices=False)[2][: 2 * modes].T
    poles = np.linalg.eigvals(np.linalg.pinv(basis[:-1]) @ basis[1:]).astype(complex)
    poles = poles[np.abs(poles) > 1e-12]  # a vanishing pole is noise of the rank, not motion
    amplitudes = np.abs(np.linalg.lstsq(poles[None, :] ** np.arange(n)[:, None], signal.astype(complex), rcond=None)[0])
    rates = np.log(poles) / step
    # Slower than a quarter turn in the whole record, at the Nyquist rate, or faint: no oscillation.
    turning = (rates.imag * step > 2 * np.pi / (4 * n)) & (rates.imag * step < 0.98 * np.pi)
    oscillating = np.flatnonzero(turning & (amplitudes > 0.02 * amplitudes.max()))
    if not len(oscillating):
        return float("nan"), float("nan")
    best = rates[oscillating[np.argmax(amplitudes[oscillating])]]
    return float(best.imag / (2 * np.pi)), float(-best.real / abs(best))
