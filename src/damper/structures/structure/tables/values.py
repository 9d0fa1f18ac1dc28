"""Values of a study of a structure, a row for each point of the grid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from damper.analysis.labels import label_of
from damper.parameters.lazy import xr
from damper.structures.structure.figures.lines import value_text
from damper.study.fields import DistinctList, Text
from damper.study.study_file import ProductBase
from damper.sweep.record import force_words
from damper.tables import Table, with_units


class StructureValues(ProductBase):
    """Variables at every point of the grid, a column for each point, mode or mass."""

    variables: Annotated[
        DistinctList[Text], Field(description="Variables of the cube, without those over instants.")
    ]


def make(results: Mapping[str, Any], settings: StructureValues) -> Table:
    """Make the table: a row for each point of the grid."""
    cube: xr.Dataset = results["cube"]
    columns = {}
    for name in settings.variables:
        own = [dim for dim in cube[name].dims if dim in ("point", "body", "mode")]
        if not own:
            columns[name] = cube[name]
            continue
        [dim] = own
        for k, value in enumerate(cube[dim].values.tolist()):
            columns[f"{name}, {dim} {value}"] = cube[name].isel({dim: k}).drop_vars(dim)
    found = xr.Dataset(columns)
    frame = found.to_dataframe().reset_index() if found.dims else found.to_pandas().to_frame().T
    alone = [str(name) for name in cube.coords if cube[name].ndim == 0]
    shown = [name for name in frame if name not in alone]
    cells = frame[shown].map(lambda value: f"{value:.4g}")
    cells.columns = [with_units(label_of(name), found[name]) for name in shown]
    fixed = [value_text(cube, name) for name in alone]
    fixed += [f"forcing: {force}"] if (force := force_words(cube)) else []
    bare = cube.drop_vars(alone).drop_attrs()
    bare.attrs["title"] = cube.attrs["title"]
    return Table.of(bare, "values", frame, [f"Fixed: {', '.join(fixed)}.", cells])
