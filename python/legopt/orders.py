"""Solutions in the coordinate order of other robotics libraries, by the names of joints.

legopt's vector is x = [joints ..., base x y z, base quaternion w x y z]. The others have the base first:

* Pinocchio  q = [x y z, quaternion x y z w, joints ...]; an unbounded (URDF: continuous) joint is cos, sin
* Drake      q = [quaternion w x y z, x y z, joints ...]
* MuJoCo     qpos = [x y z, quaternion w x y z, joints ...]

and have their own order of joints, Pinocchio the alphabetical one. None of them needs to be installed: each function
takes their model, of which it uses only the listed members, or a list of joint names.

    order = legopt.orders.pinocchio(waypoints.joint_names, model)
    q = order.from_legopt(waypoints)
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .errors import RequestError
from .rows import require
from .waypoints import Waypoints

_BASE = 7  # numbers of a floating base: position and quaternion
_UNITS_APART = 1e-9  # rad or m: allowed deviation of a joint that the other model lacks from its fixed value


@dataclasses.dataclass(frozen=True)
class _Joint:
    """A joint of one number, or of its cos and sin, beginning at index `place`."""

    name: str
    place: int
    width: int = 1


@dataclasses.dataclass(frozen=True)
class Order:
    """Maps the numbers of legopt's vectors to those of another library. Made by pinocchio(), drake() and
    mujoco()."""

    library: str
    joint_names: Sequence[str]  #: legopt's, in legopt's order
    size: int  #: size of the other library's vector
    base_position: Sequence[int]  #: indices of x y z in it
    base_quaternion: Sequence[int]  #: indices of w x y z in it
    joints: Sequence[_Joint]  #: joints of the other library
    others: Mapping[str, float]

    def from_legopt(self, x: Any) -> Any:
        """Converts a vector of legopt's, or several (a list, an array or a frame of waypoints), to the other library.
        Returns an array for an array, else lists. RequestError for a wrong length, or if a joint that the other model
        lacks differs from its value in `others`."""
        return _each(x, len(self.joint_names) + _BASE, "legopt", self._from_legopt)

    def to_legopt(self, q: Any) -> Any:
        """Converts a vector of the other library, or several, to legopt; as from_legopt()."""
        return _each(q, self.size, self.library, self._to_legopt)

    def _from_legopt(self, x: Sequence[float]) -> list[float]:
        mine = {**self.others, **dict(zip(self.joint_names, x))}
        known = {joint.name for joint in self.joints}
        for name, value in zip(self.joint_names, x):
            if name not in known and abs(value - self.others[name]) > _UNITS_APART:
                raise RequestError(f"joint '{name}' is at {value:g}, and the model of {self.library} holds it at "
                                   f"{self.others[name]:g}; free it there")
        q = [0.0] * self.size
        for place, value in zip((*self.base_position, *self.base_quaternion), x[-_BASE:]):
            q[place] = value
        for joint in self.joints:
            value = mine[joint.name]
            numbers = [value] if joint.width == 1 else [math.cos(value), math.sin(value)]
            q[joint.place:joint.place + joint.width] = numbers
        return q

    def _to_legopt(self, q: Sequence[float]) -> list[float]:
        theirs = dict(self.others)
        ours = set(self.joint_names)
        for joint in self.joints:
            value = q[joint.place]
            if joint.width == 2:
                value = math.atan2(q[joint.place + 1], value)
            if joint.name not in ours and abs(value - self.others[joint.name]) > _UNITS_APART:
                raise RequestError(f"joint '{joint.name}' of {self.library} is at {value:g}, and legopt's robot holds "
                                   f"it at {self.others[joint.name]:g}")
            theirs[joint.name] = value
        return [*(theirs[name] for name in self.joint_names), *(q[place] for place in self.base_position),
                *(q[place] for place in self.base_quaternion)]


def pinocchio(joint_names: Sequence[str], model: Any, *, others: Mapping[str, float] | None = None,
              continuous: Iterable[str] = ()) -> Order:
    """Returns the order of Pinocchio's q. `model`: a pinocchio.Model with a free-flyer (`names`, `nqs`, `idx_qs` are
    used), or names of joints in its order, with or without "universe" and "root_joint"; `continuous`: those of such a
    list that are cos, sin. `others`: joints that only one of the two robots has, with their fixed values (rad, m).
    RequestError for joints that only one has, none or several free-flyers, or a joint of another kind."""
    if not hasattr(model, "idx_qs"):
        names = [name for name in model if name not in ("universe", "root_joint")]
        return _of_names("Pinocchio", joint_names, names, others, [0, 1, 2], [6, 3, 4, 5], set(continuous))
    bases, joints = [], []
    for name, place, width in zip(model.names, model.idx_qs, model.nqs):
        if width == _BASE:
            bases.append((str(name), int(place)))
        elif width != 0:  # "universe"
            joints.append(_Joint(str(name), int(place), int(width)))
    start = _one_base("Pinocchio", bases, "build the model with pinocchio.JointModelFreeFlyer()")
    return _checked(Order("Pinocchio", list(joint_names), int(model.nq), [start, start + 1, start + 2],
                          [start + 6, start + 3, start + 4, start + 5], joints, dict(others or {})))


def drake(joint_names: Sequence[str], plant: Any, model_instance: Any = None, *,
          others: Mapping[str, float] | None = None) -> Order:
    """Returns the order of Drake's q. `plant`: a finalized MultibodyPlant (`GetJointIndices`, `get_joint`, and of
    joints `name`, `position_start`, `num_positions` are called), or names of joints in the order of their positions,
    without the floating base. `model_instance`: q is that of plant.GetPositions(context, model_instance). `others` and
    errors: as in pinocchio()."""
    if not hasattr(plant, "GetJointIndices"):
        return _of_names("Drake", joint_names, list(plant), others, [4, 5, 6], [0, 1, 2, 3], set())
    indices = plant.GetJointIndices() if model_instance is None else plant.GetJointIndices(model_instance)
    found = sorted(((joint.position_start(), joint.num_positions(), joint.name())
                    for joint in map(plant.get_joint, indices) if joint.num_positions() > 0))
    # The vector of one instance has only its own numbers, in their order.
    bases, joints, place = [], [], 0
    for _, width, name in found:
        if width == _BASE:
            bases.append((name, place))
        else:
            joints.append(_Joint(name, place, width))
        place += width
    start = _one_base("Drake", bases,
                      "leave its root link free, and name the robot's model_instance where there are others")
    return _checked(Order("Drake", list(joint_names), place, [start + 4, start + 5, start + 6],
                          [start, start + 1, start + 2, start + 3], joints, dict(others or {})), plain=True)


def mujoco(joint_names: Sequence[str], model: Any, *, others: Mapping[str, float] | None = None) -> Order:
    """Returns the order of MuJoCo's qpos. `model`: a mujoco.MjModel (`njnt`, `jnt_type`, `jnt_qposadr`, `nq` and
    `joint(i).name` are used), or names of its joints in their order, without the free joint. `others` and errors: as in
    pinocchio()."""
    if not hasattr(model, "jnt_qposadr"):
        return _of_names("MuJoCo", joint_names, list(model), others, [0, 1, 2], [3, 4, 5, 6], set())
    widths = {0: _BASE, 1: 4, 2: 1, 3: 1}  # free, ball, slide, hinge
    bases, joints = [], []
    for number in range(model.njnt):
        name, place = model.joint(number).name, int(model.jnt_qposadr[number])
        width = widths[int(model.jnt_type[number])]
        if width == _BASE:
            bases.append((name, place))
        else:
            joints.append(_Joint(name, place, width))
    start = _one_base("MuJoCo", bases, "give its root body a <freejoint/>, and leave other free bodies out")
    return _checked(Order("MuJoCo", list(joint_names), int(model.nq), [start, start + 1, start + 2],
                          [start + 3, start + 4, start + 5, start + 6], joints, dict(others or {})), plain=True)


def _of_names(library: str, joint_names: Sequence[str], names: Sequence[str], others: Mapping[str, float] | None,
              position: list[int], quaternion: list[int], continuous: set[str]) -> Order:
    unknown = sorted(continuous - set(names))
    if unknown:
        raise RequestError(f"continuous: {library}'s list has no joint {_quoted(unknown)}")
    joints, place = [], _BASE
    for name in names:
        joints.append(_Joint(name, place, 2 if name in continuous else 1))
        place += joints[-1].width
    return _checked(Order(library, list(joint_names), place, position, quaternion, joints, dict(others or {})))


def _one_base(library: str, bases: list[tuple[str, int]], fix: str) -> int:
    if len(bases) != 1:
        what = f"{len(bases)} floating bases ({_quoted([name for name, _ in bases])})" if bases else "no floating base"
        raise RequestError(f"the model of {library} has {what}; {fix}")
    return bases[0][1]


def _checked(order: Order, plain: bool = False) -> Order:
    """Raises RequestError unless each joint of either side belongs to the other, or is fixed by `others`. `plain`: no
    cos and sin."""
    ours, theirs = list(order.joint_names), [joint.name for joint in order.joints]
    for side, names in (("legopt's robot", ours), (f"the model of {order.library}", theirs)):
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise RequestError(f"{side} has several joints {_quoted(twice)}")
    odd = [joint.name for joint in order.joints if joint.width > (1 if plain else 2)]
    if odd:
        raise RequestError(f"{_quoted(odd)} of {order.library}: neither revolute nor prismatic; legopt has no "
                           "such joints")
    lost = [name for name in ours if name not in theirs and name not in order.others]
    new = [name for name in theirs if name not in ours and name not in order.others]
    if lost or new:
        parts = ([f"the model of {order.library} does not have {_quoted(lost)}"] if lost else []) + (
            [f"legopt's robot does not have {_quoted(new)}"] if new else [])
        raise RequestError("; ".join(parts) + "; say where they are held: others={'" + (lost + new)[0] + "': 0.0}")
    idle = sorted(name for name in order.others if name not in ours and name not in theirs)
    if idle:
        raise RequestError(f"others: neither robot has a joint {_quoted(idle)}")
    return order


def _quoted(names: Sequence[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)


def _each(given: Any, size: int, library: str, convert: Any) -> Any:
    """Applies `convert` to a vector, or to each of several; returns arrays for arrays."""
    values = given.x if isinstance(given, Waypoints) else given
    is_array = hasattr(values, "__array__")
    if is_array:
        values = require("numpy", "an array").asarray(values, dtype="float64").tolist()
    several = len(values) == 0 or hasattr(values[0], "__len__")  # an empty list contains no vectors
    vectors = list(values) if several else [values]
    for number, vector in enumerate(vectors):
        if len(vector) != size:
            where = f"vector {number}" if several else "the vector"
            raise RequestError(f"{where} has {len(vector)} numbers; those of {library} have {size} here")
    converted = [convert([float(value) for value in vector]) for vector in vectors]
    result = converted if several else converted[0]
    return require("numpy", "an array").array(result) if is_array else result
