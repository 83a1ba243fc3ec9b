"""What a controller says of its burned memories since it last powered up (_RS)."""

from __future__ import annotations

from dataclasses import dataclass

from dmc41x3.errors import MemoryDamaged

_VARIABLES, _PARAMETERS, _PROGRAM, _MASTER = 1, 2, 4, 8


@dataclass(frozen=True, slots=True)
class Burned:
    """Which memories passed their checksum: parameters (BN), program (BP), variables and arrays (BV).

    `master` is False where the controller came up from a master reset that failed.
    """

    parameters: bool = True
    program: bool = True
    variables: bool = True
    master: bool = True

    @classmethod
    def of(cls, bits: int) -> Burned:
        """Return what `_RS` says: bit 0 variables, 1 parameters, 2 program, 3 master reset; a set bit is an error."""
        return cls(
            parameters=not bits & _PARAMETERS,
            program=not bits & _PROGRAM,
            variables=not bits & _VARIABLES,
            master=not bits & _MASTER,
        )

    @property
    def damaged(self) -> tuple[str, ...]:
        """Names of what is damaged."""
        sound = {
            "parameters": self.parameters,
            "program": self.program,
            "variables": self.variables,
            "master reset": self.master,
        }
        return tuple(name for name, holds in sound.items() if not holds)

    def require_sound(self) -> None:
        """Raise `MemoryDamaged` where anything is damaged."""
        if self.damaged:
            raise MemoryDamaged(what=", ".join(self.damaged))
