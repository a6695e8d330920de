"""The waves that pass a sensor, as data; and what stands for one that did not come."""

from dataclasses import dataclass, fields
from typing import NamedTuple, NoReturn


@dataclass(frozen=True)
class Wave:
    """A wave's passage over a sensor: amplitude (N, above the preload) and arrival (s) of its peak."""

    amplitude: float
    arrival: float


@dataclass(frozen=True)
class ReflectedWave(Wave):
    """A wave that came back, compared with the incident one: amplitude ratio AR, and time of flight TOF (s).

    Both from the peak of the incident wave's force at the sensor to the peak of the reflected wave's.

    begins: "structure"; "chain" where it came out of a meeting of waves on the way; "unknown" of a signal.
    """

    amplitude_ratio: float
    time_of_flight: float
    begins: str = "unknown"


class NoWaveError(ValueError, AttributeError):
    """A wave was asked for its amplitude, arrival, amplitude ratio or time of flight, and there is none."""


@dataclass(frozen=True)
class NoWave:
    """It stands where no wave came, is false, and knows the reason: `if waves.secondary:` asks whether there is one.

    Its amplitude, arrival, amplitude_ratio, time_of_flight and begins raise a NoWaveError with the reason.
    """

    which: str
    reason: str

    def __bool__(self) -> bool:
        return False

    def __getattr__(self, name: str) -> NoReturn:
        if name in OF_WAVES:
            raise NoWaveError(f"{name}: there is no {self.which} wave; {self.reason}")
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")


OF_WAVES = {one.name for one in fields(ReflectedWave)}


class Reflections(NamedTuple):
    """The incident wave, and the first and second that came back; a NoWave, which is false, where there is none."""

    incident: Wave | NoWave
    primary: ReflectedWave | NoWave
    secondary: ReflectedWave | NoWave
