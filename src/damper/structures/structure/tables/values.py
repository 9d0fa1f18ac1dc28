"""Values of a study of a structure, a row for each point of the grid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from damper.parameters.lazy import xr
from damper.study.fields import DistinctList, Text
from damper.study.study_file import ProductBase
from damper.tables import Table


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
    return Table.of(cube, "values", frame, [frame.map(lambda value: f"{value:.4g}")])
