"""A cube's runs from starts moved by 1e-15: what another machine's last digits may change.

``python benchmarks/moved_start.py results/restitution/cube.nc [shift]``; with a shift of 0 the same
runs again, of which none should differ by a bit.
"""

import sys

import xarray as xr

import damper
from damper.analysis import section_period
from damper.parameters.quantities import quantities_in
from damper.sweep.record import observers_of, settings_of

#: Largest difference of samples that counts as none, in units of the displacement.
SMALL = 1e-9


def main() -> None:
    """Print how many points stay as they are."""
    path, shift = sys.argv[1], float((*sys.argv[2:], 1e-15)[0])
    with xr.open_dataset(path) as cube:
        values = {name: cube[name].values for name in quantities_in(cube.coords)}
        run = {"observers": observers_of(cube), **settings_of(cube)}
        moved = damper.simulate(**values, initial_displacement=shift, **run)
        order = cube.chatter.dims
        apart = abs(moved.displacement - cube.displacement).max("sample", skipna=False).squeeze()
        apart, period = (one.transpose(*order).values for one in (apart, section_period(cube)))
        other = moved.chatter.squeeze().transpose(*order).values != cube.chatter.values
    near, periodic = apart <= SMALL, period > 0
    print(f"{near.size} points, {(apart != 0).sum()} of them with samples that differ by a bit")
    for name, which in (("periodic", periodic), ("irregular", ~periodic)):
        part = 100 * near[which].mean()
        print(f"{which.sum()} {name}: {part:.1f} % keep all samples within {SMALL:g};")
        print(f"  the class of chatter differs at {other[which].sum()}")


if __name__ == "__main__":
    main()
