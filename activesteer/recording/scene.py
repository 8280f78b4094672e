"""Scene of a recording: solids in body frames and links between bodies, stored as a foxglove.SceneUpdate."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Any, Final, NamedTuple

from activesteer import limits
from activesteer.errors import RecordingError
from activesteer.recording.contents import check_names, check_numbers
from activesteer.recording.schemas import SCENE_SCHEMA, message_class

_FIELDS = {"box": "cubes", "cylinder": "cylinders", "sphere": "spheres"}
LINK_KINDS: Final = ("link", "spring", "damper")
"""Kinds of a `Link`."""
_MAX_SIZE_M: Final = 1e4
"""Largest size of a part, and largest distance from the origin of its body [m]."""
_LINK_KEY: Final = "activesteer.link"
"""Key in the metadata of an entity that makes it a link."""


class Primitive(NamedTuple):
    """Solid that is fixed in the frame of a body.

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


class Link(NamedTuple):
    """Straight part through points of bodies, such as a suspension link. The poses of the bodies move it.

    Attributes:
        name: Name of the part.
        kind: `link`, `spring` or `damper`.
        points: Name of the body and point in its frame [m]; at least two.
        radius_m: Radius in pictures [m].
        rgba: Colour and opacity, 0 to 1.
    """

    name: str
    kind: str
    points: tuple[tuple[str, tuple[float, float, float]], ...]
    radius_m: float = 0.01
    rgba: tuple[float, float, float, float] = (0.5, 0.5, 0.5, 1.0)


ScenePart = Primitive | Link
"""Part of a scene."""


def encode_scene(parts: Iterable[ScenePart]) -> bytes:
    """Serialise a scene as a foxglove.SceneUpdate.

    Every body with solids becomes an entity that is locked to its frame. A link becomes an entity without a solid, with
    its points in the metadata: Foxglove has no solid that spans two frames.
    """
    update = message_class(SCENE_SCHEMA)()
    entities: dict[str, Any] = {}
    parts = tuple(parts)
    for primitive in parts:
        if isinstance(primitive, Link):
            continue
        if primitive.kind not in _FIELDS:
            raise RecordingError(
                f"primitive of kind {primitive.kind!r}, known are: {', '.join(_FIELDS)}",
                key=primitive.body,
                value=primitive.kind,
            )
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
            for target, names, values in (
                (solid.size, "xyz", primitive.size_m),
                (solid.pose.position, "xyz", primitive.position_m),
                (solid.pose.orientation, "wxyz", primitive.quaternion),
                (solid.color, "rgba", primitive.rgba),
            ):
                for name, value in zip(names, values, strict=True):
                    setattr(target, name, float(value))
        except (TypeError, ValueError) as error:
            raise RecordingError(
                f"a number of the {primitive.kind} is missing or wrong: {primitive} ({error})", key=primitive.body
            ) from None
    for part in parts:
        if isinstance(part, Link):
            _add_link(update, part)
    data = update.SerializeToString()
    decode_scene(data)  # refuses here what a reader would refuse
    return data


def _add_link(update: Any, link: Link) -> None:
    if link.kind not in LINK_KINDS:
        raise RecordingError(
            f"link of kind {link.kind!r}, known are: {', '.join(LINK_KINDS)}", key=link.name, value=link.kind
        )
    try:
        text = json.dumps(_link_table(link))
        _link_of(json.loads(text))
    except (TypeError, ValueError) as error:
        raise RecordingError(
            f"a number of the {link.kind} is missing or wrong: {link} ({error})", key=link.name
        ) from None
    entity = update.entities.add(frame_id=link.points[0][0], id=link.name, frame_locked=True)
    entity.timestamp.SetInParent()
    entity.lifetime.SetInParent()
    entity.metadata.add(key=_LINK_KEY, value=text)


def _link_table(link: Link) -> dict[str, Any]:
    points = [[body, [float(value) for value in point]] for body, point in link.points]
    if len(points) < 2:
        raise ValueError("two points at least")
    colour = [float(value) for value in link.rgba]
    return {"name": link.name, "kind": link.kind, "points": points, "radius_m": float(link.radius_m), "rgba": colour}


def _link_of(table: dict[str, Any]) -> Link:
    points = []
    for body, (x_m, y_m, z_m) in table["points"]:
        points.append((str(body), (float(x_m), float(y_m), float(z_m))))
    r, g, b, a = (float(value) for value in table["rgba"])
    return Link(str(table["name"]), str(table["kind"]), tuple(points), float(table["radius_m"]), (r, g, b, a))


def decode_scene(data: bytes) -> tuple[ScenePart, ...]:
    """Read a scene: the solids of each body in the order box, cylinder, sphere, and then the links."""
    update = message_class(SCENE_SCHEMA).FromString(data)
    limits.check_count(len(update.entities), limits.MAX_PARTS, "entities", RecordingError, key="scene")
    primitives: list[ScenePart] = []
    for entity in update.entities:
        primitives += [_link_of(json.loads(pair.value)) for pair in entity.metadata if pair.key == _LINK_KEY]
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
    check_scene(primitives)
    return tuple(primitives)


def check_scene(parts: Sequence[ScenePart]) -> None:
    """Check that a scene can be drawn."""
    check_names([part.body if isinstance(part, Primitive) else part.name for part in parts], "parts", limits.MAX_PARTS)
    for part in parts:
        check_numbers(part.rgba, "colour", 0.0, 1.0)
        if isinstance(part, Primitive):
            check_numbers(part.size_m, f"size of a {part.kind} of {part.body}", 0.0, _MAX_SIZE_M)
            check_numbers((*part.position_m, *part.quaternion), f"pose of a {part.kind}", -_MAX_SIZE_M, _MAX_SIZE_M)
            continue
        if part.kind not in LINK_KINDS:
            raise RecordingError(f"{part.name}: link of kind {part.kind!r:.100}, known are: {', '.join(LINK_KINDS)}")
        if len(part.points) < 2:
            raise RecordingError(f"{part.name} has {len(part.points)} points, at least 2 are needed")
        check_names([body for body, _ in part.points], f"bodies of {part.name}", limits.MAX_PARTS)
        numbers = [number for _, point in part.points for number in point]
        check_numbers([*numbers, part.radius_m], f"place or radius of {part.name}", -_MAX_SIZE_M, _MAX_SIZE_M)
