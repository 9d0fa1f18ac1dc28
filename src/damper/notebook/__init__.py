"""`damper.run` and the accessor ``cube.damper``, for notebooks and shells.

`damper.simulate`, `damper.run` and ``import damper.notebook`` give every xarray.Dataset an accessor
``damper``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import xarray as xr

from damper.study.simulation import simulate as simulate

if TYPE_CHECKING:
    from damper.notebook.accessor import CubeAccessor


@xr.register_dataset_accessor("damper")
def _of_cube(cube: xr.Dataset) -> CubeAccessor:
    from damper.notebook.accessor import CubeAccessor  # figures with it

    return CubeAccessor(cube)
