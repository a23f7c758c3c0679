"""What the controller reads: encoders with offsets and counts, and rates from their differences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..machine.arguments import bounded, exact_array, positive_number, real_array, shaped, whole_number
from ..machine.values import Array, OptionalCount, Value, default


@dataclass(frozen=True, eq=False, repr=False)
class Sensors(Value):
    """How the drives measure.

    offset : calibration offsets in rad, measured minus true angle: one number or (N,).
    encoder : counts per turn (quantization to the nearest count), or None for ideal angles.
    velocity_filter : time constant in s of the rate from backward differences of the measured angles, through a
        first-order low-pass that begins with the true ones, from sample to sample by the share dt / (dt + constant) of
        the way to the new difference; None for the true rates.
    Raises ValueError for values out of range.

    >>> import rapkm_lite as rk
    >>> rk.Sensors(encoder=2000)
    Sensors(encoder=2000)
    """

    offset: Array = default(0.0)
    encoder: OptionalCount = default(None)
    velocity_filter: float | None = None

    def __post_init__(self):
        offset = real_array("offset", self.offset)
        shaped("offset", offset, offset.ndim <= 1 and offset.size > 0, "one number or (N,), one per drive")
        if self.encoder is not None:
            # Finer counts are lost in the rounding of the angles.
            self._set(encoder=whole_number("encoder", self.encoder, 1, 10**12))
        if self.velocity_filter is not None:
            tau = bounded("velocity_filter", exact_array("velocity_filter", self.velocity_filter), 0.0, strict=False)
            self._set(velocity_filter=float(tau))
        super().__post_init__(offset=offset)

    @property
    def count(self) -> float | None:
        """The angle of one encoder count in rad; None for ideal angles."""
        return None if self.encoder is None else 2 * np.pi / self.encoder

    def of_drives(self, N: int) -> Sensors:
        """The same for N drives, with one offset each."""
        N = whole_number("N", N, 1)
        shaped("offset", self.offset, self.offset.shape in ((), (N,)), f"one number or ({N},), one per drive")
        if self.count is not None:  # of a user's class, perhaps
            positive_number("count", self.count)
        return self if self.offset.ndim else self.with_offset(np.broadcast_to(self.offset, (N,)))

    def with_offset(self, offset) -> Sensors:
        """The same with other offsets."""
        return self._changed(offset=offset)


class Encoders:
    """The encoders of one run: they remember their last reading and the rate filtered from their differences."""

    def __init__(self, sensors: Sensors, faults, dt: float):
        self._faults, self._dt = faults, dt
        self._offset, self._count, self._tau = sensors.offset, sensors.count, sensors.velocity_filter
        self._last, self._slow = None, np.zeros(len(sensors.offset))

    def read(self, k: int, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Measured base angles and rates (N,) at sample k from the true ones."""
        faults, last = self._faults, self._last
        angle = q + self._offset if faults is None else q + (self._offset + faults.jump[k])
        if self._count is not None:
            angle = self._count * np.floor(angle / self._count + 0.5)
        if faults is not None and last is not None:
            angle = np.where(faults.held[k], last, angle)
        if self._tau is None or last is None:
            rate = qd.copy() if faults is None else np.where(faults.held[k], 0.0, qd)
        else:
            rate = self._slow + self._dt / (self._tau + self._dt) * ((angle - last) / self._dt - self._slow)
        self._last, self._slow = angle, rate
        angle.setflags(write=False)
        rate.setflags(write=False)
        return angle, rate
