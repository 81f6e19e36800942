"""Other sampling times, and fewer frequencies."""

from typing import Literal

import numpy as np

from lab.readers.recording import Array, Recording
from lab.signals.gaps import refuse_gaps, refuse_uneven

Method = Literal["spline", "band-limited"]

#: Half width of the windowed sinc in zero crossings, and the shape of its Kaiser window (stop band at -80 dB).
_LOBES, _KAISER = 16, 8.0


def resample(recording: Recording, times: Array, method: Method) -> Recording:
    """Values at other times.

    Parameters
    ----------
    recording
        Without gaps.
    times
        New clock, even, (m,), s, inside the record.
    method
        ``spline``: cubic spline through the samples; nothing keeps what is faster than half a lower new rate
        from turning up as something slower.  ``band-limited``: sinc in a Kaiser window of 16 zero crossings to
        each side, cut off at half the lower of both rates, the record continued by odd reflection; rings
        beside sudden changes.

    Raises
    ------
    ValueError
        For gaps, and for times outside the record.
    """
    from scipy.interpolate import CubicSpline

    refuse_gaps(recording, "resampling")
    hair = 1e-3 / recording.rate
    if times[0] < recording.time[0] - hair or times[-1] > recording.time[-1] + hair:
        raise ValueError(
            f"{recording.source}: {times[0]:.6g} to {times[-1]:.6g} s is asked for, but the record runs from "
            f"{recording.time[0]:.6g} to {recording.time[-1]:.6g} s"
        )
    rate = (len(times) - 1) / float(times[-1] - times[0])
    if method == "spline":
        changes = recording.each(lambda _, values: CubicSpline(recording.time, values)(times))
    else:
        refuse_uneven(recording, "band-limited resampling")
        places = (times - recording.time[0]) * recording.rate
        changes = recording.each(lambda _, values: _sinc(values, places, min(1.0, rate / recording.rate)))
    nearest = np.searchsorted((recording.time[1:] + recording.time[:-1]) / 2, times)
    if recording.leg is not None:
        changes["leg"] = recording.leg[nearest]
    how = "cubic spline, no filter" if method == "spline" else "band-limited, by a windowed sinc"
    return recording.noted(
        f"resampled from {recording.rate:.6g} to {rate:.6g} Hz, {len(times)} samples ({how})",
        time=times, rate=rate, rows=recording.rows[nearest], **changes,
    )  # fmt: skip


def _sinc(values: Array, places: Array, band: float) -> Array:
    """Band-limited values at fractional ``places`` of even samples, cut off at ``band`` of their Nyquist rate."""
    half = int(np.ceil(_LOBES / band))
    if half >= len(values):
        raise ValueError(f"band-limited resampling needs more than {half} samples, not {len(values)}; take the spline")
    before = 2 * values[0] - values[half:0:-1]
    after = 2 * values[-1] - values[-2 : -half - 2 : -1]
    extended = np.vstack([before, values, after])
    base = np.floor(places).astype(int)
    reach = np.arange(1 - half, half + 1)
    away = places[:, None] - base[:, None] - reach
    weights = band * np.sinc(band * away) * np.i0(_KAISER * np.sqrt(np.clip(1 - (away / half) ** 2, 0, None)))
    weights /= weights.sum(axis=1, keepdims=True)
    picked = np.clip(base[:, None] + reach + half, 0, len(extended) - 1)
    return np.einsum("ij,ijk->ik", weights, extended[picked])


def low_pass(recording: Recording, cutoff: float, order: int = 4) -> Recording:
    """Butterworth filter run forwards and backwards: no phase, half its power (-3 dB) at ``cutoff`` as a whole.

    Parameters
    ----------
    recording
        Even, without gaps.
    cutoff
        Hz, below half the sampling rate.
    order
        Of one run.

    Raises
    ------
    ValueError
        For gaps, uneven samples, a cutoff beyond the Nyquist rate, too short a record.
    """
    from scipy.signal import butter, sosfiltfilt

    refuse_uneven(recording, "a low-pass")
    if cutoff >= 0.5 * recording.rate:
        raise ValueError(
            f"{recording.source}: low-pass at {cutoff:g} Hz is not below half the sampling rate of "
            f"{recording.rate:.6g} Hz"
        )
    # Two runs of a filter are 3 dB down where one is 1.5 dB down: its own corner lies higher, on the tangent
    # scale of frequencies that sampled Butterworth filters live on.
    ratio = (np.sqrt(2.0) - 1.0) ** (-1 / (2 * order))
    corner = recording.rate / np.pi * float(np.arctan(ratio * np.tan(np.pi * cutoff / recording.rate)))
    sections = butter(order, corner, fs=recording.rate, output="sos")
    pad = int(np.ceil(3 * recording.rate / corner))
    if len(recording.time) <= pad:
        raise ValueError(f"{recording.source}: {len(recording.time)} samples are too few for this low-pass ({pad})")
    changes = recording.each(lambda _, values: sosfiltfilt(sections, values, axis=0, padlen=pad))
    return recording.noted(
        f"low-passed at {cutoff:g} Hz (-3 dB; Butterworth of order {order}, forwards and backwards)", **changes
    )
