"""Hypothesis strategies for valid and invalid sketches, and for all edits of the editor."""

from dataclasses import replace

from hypothesis import strategies as st

from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import (
    CircleObstacle,
    DiscStart,
    PointsStart,
    PolygonObstacle,
    UniformStart,
    WallObstacle,
)
from robocov.errors import MapError
from robocov_app.editor.edits import boolean, clipboard, create, properties, transform, vertices
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.selection import Change, Edge, Selection, list_vertices
from robocov_app.editor.model.sketch import BOUNDARY, Item, Sketch
from robocov_app.editor.model.validation import Problem, find_problems

HALL = ((0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0))


def list_problems(sketch: Sketch, radius: float = DEFAULT_RADIUS_M) -> tuple[Problem, ...]:
    return find_problems(sketch, radius)[0]


def renumber(sketch: Sketch) -> Sketch:
    """Return the sketch with keys 0, 1, ..., as after reading it from a file."""
    items = tuple(replace(item, key=key) for key, item in enumerate(sketch.obstacles))
    return replace(sketch, obstacles=items)


tenths = st.integers(-20, 140).map(lambda k: k / 10)
positions = st.tuples(tenths, tenths)
"""Positions in and around the hall in steps of 0.1 m."""
floats = st.floats(-1e6, 1e6, allow_nan=False).map(lambda x: x + 0.0)
any_positions = st.tuples(floats, floats)
names = st.one_of(st.none(), st.sampled_from(["desk", "west wall", "süd", "“a”"]), st.text(max_size=6))


def rings(points=positions, min_size=0, max_size=7):
    return st.lists(points, min_size=min_size, max_size=max_size).map(tuple)


_sizes = st.integers(-2, 30).map(lambda k: k / 10)


def shapes(points=positions, sizes=_sizes):
    """Return a strategy for obstacles, many of them invalid."""
    return st.one_of(
        st.builds(PolygonObstacle, rings(points), st.lists(rings(points), max_size=2).map(tuple), names),
        st.builds(CircleObstacle, points, sizes, names),
        st.builds(WallObstacle, rings(points), sizes, names),
    )


@st.composite
def valid_shapes(draw):
    """Draw obstacles that break no rule; they may overlap and extend beyond the boundary."""
    x, y = draw(positions)
    size = draw(st.integers(2, 30)) / 10
    kind = draw(st.sampled_from(["box", "ring", "triangle", "star", "circle", "wall", "bent"]))
    name = draw(st.sampled_from([None, "desk", "pillar"]))
    if kind == "circle":
        return CircleObstacle((x, y), size, name)
    if kind == "wall":
        return WallObstacle(((x, y), (round(x + size, 4), draw(tenths))), 0.1, name)
    if kind == "bent":
        return WallObstacle(
            ((x, y), (round(x + size, 4), y), (round(x + size, 4), round(y + 1, 4))), 0.2, name
        )

    def place_ring(*corners):
        return tuple((round(x + size * u, 4), round(y + size * v, 4)) for u, v in corners)

    box = place_ring((0, 0), (1, 0), (1, 1), (0, 1))
    if kind == "ring":
        return PolygonObstacle(box, (place_ring((0.2, 0.2), (0.8, 0.2), (0.8, 0.7), (0.2, 0.7)),), name)
    if kind == "triangle":
        return PolygonObstacle(place_ring((0, 0), (1, 0.3), (0.4, 1)), (), name)
    if kind == "star":
        return PolygonObstacle(
            place_ring((0, 0), (0.5, 0.3), (1, 0), (0.7, 0.5), (1, 1), (0.2, 0.8)), (), name
        )
    return PolygonObstacle(box, (), name)


starts = st.one_of(
    st.builds(DiscStart, positions, st.integers(0, 20).map(lambda k: k / 10)),
    st.builds(PointsStart, rings(positions, max_size=3)),
    st.just(UniformStart()),
)
json_values = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(-99, 99), st.text(max_size=4)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=2), st.dictionaries(st.text(max_size=4), inner, max_size=2)
    ),
    max_leaves=4,
)
backgrounds = st.builds(
    Background,
    path=st.sampled_from(["plan.png", "../plan.jpg"]),
    pixels=st.tuples(st.integers(1, 4000), st.integers(1, 4000)),
    scale=st.floats(1e-4, 10.0),
    corner=any_positions,
    rotation_deg=st.floats(-180.0, 180.0).map(lambda x: x + 0.0),
    opacity=st.floats(0.0, 1.0).map(lambda x: x + 0.0),
    shown=st.booleans(),
)


@st.composite
def drafts(draw, shape_strategy=None):
    """Draw sketches of all kinds, many of them invalid."""
    drawn_shapes = draw(st.lists(shapes() if shape_strategy is None else shape_strategy, max_size=5))
    notes = draw(st.lists(st.sampled_from(["", "", "ask Ada", "2 m high"]), min_size=5, max_size=5))
    return Sketch(
        name=draw(st.sampled_from(["Hall", "", "Büro 1"])),
        description=draw(st.sampled_from(["", "One floor."])),
        boundary=draw(st.one_of(st.none(), st.just(HALL), rings())),
        obstacles=tuple(Item(k, shape, notes[k]) for k, shape in enumerate(drawn_shapes)),
        starts=tuple(
            draw(st.dictionaries(st.sampled_from(["corner", "a b", "start"]), starts, max_size=2)).items()
        ),
        background=draw(st.one_of(st.none(), backgrounds)),
        extra=draw(st.dictionaries(st.sampled_from(["mine", "other"]), json_values, max_size=2)),
        schema=draw(st.sampled_from([None, "map.schema.json"])),
    )


@st.composite
def valid_sketches(draw, min_size=0, max_size=5):
    """Draw sketches with valid obstacles in a hall; starts may be blocked."""
    drawn_shapes = draw(st.lists(valid_shapes(), min_size=min_size, max_size=max_size))
    return Sketch(
        name="Hall",
        boundary=HALL,
        obstacles=tuple(Item(k, shape) for k, shape in enumerate(drawn_shapes)),
        starts=draw(
            st.sampled_from(
                [
                    (),
                    (("corner", DiscStart((1.0, 1.0), 0.8)),),
                    (("two", PointsStart(((1.0, 1.0), (2.0, 1.0)))), ("all", UniformStart())),
                ]
            )
        ),
    )


@st.composite
def selections(draw, sketch):
    """Draw selections of a sketch."""
    keys = [item.key for item in sketch.obstacles]
    chosen = draw(st.sets(st.sampled_from(keys), max_size=4)) if keys else set()
    named = [name for name, _ in sketch.starts if draw(st.booleans())]
    handles = [vertex for owner in (BOUNDARY, *keys, *named) for vertex, _ in list_vertices(sketch, owner)]
    picked = draw(st.sets(st.sampled_from(handles), max_size=3)) if handles and draw(st.booleans()) else set()
    boundary = sketch.boundary is not None and draw(st.integers(0, 4)) == 0
    return Selection(frozenset(chosen), frozenset(picked), frozenset(named), boundary)


_SOME_LENGTHS = st.sampled_from([0.05, 0.1, 0.3, 1.0, 2.5])
_SHIFTS = st.sampled_from([-1.3, -0.1, 0.0, 0.0333, 0.7, 3.0])


@st.composite
def changes(draw, sketch):
    """Draw a change by any edit of the editor; None if the edit is impossible."""
    selection = draw(selections(sketch))
    owners = [*(item.key for item in sketch.obstacles), *(name for name, _ in sketch.starts)]
    owner = draw(st.sampled_from(owners)) if owners else BOUNDARY
    a = draw(positions)
    b = draw(positions)
    length = draw(_SOME_LENGTHS)
    dx = draw(_SHIFTS)
    dy = draw(_SHIFTS)
    degrees = draw(st.sampled_from([90.0, -45.0, 30.0, 7.3, 180.0]))
    factor = draw(st.sampled_from([0.5, 2.0, -1.0, 1.37]))
    side = draw(st.sampled_from(transform.SIDES))
    axis = draw(st.sampled_from(["x", "y"]))
    edges = [
        Edge(edge_owner, ring, k, points[k])
        for edge_owner in (BOUNDARY, *(item.key for item in sketch.obstacles))
        for ring, points, _ in sketch.list_rings(edge_owner)
        for k in range(len(points))
    ]
    edge = draw(st.sampled_from(edges)) if edges else Edge(BOUNDARY, 0, 0, a)
    handles = (
        sorted(selection.vertices, key=str) or [vertex for vertex, _ in list_vertices(sketch, owner)][:1]
    )
    key = owner if isinstance(owner, int) else 0
    edits = [
        lambda: create.add_polygon(sketch, [a, b, (a[0], b[1])]),
        lambda: create.add_rectangle(sketch, [a, b]),
        lambda: create.add_circle(sketch, a, length),
        lambda: create.add_wall(sketch, [a, b], length),
        lambda: create.set_boundary(sketch, [a, b, (b[0], a[1])]),
        lambda: create.add_disc_start(sketch, a, length),
        lambda: create.add_points_start(sketch, [a, b]),
        lambda: create.add_uniform_start(sketch),
        lambda: transform.move(sketch, selection, dx, dy),
        lambda: transform.rotate(sketch, selection, degrees, draw(st.sampled_from([None, a]))),
        lambda: transform.scale(sketch, selection, factor, draw(st.sampled_from([factor, 1.5])), a),
        lambda: transform.resize(sketch, selection, length, draw(st.sampled_from([None, 1.0]))),
        lambda: transform.place(sketch, selection, a[0], None),
        lambda: transform.mirror(sketch, selection, axis),
        lambda: transform.duplicate(sketch, selection, dx, dy),
        lambda: transform.copy_to_grid(sketch, selection, 2, 2, (1.0, 1.0)),
        lambda: properties.delete(sketch, selection),
        lambda: properties.rename(sketch, owner, draw(st.sampled_from(["", "x", "start", "y" * 101]))),
        lambda: properties.set_note(sketch, selection, "a note"),
        lambda: properties.group(sketch, selection),
        lambda: properties.lock(sketch, selection),
        lambda: properties.hide(sketch, selection),
        lambda: properties.set_title(sketch, "another"),
        lambda: properties.set_description(sketch, "and its description"),
        lambda: properties.set_width(sketch, selection, length),
        lambda: properties.set_radius(sketch, selection, length),
        lambda: properties.restack(sketch, selection, draw(st.sampled_from(["top", "bottom"]))),
        lambda: properties.make_default_start(sketch, str(owner)),
        lambda: properties.convert_to_polygons(sketch, selection),
        lambda: properties.convert_to_boundary(sketch, selection),
        lambda: properties.set_background(sketch, Background("plan.png", (40, 30))),
        lambda: vertices.move_vertices(sketch, selection, dx, dy),
        lambda: Change(vertices.place_vertices(sketch, dict.fromkeys(handles, a)), selection, "put"),
        lambda: vertices.insert_vertex(sketch, edge),
        lambda: vertices.extend_wall(sketch, handles[0], a) if handles else None,
        lambda: vertices.delete_vertices(sketch, selection),
        lambda: vertices.bevel_corners(sketch, selection, length),
        lambda: vertices.round_corners(sketch, selection, length),
        lambda: vertices.fill_hole(sketch, key, 1) if key in sketch.index_by_key else None,
        lambda: vertices.split_wall(sketch, handles[0]) if handles else None,
        lambda: vertices.join_walls(sketch, selection),
        lambda: boolean.unite(sketch, selection),
        lambda: boolean.subtract(sketch, selection),
        lambda: boolean.intersect(sketch, selection),
        lambda: boolean.divide(sketch, selection),
        lambda: boolean.offset(sketch, selection, draw(st.sampled_from([length, -length]))),
        lambda: boolean.clip_to_boundary(sketch, selection),
        lambda: boolean.repair_outlines(sketch, selection),
        lambda: vertices.simplify(sketch, selection, length),
        lambda: vertices.straighten(sketch, selection, 20.0),
        lambda: transform.align(sketch, selection, side),
        lambda: transform.distribute(sketch, selection, axis),
        lambda: clipboard.paste(sketch, clipboard.copy_selection(sketch, selection), a),
    ]
    try:
        return draw(st.sampled_from(edits))()
    except MapError as error:
        assert "\n" not in str(error)
        assert str(error)
        return None
