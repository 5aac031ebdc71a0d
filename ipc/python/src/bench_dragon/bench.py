"""The benches of a frame: their boards' centres, headings and velocities.

A bench lies between its two handles, the hinges at its front and rear. Both handles have the same distance from the
board's ends. So the board's centre is the midpoint of the handles. The board is rigid, so the centre's velocity is the
mean of the handles' velocities.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Benches:
    """Positions and motion of N benches, head first."""

    centres: NDArray[np.float64]
    """Centres of the boards in metres: shape (N, 3)."""
    headings: NDArray[np.float64]
    """Directions from the rear handles to the front ones, in radians counter-clockwise from +x, −π to π: shape (N,)."""
    velocities: NDArray[np.float64]
    """Velocities of the centres in metres per show second: shape (N, 3)."""
    turn_rates: NDArray[np.float64]
    """Rates of the headings in radians per show second, counter-clockwise: shape (N,)."""
    pitches: NDArray[np.float64]
    """Angles by which the front handles are above the rear ones, in radians, 0 on level ground: shape (N,)."""

    @classmethod
    def between(
        cls, positions: NDArray[np.float64], velocities: NDArray[np.float64], heads: Sequence[int] = ()
    ) -> "Benches":
        """Returns the N benches between N + 1 handles. `heads` are the first handles of further dragons: no bench lies
        between such a handle and the one before it.

        `positions` are in metres and `velocities` in metres per show second, both of shape (N + 1, 3), head first.

        >>> benches = Benches.between(np.array([[1.0, 3.0, 0.0], [1.0, 1.0, 0.0]]), np.array([[-0.5, 0, 0], [0, 0, 0]]))
        >>> benches.centres.tolist(), benches.velocities.tolist(), benches.turn_rates.tolist()
        ([[1.0, 2.0, 0.0]], [[-0.25, 0.0, 0.0]], [0.25])
        >>> Benches.between(np.array([[2.0, 0, 1.0], [1.0, 0, 0]]), np.zeros((2, 3))).pitches.tolist() == [np.pi / 4]
        True
        """
        fronts = np.delete(np.arange(len(positions) - 1), [head - 1 for head in heads]) if heads else slice(None, -1)
        rears = fronts + 1 if heads else slice(1, None)
        front, rear, velocity, rear_velocity = positions[fronts], positions[rears], velocities[fronts], velocities[rears]
        along = (front - rear)[:, :2]
        against = (velocity - rear_velocity)[:, :2]
        squared = along[:, 0] * along[:, 0] + along[:, 1] * along[:, 1]
        turn = along[:, 0] * against[:, 1] - along[:, 1] * against[:, 0]
        return cls(
            centres=(front + rear) / 2,
            headings=np.arctan2(along[:, 1], along[:, 0]),
            velocities=(velocity + rear_velocity) / 2,
            turn_rates=np.divide(turn, squared, out=np.zeros_like(turn), where=squared > 0),
            pitches=np.arctan2(front[:, 2] - rear[:, 2], np.sqrt(squared)),
        )

    @property
    def speeds(self) -> NDArray[np.float64]:
        """Speeds of the centres in metres per show second: shape (N,)."""
        speeds: NDArray[np.float64] = np.linalg.norm(self.velocities, axis=1)
        return speeds

    def __len__(self) -> int:
        """Number N of benches."""
        return len(self.centres)
