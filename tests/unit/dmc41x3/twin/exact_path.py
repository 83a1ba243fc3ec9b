"""Vector sequences worked out by themselves: the exact path of VP and CR, and the way along it under constant rates."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, hypot, radians, sin, sqrt


@dataclass(frozen=True)
class Line:
    """From one point to another [counts]."""

    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def length(self) -> float:
        return hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    def at(self, s: float) -> tuple[float, float]:
        (x, y), (u, v), share = self.start, self.end, s / self.length
        return x + (u - x) * share, y + (v - y) * share


@dataclass(frozen=True)
class Curve:
    """A part of a circle: its centre and radius [counts], the angles of start and way [degrees]."""

    centre: tuple[float, float]
    radius: float
    angle: float
    turn: float

    @property
    def length(self) -> float:
        return self.radius * radians(abs(self.turn))

    def at(self, s: float) -> tuple[float, float]:
        angle = radians(self.angle + self.turn * s / self.length)
        return self.centre[0] + self.radius * cos(angle), self.centre[1] + self.radius * sin(angle)


@dataclass
class ExactPath:
    """The path of a sequence, built command by command; `commands` are for a controller."""

    parts: list[Line | Curve] = field(default_factory=list[Line | Curve])
    commands: list[str] = field(default_factory=list[str])
    tip: tuple[float, float] = (0.0, 0.0)

    def line_to(self, x: int, y: int) -> ExactPath:
        """Add VP x,y."""
        self.parts.append(Line(self.tip, (x, y)))
        self.commands.append(f"VP {x},{y}")
        self.tip = (x, y)
        return self

    def arc(self, radius: int, angle: int, turn: int) -> ExactPath:
        """Add CR radius,angle,turn, which begins where the path is."""
        x, y = self.tip
        centre = (x - radius * cos(radians(angle)), y - radius * sin(radians(angle)))
        self.parts.append(Curve(centre, radius, angle, turn))
        self.commands.append(f"CR {radius},{angle},{turn}")
        self.tip = self.parts[-1].at(self.parts[-1].length)
        return self

    @property
    def length(self) -> float:
        """Length of the path [counts]."""
        return sum(part.length for part in self.parts)

    def at(self, s: float) -> tuple[float, float]:
        """Return the point at the way `s` along the path [counts]."""
        for part in self.parts:
            if s <= part.length:
                return part.at(s)
            s -= part.length
        return self.tip


@dataclass(frozen=True)
class Trapezoid:
    """The way along a path of a certain length, at rest at both ends, at constant rates [counts, s]."""

    length: float
    speed: float
    acceleration: float
    deceleration: float

    @property
    def peak(self) -> float:
        """The largest speed on the way."""
        up, down = self.acceleration, self.deceleration
        return min(self.speed, sqrt(2.0 * self.length * up * down / (up + down)))

    @property
    def duration(self) -> float:
        """Its duration."""
        peak = self.peak
        ramps = 0.5 * peak * peak * (1.0 / self.acceleration + 1.0 / self.deceleration)
        return peak / self.acceleration + peak / self.deceleration + (self.length - ramps) / peak

    def at(self, t: float) -> tuple[float, float]:
        """Return the way and the speed at a time."""
        peak, left = self.peak, self.duration - t
        if left <= 0.0:
            return self.length, 0.0
        if left < peak / self.deceleration:
            return self.length - 0.5 * self.deceleration * left * left, self.deceleration * left
        if t < peak / self.acceleration:
            return 0.5 * self.acceleration * t * t, self.acceleration * t
        return peak * t - 0.5 * peak * peak / self.acceleration, peak
