"""What the bodies look like: simple solids in body frames, kept in a recording as one foxglove.SceneUpdate."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any, NamedTuple

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass

from activesteer.errors import RecordingError
from activesteer.recording.schemas import SCENE_SCHEMA, foxglove_schema

_FIELDS = {"box": "cubes", "cylinder": "cylinders", "sphere": "spheres"}


class Primitive(NamedTuple):
    """A solid that is fixed in the frame of a body.

    Attributes:
        body: Name of the body, or `world`.
        kind: `box`, `cylinder` (its axis along z) or `sphere` (an ellipsoid).
        size_m: Full extents along x, y, z of the solid [m].
        position_m: Centre in the body frame [m].
        quaternion: Orientation in the body frame, w x y z.
        rgba: Colour and opacity, 0 to 1.
    """

    body: str
    kind: str
    size_m: tuple[float, float, float]
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    rgba: tuple[float, float, float, float] = (0.5, 0.5, 0.5, 1.0)


@cache
def _scene_class() -> Any:
    """Return the message class, which protobuf makes at run time."""
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(foxglove_schema()).file:
        pool.Add(file)
    return GetMessageClass(pool.FindMessageTypeByName(SCENE_SCHEMA))


def encode_scene(primitives: Iterable[Primitive]) -> bytes:
    """Serialise primitives as a foxglove.SceneUpdate, one entity for each body.

    Args:
        primitives: The solids.

    Raises:
        RecordingError: a kind is unknown, or a number is missing or no number.
    """
    update = _scene_class()()
    entities: dict[str, Any] = {}
    for primitive in primitives:
        if primitive.kind not in _FIELDS:
            message = f"{primitive.body}: primitive of kind {primitive.kind!r}, known are: {', '.join(_FIELDS)}"
            raise RecordingError(message)
        if primitive.body not in entities:
            entity = entities[primitive.body] = update.entities.add(
                frame_id=primitive.body, id=primitive.body, frame_locked=True
            )
            entity.timestamp.SetInParent()
            entity.lifetime.SetInParent()
        solid = getattr(entities[primitive.body], _FIELDS[primitive.kind]).add()
        if primitive.kind == "cylinder":
            solid.bottom_scale = solid.top_scale = 1.0
        try:
            (w, x, y, z), (r, g, b, a) = primitive.quaternion, primitive.rgba
            for vector, values in ((solid.size, primitive.size_m), (solid.pose.position, primitive.position_m)):
                vector.x, vector.y, vector.z = (float(value) for value in values)
            for target, names, values in (
                (solid.pose.orientation, "xyzw", (x, y, z, w)),
                (solid.color, "rgba", (r, g, b, a)),
            ):
                for name, value in zip(names, values, strict=True):
                    setattr(target, name, float(value))
        except (TypeError, ValueError) as error:
            message = f"{primitive.body}: a number of the {primitive.kind} is missing or wrong: {primitive} ({error})"
            raise RecordingError(message) from None
    return update.SerializeToString()


def decode_scene(data: bytes) -> tuple[Primitive, ...]:
    """Read primitives back, those of each body in the order box, cylinder, sphere.

    Args:
        data: A serialised foxglove.SceneUpdate.

    Raises:
        google.protobuf.message.DecodeError: it is none.
    """
    update = _scene_class().FromString(data)
    primitives: list[Primitive] = []
    for entity in update.entities:
        for kind, field in _FIELDS.items():
            for solid in getattr(entity, field):
                at, turn, size, color = solid.pose.position, solid.pose.orientation, solid.size, solid.color
                primitives.append(
                    Primitive(
                        entity.frame_id,
                        kind,
                        (size.x, size.y, size.z),
                        (at.x, at.y, at.z),
                        (turn.w, turn.x, turn.y, turn.z),
                        (color.r, color.g, color.b, color.a),
                    )
                )
    return tuple(primitives)
