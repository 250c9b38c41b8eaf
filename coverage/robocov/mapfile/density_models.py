"""The density of a map JSON as pydantic models: its structure, its JSON Schema."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import AfterValidator, Field

from robocov.density import FINEST, HEAVIEST, Interpolation
from robocov.mapfile.fields import (
    COORDINATE,
    LABEL,
    POINT,
    RING,
    SIZE,
    SMALLEST,
    Coordinate,
    Label,
    Model,
    Size,
    Vertex,
    VertexRing,
    kind_field,
)

LIGHTEST = 1e-9
"""Weights that are smaller are read as 0: they would be when the map is written."""

Entry: TypeAlias = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0, le=HEAVIEST)]
Weight: TypeAlias = Annotated[Entry, AfterValidator(lambda weight: weight if weight >= LIGHTEST else 0.0)]
Variance: TypeAlias = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-1e8, le=1e8)]

_LONGEST_PATH = 500
_MOST = 10_000


class UniformDensityModel(Model, title="uniform density"):
    """Every place counts the same."""

    kind: Literal["uniform"] = kind_field("uniform")
    weight: Weight = Field(1.0, description="What every place counts, above 0", examples=[1])


class PeakModel(Model, title="peak"):
    """A Gaussian hot spot."""

    center: Vertex = Field(description="Its centre [x, y] in metres", examples=[[7.5, 3]])
    weight: Weight = Field(description="What it adds at its centre", examples=[4])
    sigma: Size | None = Field(
        None, description="Its standard deviation in metres, where it is round", examples=[1.5]
    )
    covariance: (
        Annotated[
            list[Annotated[list[Variance], Field(min_length=2, max_length=2)]],
            Field(min_length=2, max_length=2),
        ]
        | None
    ) = Field(
        None,
        description="Its covariance in square metres where it is not: symmetric, positive definite",
        examples=[[[2, 0.5], [0.5, 1]]],
    )


class GaussianDensityModel(Model, title="Gaussian density"):
    """Gaussian hot spots over a floor."""

    kind: Literal["gaussians"] = kind_field("gaussians")
    floor: Weight = Field(0.0, description="What every place counts without them", examples=[0.2])
    peaks: list[PeakModel] = Field(
        max_length=_MOST,
        description="The hot spots, which add up",
        examples=[[{"center": [7.5, 3], "sigma": 1.5, "weight": 4}]],
    )


class AreaModel(Model, title="weighted area"):
    """A polygon in which every place counts the same."""

    name: Label | None = Field(None, description="What it is, for people", examples=["treasury"])
    vertices: VertexRing = Field(
        description="Corners in order, either way round, the first not repeated",
        examples=[[[1, 1], [2, 1], [2, 3]]],
    )
    holes: list[VertexRing] = Field(
        [],
        description="Rings inside that are not part of it",
        examples=[[[[1.5, 1.2], [1.8, 1.2], [1.8, 1.8]]]],
    )
    weight: Weight = Field(description="What a place in it counts", examples=[5])


class PolygonDensityModel(Model, title="polygon density"):
    """Polygons of constant density; where they overlap, the last one counts."""

    kind: Literal["polygons"] = kind_field("polygons")
    background: Weight = Field(1.0, description="What a place outside them all counts", examples=[1])
    areas: list[AreaModel] = Field(
        max_length=_MOST,
        description="The polygons, the later ones on top",
        examples=[[{"name": "treasury", "vertices": [[1, 1], [2, 1], [2, 3]], "weight": 5}]],
    )


class RasterDensityModel(Model, title="raster density"):
    """A picture of the density, in rows of numbers or in a file."""

    kind: Literal["raster"] = kind_field("raster")
    extent: Annotated[list[Coordinate], Field(min_length=4, max_length=4)] | None = Field(
        None,
        description="What it covers, [x_min, y_min, x_max, y_max] in metres; the boundary's box by default",
        examples=[[0, 0, 10, 6]],
    )
    interpolation: Interpolation = Field(
        "bilinear",
        description="bilinear between the cells' middles, or constant in each of the cells",
        examples=["bilinear"],
    )
    rows: list[Annotated[list[Entry], Field(min_length=1, max_length=FINEST)]] | None = Field(
        None,
        min_length=1,
        max_length=FINEST,
        description="Rows of numbers, the top one first",
        examples=[[[1, 1, 2], [1, 4, 2]]],
    )
    picture: Annotated[str, Field(strict=True, min_length=1, max_length=_LONGEST_PATH)] | None = Field(
        None,
        description="In place of rows, a grey PNG or PGM, relative to the map and in its folder",
        examples=["density.png"],
    )
    black: Weight | None = Field(None, description="What black counts; 0 by default", examples=[0.1])
    white: Weight | None = Field(None, description="What white counts; 1 by default", examples=[5])


DensityModel: TypeAlias = Annotated[
    UniformDensityModel | GaussianDensityModel | PolygonDensityModel | RasterDensityModel,
    Field(discriminator="kind", description="How much each place counts"),
]

KINDS: dict[str, type[Model]] = {
    "uniform": UniformDensityModel,
    "gaussians": GaussianDensityModel,
    "polygons": PolygonDensityModel,
    "raster": RasterDensityModel,
}
"""The models by kind."""

PARTS: dict[str, type[Model]] = {"peaks": PeakModel, "areas": AreaModel}
"""What the lists of these keys hold."""

_WEIGHT = f"a number from 0 to {HEAVIEST:.0f}"

WANTED: dict[str, tuple[str, ...]] = {
    # what is wanted at a key of a density, in its items, in their items, ...
    "weight": (_WEIGHT,),
    "floor": (_WEIGHT,),
    "background": (_WEIGHT,),
    "black": (_WEIGHT,),
    "white": (_WEIGHT,),
    "peaks": (f"a list of at most {_MOST} peaks", "an object"),
    "areas": (f"a list of at most {_MOST} areas", "an object"),
    "center": (POINT, COORDINATE),
    "sigma": (SIZE,),
    "covariance": ("[[xx, xy], [xy, yy]] in m²", "two numbers", "a number from -1e8 to 1e8 (m²)"),
    "vertices": (RING, POINT, COORDINATE),
    "holes": ("a list of rings", RING, POINT, COORDINATE),
    "name": (LABEL,),
    "extent": ("[x_min, y_min, x_max, y_max] in metres", COORDINATE),
    "interpolation": ("bilinear or cells",),
    "rows": (f"a list of 1 to {FINEST} rows", f"a list of 1 to {FINEST} numbers", _WEIGHT),
    "picture": ("the name of a file",),
}

LEAST_VARIANCE = SMALLEST**2
"""Smallest variance of a peak each way, in square metres."""
