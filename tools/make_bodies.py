"""Makes the bodies that cars are drawn with, models/bodies/*.npz: surfaces lofted through cross-sections, and a wheel.

Each file holds the parts of one body by colour: `PART_vertices` [m], `PART_normals` and `PART_faces`. Origin and axes
are those of the vehicle: on the road below the front axle, x forward, y left, z up. What is drawn has no mass and
touches nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

FOLDER: Final = Path(__file__).resolve().parents[1] / "models" / "bodies"
ARCH_M: Final = 0.365
"""Radius of the wheel arches [m]. The wheels are 0.31 to 0.35 m."""
AXLE_HEIGHT_M: Final = 0.31
SIDE, PILLAR, ROOF = 7, 5, 6
"""Points of half a cross-section: from the lower edge to the belt line, from there to the edge of the roof, and on to
the middle of the roof."""

Array = NDArray[np.float64]
Mesh = tuple[Array, Array, NDArray[np.int64]]


class Shape(NamedTuple):
    """A body, as lines over x [m].

    Attributes:
        wheelbase_m: Distance of its axles [m].
        top: Height of the middle of the body: x [m], z [m].
        half_width: Half of its width at the belt line: x [m], y [m].
        belt_m: Height of the belt line at the windscreen and at the rear end [m].
        windscreen_m: Lower and upper end of the windscreen, x [m].
        rear_window_m: Upper and lower end of the rear window, x [m].
        pillars_m: Ends of the pillars between the side windows, x [m], pairs.
        seams_m: Where doors end, x [m].
        mirror_m: Where the mirrors are, x [m].
    """

    wheelbase_m: float
    top: Sequence[tuple[float, float]]
    half_width: Sequence[tuple[float, float]]
    belt_m: tuple[float, float]
    windscreen_m: tuple[float, float]
    rear_window_m: tuple[float, float]
    pillars_m: Sequence[tuple[float, float]]
    seams_m: Sequence[float]
    mirror_m: float


HATCHBACK: Final = Shape(
    wheelbase_m=2.637,
    top=((0.85, 0.55), (0.83, 0.64), (0.77, 0.71), (0.6, 0.79), (0.3, 0.88), (-0.02, 0.95), (-0.25, 1.0),
         (-0.95, 1.4), (-1.2, 1.46), (-1.7, 1.485), (-2.3, 1.465), (-2.8, 1.41), (-2.98, 1.375), (-3.22, 1.08),
         (-3.31, 0.97), (-3.36, 0.82), (-3.387, 0.62)),
    half_width=((0.85, 0.52), (0.83, 0.62), (0.77, 0.72), (0.6, 0.81), (0.3, 0.87), (0.0, 0.895), (-1.3, 0.9),
                (-2.4, 0.895), (-2.9, 0.87), (-3.2, 0.82), (-3.31, 0.78), (-3.36, 0.74), (-3.387, 0.66)),
    belt_m=(0.93, 1.02),
    windscreen_m=(-0.25, -0.95),
    rear_window_m=(-3.0, -3.21),
    pillars_m=((-1.52, -1.62), (-2.5, -2.6), (-2.82, -3.4)),
    seams_m=(-0.42, -1.57, -2.24),
    mirror_m=-0.62,
)  # fmt: skip
SALOON: Final = Shape(
    wheelbase_m=2.85,
    top=((0.85, 0.55), (0.83, 0.63), (0.77, 0.69), (0.6, 0.76), (0.3, 0.84), (-0.1, 0.91), (-0.35, 0.95),
         (-1.1, 1.34), (-1.35, 1.4), (-1.8, 1.43), (-2.2, 1.415), (-2.5, 1.365), (-3.08, 1.08), (-3.2, 1.055),
         (-3.45, 1.04), (-3.52, 1.01), (-3.57, 0.88), (-3.6, 0.62)),
    half_width=((0.85, 0.54), (0.83, 0.64), (0.77, 0.75), (0.6, 0.84), (0.3, 0.9), (0.0, 0.925), (-1.3, 0.93),
                (-2.6, 0.925), (-3.1, 0.9), (-3.4, 0.85), (-3.52, 0.8), (-3.57, 0.76), (-3.6, 0.68)),
    belt_m=(0.91, 0.99),
    windscreen_m=(-0.35, -1.1),
    rear_window_m=(-2.5, -3.06),
    pillars_m=((-1.62, -1.71), (-2.5, -3.6)),
    seams_m=(-0.55, -1.66, -2.42),
    mirror_m=-0.75,
)  # fmt: skip


def line(points: Sequence[tuple[float, float]]) -> Callable[[Array], Array]:
    """Straight lines from point to point, with falling x."""
    x, y = np.array(points[::-1]).T
    return lambda at: np.interp(at, x, y)


def stations(shape: Shape) -> Array:
    """Positions of the cross-sections, x [m], from the nose to the tail."""
    ends = [point[0] for point in shape.top] + [point[0] for point in shape.half_width]
    ends += [*shape.windscreen_m, *shape.rear_window_m, *np.ravel(shape.pillars_m)]
    for seam in shape.seams_m:
        ends += [seam - 0.006, seam + 0.006]
    for axle in (0.0, -shape.wheelbase_m):
        ends += list(axle + ARCH_M * np.cos(np.linspace(0.0, np.pi, 15)))
    front, rear = shape.top[0][0], shape.top[-1][0]
    x = np.array(sorted({round(float(end), 4) for end in [*ends, *np.arange(rear, front, 0.12)]}, reverse=True))
    return x[(x <= front) & (x >= rear)]


def sections(shape: Shape, x: Array) -> Array:
    """The left half of the surface, shape (stations, points, 3): from the lower edge to the middle of the roof."""
    top, width = line(shape.top)(x), line(shape.half_width)(x)
    along = np.clip((shape.windscreen_m[0] - x) / (shape.windscreen_m[0] - x[-1]), 0.0, 1.0)
    belt = np.minimum(shape.belt_m[0] + (shape.belt_m[1] - shape.belt_m[0]) * along, top - 0.05)
    bumper = np.clip((np.minimum(x[0] - x, x - x[-1])) / 0.3, 0.0, 1.0)
    low = 0.3 - 0.1 * np.sqrt(bumper)
    for axle in (0.0, -shape.wheelbase_m):
        arch = AXLE_HEIGHT_M + np.sqrt(np.maximum(ARCH_M**2 - (x - axle) ** 2, 0.0))
        low = np.where(np.abs(x - axle) < ARCH_M - 1e-6, np.maximum(low, arch), low)
    height = top - belt
    inward = 0.02 + 0.42 * np.maximum(height - 0.06, 0.0)
    points = np.empty((len(x), SIDE + PILLAR + ROOF, 3))
    points[..., 0] = x[:, None]
    up = np.linspace(0.0, 1.0, SIDE)
    z = low[:, None] + (belt - low)[:, None] * up
    whole = np.clip((z - 0.2) / np.maximum(belt - 0.2, 0.1)[:, None], 0.0, 1.0)
    # Widest a little below the belt line, drawn in at the sill.
    points[:, :SIDE, 1] = width[:, None] * (1.0 - 0.07 * (1.0 - whole) ** 2 - 0.028 * whole**6)
    points[:, :SIDE, 2] = z
    shoulder = points[:, SIDE - 1, 1]
    up = np.linspace(0.0, 1.0, PILLAR + 1)[1:]
    points[:, SIDE : SIDE + PILLAR, 1] = shoulder[:, None] - inward[:, None] * (0.12 + 0.88 * up**1.15)
    points[:, SIDE : SIDE + PILLAR, 2] = (belt + 0.015)[:, None] + (0.84 * height - 0.015)[:, None] * up
    edge = points[:, SIDE + PILLAR - 1]
    turn = np.linspace(0.0, 0.5 * np.pi, ROOF + 1)[1:]
    points[:, SIDE + PILLAR :, 1] = edge[:, 1:2] * np.cos(turn)
    points[:, SIDE + PILLAR :, 2] = edge[:, 2:] + (top - edge[:, 2])[:, None] * np.sin(turn) ** 0.8
    points[:, -1, 1] = 0.0
    return points


def colours(shape: Shape, x: Array) -> NDArray[np.str_]:
    """Material of each four-sided face of half the surface, shape (stations - 1, points - 1)."""
    middle = 0.5 * (x[1:] + x[:-1])[:, None]
    point = np.arange(SIDE + PILLAR + ROOF - 1)[None]
    found = np.full((len(middle), point.size), "paint", "U8")
    in_side = (point >= SIDE) & (point < SIDE + PILLAR - 2)
    on_top = point >= SIDE + PILLAR - 1
    (screen, screen_top), (rear_top, rear) = shape.windscreen_m, shape.rear_window_m
    windows = in_side & (middle < screen - 0.3) & (middle > rear + 0.12)
    for front_end, rear_end in shape.pillars_m:
        windows &= ~((middle < front_end) & (middle > rear_end))
    found[windows] = "glass"
    screens = ((middle < screen) & (middle > screen_top)) | ((middle < rear_top) & (middle > rear))
    found[screens & on_top] = "glass"
    for seam in shape.seams_m:
        found[(np.abs(middle - seam) < 0.007) & (point > 0) & (point < SIDE)] = "trim"
    # Sills, and the lower edges of the bumpers.
    arch = np.minimum(np.abs(middle), np.abs(middle + shape.wheelbase_m)) < ARCH_M
    found[(point < 1) & ~arch] = "trim"
    return found


def normals_of(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """Normals of vertices, as the normals of the faces around each weighted with their area."""
    a, b, c = (vertices[faces[:, number]] for number in range(3))
    across = np.cross(b - a, c - a)
    found = np.zeros_like(vertices)
    for number in range(3):
        np.add.at(found, faces[:, number], across)
    return found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-12)


def mirrored(mesh: Mesh) -> Mesh:
    """The same on the right side."""
    vertices, normals, faces = mesh
    flip = np.array([1.0, -1.0, 1.0])
    return vertices * flip, normals * flip, faces[:, ::-1]


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one, without vertices that no face uses."""
    start, faces = 0, []
    for mesh in meshes:
        faces.append(mesh[2] + start)
        start += len(mesh[0])
    used, numbers = np.unique(np.concatenate(faces), return_inverse=True)
    vertices = np.concatenate([mesh[0] for mesh in meshes])[used]
    normals = np.concatenate([mesh[1] for mesh in meshes])[used]
    return vertices, normals, numbers.reshape(-1, 3)


def grid_faces(rows: int, columns: int) -> NDArray[np.int64]:
    """Two triangles for each four-sided face of a grid, shape (rows - 1, columns - 1, 2, 3)."""
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)[None])[..., None]
    right, below = first + 1, first + columns
    one = np.concatenate([first, right, below], axis=-1)
    two = np.concatenate([right, below + 1, below], axis=-1)
    return np.stack([one, two], axis=2)


def surface(points: Array) -> Mesh:
    """A grid of points as a mesh."""
    vertices, faces = points.reshape(-1, 3), grid_faces(*points.shape[:2]).reshape(-1, 3)
    return vertices, normals_of(vertices, faces), faces


def ellipsoid(centre: Sequence[float], size: Sequence[float], power: float = 0.5) -> Mesh:
    """A rounded block, for a power of 1 an ellipsoid, below it more of a block."""
    across, up = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 13), np.linspace(-0.5 * np.pi, 0.5 * np.pi, 7))

    def rounded(value: Array) -> Array:
        return np.sign(value) * np.abs(value) ** power

    level = rounded(np.cos(up))
    unit = [level * rounded(np.cos(across)), level * rounded(np.sin(across)), rounded(np.sin(up))]
    points = np.stack(unit, axis=-1) * (0.5 * np.array(size)) + np.array(centre)
    vertices, _, faces = surface(points)
    a, b, c = (vertices[faces[:, number]] for number in range(3))
    faces = faces[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-9]
    return vertices, normals_of(vertices, faces), faces


def body(shape: Shape) -> dict[str, Mesh]:
    """The parts of a body by colour."""
    x = stations(shape)
    points = sections(shape, x)
    half = points.reshape(-1, 3)
    faces = grid_faces(*points.shape[:2])[..., ::-1]
    everything = faces.reshape(-1, 3)
    normals = normals_of(half, everything)
    normals[np.abs(half[:, 1]) < 1e-9, 1] = 0.0  # across the middle it is smooth
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    looks = colours(shape, x)
    left: dict[str, list[Mesh]] = {}
    for look in np.unique(looks):
        left.setdefault(str(look), []).append((half, normals, faces[looks == look].reshape(-1, 3)))
    for number, forward in ((0, 1.0), (-1, -1.0)):  # nose and tail
        ring = points[number]
        inner = np.column_stack([ring[:, 0], np.zeros(len(ring)), ring[:, 2]])
        cap = np.stack([ring, inner]) if forward > 0.0 else np.stack([inner, ring])
        left["paint"].append(surface(cap))
    # What is seen through the arches and below: dark, a little inside.
    lower = points[:, 0]
    inner = lower * np.array([1.0, 0.55, 1.0])
    left["trim"].append(surface(np.stack([lower, inner], axis=1)))
    left["trim"].append(surface(np.stack([inner, inner * np.array([1.0, 0.0, 1.0])], axis=1)))
    width, front, rear = line(shape.half_width), x[0], x[-1]
    left["lamp"] = [ellipsoid((front - 0.13, 0.9 * float(width(np.array(front - 0.13))), 0.655), (0.3, 0.24, 0.1))]
    left["tail"] = [ellipsoid((rear + 0.1, 0.9 * float(width(np.array(rear + 0.1))), 0.86), (0.2, 0.24, 0.15))]
    belt = shape.belt_m[0]
    mirror = float(width(np.array(shape.mirror_m)))
    left["paint"].append(ellipsoid((shape.mirror_m, mirror + 0.07, belt + 0.08), (0.12, 0.2, 0.13)))
    middle = {
        "trim": [
            ellipsoid((front - 0.03, 0.0, 0.42), (0.08, 0.9, 0.14), 0.3),
            ellipsoid((front + 0.0, 0.0, 0.58), (0.03, 0.6, 0.05), 0.3),
            ellipsoid((rear + 0.02, 0.0, 0.4), (0.06, 0.95, 0.12), 0.3),
        ],
        "plate": [
            ellipsoid((front + 0.005, 0.0, 0.47), (0.02, 0.5, 0.1), 0.2),
            ellipsoid((rear - 0.004, 0.0, 0.66), (0.03, 0.5, 0.1), 0.2),
        ],
    }
    return {
        name: joined([*meshes, *(mirrored(mesh) for mesh in meshes), *middle.get(name, [])])
        for name, meshes in (left | {"plate": []}).items()
    }


def lathe(profile: Sequence[tuple[float, float]], parts: int = 36) -> Mesh:
    """A profile of radius and y, turned about the y axis."""
    turn = np.linspace(0.0, 2.0 * np.pi, parts + 1)
    radius, y = np.array(profile).T
    grid = np.stack(
        [np.outer(np.sin(turn), radius), np.tile(y, (len(turn), 1)), np.outer(np.cos(turn), radius)], axis=-1
    )
    return surface(grid[:, ::-1])


def wheel() -> dict[str, Mesh]:
    """A wheel of radius 1 and width 1 about the y axis, with five spokes on both sides, one of them marked."""
    tyre = lathe([(0.68, -0.5), (0.94, -0.5), (1.0, -0.36), (1.0, 0.36), (0.94, 0.5), (0.68, 0.5)])
    inside = [lathe([(0.0, -0.2), (0.68, -0.2), (0.68, -0.5)]), lathe([(0.68, 0.5), (0.68, 0.2), (0.0, 0.2)])]
    rings = [lathe([(0.6, -0.5), (0.7, -0.52)]), lathe([(0.7, 0.52), (0.6, 0.5)])]
    rings += [lathe([(0.0, 0.5), (0.16, 0.49)][::-1]), lathe([(0.0, -0.5), (0.16, -0.49)])]
    spokes: list[Mesh] = []
    mark: list[Mesh] = []
    for number in range(5):
        angle = 0.4 * np.pi * number
        cos, sin = np.cos(angle), np.sin(angle)
        turn = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
        for side in (-1.0, 1.0):
            corners = np.array([[-0.1, 0.48, 0.1], [0.1, 0.48, 0.1], [-0.065, 0.5, 0.64], [0.065, 0.5, 0.64]])
            corners[:, 1] *= side
            faces = np.array([[0, 1, 2], [1, 3, 2]])
            faces = faces[:, ::-1] if side > 0.0 else faces
            vertices = corners @ turn.T
            a, b, c = (vertices[faces[0, index]] for index in range(3))
            if np.cross(b - a, c - a)[1] * side < 0.0:
                faces = faces[:, ::-1]
            spoke = (vertices, normals_of(vertices, faces), faces)
            (mark if number == 0 else spokes).append(spoke)
    return {"tyre": tyre, "dark": joined(inside), "rim": joined([*rings, *spokes]), "mark": joined(mark)}


def main() -> None:
    """Writes the files."""
    FOLDER.mkdir(exist_ok=True)
    for name, parts in (("hatchback", body(HATCHBACK)), ("saloon", body(SALOON)), ("wheel", wheel())):
        arrays: dict[str, Any] = {}
        for part, (vertices, normals, faces) in sorted(parts.items()):
            arrays[f"{part}_vertices"] = vertices.astype(np.float32)
            arrays[f"{part}_normals"] = np.round(127.0 * normals).astype(np.int8)
            arrays[f"{part}_faces"] = faces.astype(np.uint16)
        np.savez_compressed(FOLDER / f"{name}.npz", **arrays)
        triangles = sum(len(mesh[2]) for mesh in parts.values())
        print(f"{name}: {triangles} triangles, {(FOLDER / f'{name}.npz').stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
