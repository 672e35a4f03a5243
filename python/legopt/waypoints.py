"""The solution of a job: one vector per waypoint, joints first, then the base."""

from __future__ import annotations

import dataclasses
import struct
from typing import TYPE_CHECKING

from .errors import DatabaseError
from .rows import Rows, require

if TYPE_CHECKING:
    import numpy
    import pandas

BASE_NAMES = ["base_x_m", "base_y_m", "base_z_m", "base_qw", "base_qx", "base_qy", "base_qz"]

#: Tasks whose solutions are paths: a time stamp follows each configuration.
TIMED_TASKS = ("continuous", "balanced", "timed")


@dataclasses.dataclass(frozen=True)
class Waypoints:
    """Rows of x = [joints ..., base x y z, base quaternion w x y z]: radians (metres for prismatic joints), metres; the
    base is the robot's root link, in the world frame."""

    job_id: int
    x: list[list[float]]
    joint_names: list[str] | None  #: None: not stored in the database
    #: times of rows of a path, the solution of a continuous, balanced or timed motion, in steps from waypoint to waypoint:
    #: waypoint w is the row at time w; None: every row is a waypoint
    times: list[float] | None = None
    first_waypoint: int = 0  #: number of the first row in its motion

    def __len__(self) -> int:
        return len(self.x)

    @property
    def names(self) -> list[str]:
        """Returns the column names: the joints (joint_0, ... if their names are not stored) and BASE_NAMES."""
        joints = len(self.x[0]) - len(BASE_NAMES) if self.x else 0
        return [*(self.joint_names or [f"joint_{i}" for i in range(joints)]), *BASE_NAMES]

    @property
    def joints(self) -> list[list[float]]:
        """Returns the joints of each waypoint, in the order of `joint_names`."""
        return [row[:-7] for row in self.x]

    @property
    def base_position(self) -> list[list[float]]:
        """Returns x y z of each waypoint, metres."""
        return [row[-7:-4] for row in self.x]

    @property
    def base_quaternion(self) -> list[list[float]]:
        """Returns w x y z of each waypoint, from the base's frame to the world's."""
        return [row[-4:] for row in self.x]

    def array(self) -> numpy.ndarray:
        """Returns float64, waypoints x (joints + 7). MissingPackageError without NumPy."""
        return require("numpy", "an array").array(self.x, dtype="float64").reshape(-1, len(self.names))

    def rows(self) -> Rows:
        """Returns one row per waypoint with its number, or for a path its time, and a column for each of `names`."""
        columns = ["waypoint" if self.times is None else "time", *self.names]
        first = self.first_waypoint
        places = range(first, first + len(self.x)) if self.times is None else self.times
        return Rows(columns, (dict(zip(columns, [at, *row], strict=True)) for at, row in zip(places, self.x, strict=True)))

    def frame(self) -> pandas.DataFrame:
        """Returns `rows()` as a DataFrame, indexed by waypoint (or time). MissingPackageError without pandas."""
        rows = self.rows()
        return rows.frame().set_index(rows.columns[0])


def decode_waypoint(blob: bytes, source: str) -> list[float]:
    """Decodes little-endian float64 values. DatabaseError, with `source` in its message, if they are damaged."""
    if len(blob) % 8 != 0 or len(blob) < 8 * len(BASE_NAMES):
        raise DatabaseError(f"{source}: a waypoint of {len(blob)} bytes cannot be read; "
                            "'legopt service doctor --db FILE' checks the database")
    return list(struct.unpack(f"<{len(blob) // 8}d", blob))
