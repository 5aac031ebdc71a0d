"""The dragons of a frame, by their names and numbers."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench_dragon.bench import Benches

if TYPE_CHECKING:
    from bench_dragon.frame import DragonMotion


@dataclass(frozen=True, eq=False)
class DragonFrame:
    """One dragon of a frame. Its positions and velocities are in the frame's memory, and hold the frame."""

    motion: "DragonMotion"
    """Travel and speed of its head, and what it does."""
    positions: NDArray[np.float64]
    """Positions of its handles in metres, head first: shape (N + 1, 3), read-only."""
    velocities: NDArray[np.float64]
    """Velocities of its handles in metres per show second, head first: shape (N + 1, 3), read-only."""

    @cached_property
    def benches(self) -> Benches:
        """Centres, headings, velocities and turn rates of its N benches, head first. The arrays are new ones and do not
        hold the frame."""
        return Benches.between(self.positions, self.velocities)


class Dragons:
    """The dragons of a frame, the leading one first: `dragons["gold"]`, `dragons[0]`, `for dragon in dragons`."""

    def __init__(
        self,
        positions: NDArray[np.float64],
        velocities: NDArray[np.float64],
        motions: list["DragonMotion"],
        names: Callable[[], tuple[str, ...]],
    ) -> None:
        self._all = [DragonFrame(motion, positions[motion.handles], velocities[motion.handles]) for motion in motions]
        self._names = names

    @property
    def names(self) -> tuple[str, ...]:
        """The names in the configuration's order; empty for a show of one dragon without `[[dragons]]`."""
        return self._names()

    def __getitem__(self, dragon: str | int) -> DragonFrame:
        """Returns a dragon by its name or its number. Raises `KeyError` for a name, `IndexError` for a number, that the
        show does not have."""
        if isinstance(dragon, int):
            return self._all[dragon]
        names = self.names
        if dragon not in names:
            raise KeyError(f"no dragon is named {dragon!r}; names: {', '.join(names) or 'none'}")
        return self._all[names.index(dragon)]

    def __iter__(self) -> Iterator[DragonFrame]:
        return iter(self._all)

    def __len__(self) -> int:
        """Number of dragons."""
        return len(self._all)
