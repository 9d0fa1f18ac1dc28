"""The numbers of docs/theory.md and docs/findings.md on free decay, from the study's cube.

snakemake --cores 2 --config studies='[free_decay]'
python benchmarks/free_decay.py [results/free_decay/cube.nc]
"""

import math
import sys

import numpy as np
import xarray as xr

from damper import Parameters
from damper.theory.free_decay import amplitude_range, equivalent_damping, largest_damping


def main(path: str = "results/free_decay/cube.nc") -> None:
    """Print a line for each point of the study."""
    cube = xr.open_dataset(path)
    print(
        "r, mu: rms error of the law; largest over that of the law; mean below 0.7 fold over it; "
    )
    print("cycles until the peaks are down to the parts", cube.part.values)
    for restitution in cube.restitution.values.tolist():
        for mass_ratio in cube.mass_ratio.values.tolist():
            run = cube.sel(restitution=restitution, mass_ratio=mass_ratio)
            p = Parameters(mass_ratio, 0.0, 1.0, 1.0, restitution, force_amplitude=0.0)
            peak, ratio = run.peak_amplitude.values, run.equivalent_damping_ratio.values
            low, high = amplitude_range(p)
            inside = (peak > 1.1 * low) & (peak < 0.85 * high) & np.isfinite(ratio)
            error = ratio[inside] / equivalent_damping(p, peak[inside]) - 1.0
            most = largest_damping(p).damping_ratio
            below = ratio[(peak < 0.7 * low) & np.isfinite(ratio)]
            rest = below.mean() / most if below.size else math.nan
            print(
                f"{restitution:g}, {mass_ratio:g}: {math.sqrt(np.mean(error**2)):.2g}; "
                f"{np.nanmax(ratio) / most:.3f}; {rest:.2%};",
                (run.fall_time.values / (2.0 * math.pi)).round(1),
            )


if __name__ == "__main__":
    main(*sys.argv[1:])
