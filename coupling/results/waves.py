"""The waves that pass a sensor, as data, and the object that replaces a missing wave."""

from dataclasses import dataclass, fields
from typing import NamedTuple, NoReturn

from structures.checks import html_table

# The remark of reports and tables on such an AR.
ABOVE_ONE = "above 1: the beads on the two sides of the sensor differ, or the next wave is merged with it"


@dataclass(frozen=True, repr=False)
class Wave:
    """A wave that passes a sensor.

    Parameters
    ----------
    amplitude : float
        Force of its peak above the preload, N.
    arrival : float
        Time of its peak, s.
    """

    amplitude: float
    arrival: float

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.in_words()})"

    def in_words(self) -> str:
        """Return the wave as a line of text."""
        return f"{self.amplitude:.2f} N at {1e6 * self.arrival:.2f} µs"


@dataclass(frozen=True, repr=False)
class ReflectedWave(Wave):
    """A wave that came back, compared with the incident one from peak to peak.

    Parameters
    ----------
    amplitude, arrival
        As in `Wave`.
    amplitude_ratio : float
        AR: its amplitude over that of the incident wave.
    time_of_flight : float
        TOF: the time from the incident wave's arrival to its own, s.
    margins : (float, float), optional
        Numerical errors of AR and of TOF, s, if the run holds them (`NumericalError.noted_in`).
    """

    amplitude_ratio: float
    time_of_flight: float
    margins: tuple[float, float] | None = None

    def in_words(self) -> str:
        """Return the wave as a line of text."""
        ratio, flight = self.texts
        return f"{super().in_words()}, AR = {ratio}, TOF = {flight} µs"

    @property
    def texts(self) -> tuple[str, str]:
        """AR, and TOF in µs, with their margins."""
        ratio, flight = f"{self.amplitude_ratio:.4f}", f"{1e6 * self.time_of_flight:.2f}"
        if self.margins is None:
            return ratio, flight
        return f"{ratio} ± {self.margins[0]:.1g}", f"{flight} ± {1e6 * self.margins[1]:.1g}"


class NoWaveError(ValueError, AttributeError):
    """There is no wave whose amplitude, arrival, amplitude ratio or time of flight could be read."""


@dataclass(frozen=True)
class NoWave:
    """The object for a missing wave. It is false, so that `if waves.secondary:` asks whether there is a wave.

    Its amplitude, arrival, amplitude_ratio and time_of_flight raise a NoWaveError with the reason.

    Parameters
    ----------
    which : str
        The missing wave: "incident", "primary" or "secondary".
    reason : str
        Why there is none.
    """

    which: str
    reason: str

    def __bool__(self) -> bool:
        return False

    def __getattr__(self, name: str) -> NoReturn:
        if name in {field.name for field in fields(ReflectedWave)}:
            raise NoWaveError(f"{name}: there is no {self.which} wave; {self.reason}")
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    def in_words(self) -> str:
        """Return why there is no such wave."""
        return f"none; {self.reason}"


class Reflections(NamedTuple):
    """The waves at a sensor, see `reflections`.

    Parameters
    ----------
    incident : Wave or NoWave
        The first wave that moves towards the structure.
    primary, secondary : ReflectedWave or NoWave
        The first and the second wave that came back. A missing wave is a NoWave, which is false.
    """

    incident: Wave | NoWave
    primary: ReflectedWave | NoWave
    secondary: ReflectedWave | NoWave

    def in_words(self) -> dict[str, str]:
        """Return each wave in words, or why it is missing, by its name."""
        return {name: wave.in_words() for name, wave in self._asdict().items()}

    def _repr_html_(self) -> str:
        return html_table("Reflections", [*self.in_words().items()])
