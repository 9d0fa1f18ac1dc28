"""The numbers in the text of docs/findings.md, from the cubes of the default run.

snakemake --cores 2
python benchmarks/findings.py [results [docs/findings.md]]

Prints each phrase with numbers as the cubes give it, and a cross before each that the document does
not have; then the exit status is 1.
"""

import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr

import damper
from damper.analysis import means_under_noise
from damper.theory.free_decay import amplitude_range, largest_damping


class Results:
    """Cubes of a folder of results, by the name of their study."""

    def __init__(self, folder: str) -> None:
        self.folder = Path(folder)

    def __getitem__(self, study: str) -> xr.Dataset:
        return xr.open_dataset(self.folder / study / "cube.nc").load()


def span(values: object, digits: str = ".2f") -> str:
    """Return the least and the greatest of some values in words."""
    array = np.asarray(values)
    return f"{array.min():{digits}} to {array.max():{digits}}"


def best(cube: xr.Dataset, over: str, along: str) -> xr.Dataset:
    """Return what a cube, the worst of its draws, has at the value with the least peak."""
    worst = cube.max("draw")
    return worst.isel({over: worst.peak_displacement.max(along).argmin(over)})


def amplification(results: Results) -> Iterator[str]:
    at_best = best(results["performance"], "clearance", "frequency_ratio")
    shares = 100 * (at_best.amplitude_ratio > 1).mean("frequency_ratio")
    yield f"at {span(shares, '.0f')} % of the {at_best.frequency_ratio.size} frequencies"
    below = at_best.sel(frequency_ratio=slice(None, 0.995)).rms_ratio.max("frequency_ratio")
    first, *more = (float(below.sel(restitution=r)) for r in (0, 0.4, 0.6, 0.95))
    yield (
        f"up to {first:.2f} times at a restitution of 0, "
        "{:.2f} at 0.4, {:.2f} at 0.6 and {:.2f} at 0.95".format(*more)
    )


def four_masses(results: Results) -> Iterator[str]:
    frequency_ratio = results["four_masses"].frequency_ratio.values
    near = abs(frequency_ratio - 1) < 0.0501
    peaks = {}
    for masses in ({"count": 4, "clearance_spread": 0.05}, None):
        peaks[masses is None] = np.array(
            [
                damper.simulate(
                    mass_ratio=0.1,
                    damping_ratio=0.02,
                    restitution=0.5,
                    clearance=14 * (1 + part * 1e-13),
                    frequency_ratio=frequency_ratio,
                    draws={
                        "count": 2,
                        "seed": 1,
                        "initial_position": [-1, 1],
                        "initial_relative_velocity": [-1, 1],
                    },
                    transient=100,
                    periods=30,
                    observers=["response"],
                    **({"masses": masses} if masses else {}),
                )
                .peak_displacement.max("draw")
                .values.ravel()
                for part in range(7)
            ]
        )
    on_average = [span(peaks[one][:, near].mean(axis=1), ".1f") for one in (False, True)]
    at_most = [span(peaks[one].max(axis=1), ".1f") for one in (False, True)]
    yield "{} on average in place of {}".format(*on_average)
    yield "{} at most in place of {}".format(*at_most)


def damper_mass(results: Results) -> Iterator[str]:
    cube = results["damper_mass"].sel(free_mass=16)
    peak = 1e3 * cube.peak_displacement.max("forcing_frequency")
    at_rest, worst = peak.sel(initial_position=0), peak.max("initial_position")
    gap, its = (1e3 * float(each.idxmin("gap")) for each in (at_rest, worst))
    yield f"a gap of {gap:.3f} mm and seem to leave {float(at_rest.min()):.3f} mm"
    yield f"the worse of both starts leaves {float(worst.min()):.3f} mm at best, at {its:.3f} mm"
    frame = results["machine_frame"].max("draw").peak_displacement.max("forcing_frequency")
    gap = 1e3 * float(frame.idxmin("gap"))
    yield f"10 kg leave {1e3 * float(frame.min()):.3f} mm at a gap of {gap:.2f} mm"


def free_decay(results: Results) -> Iterator[str]:
    cube, parts = results["free_decay"], []
    for r in cube.restitution.values:
        for mass_ratio in (1e-2, 1e-3):
            run = cube.sel(restitution=r, mass_ratio=mass_ratio)
            p = damper.Parameters(mass_ratio, 0.0, 1.0, 1.0, r, force_amplitude=0.0)
            below = run.peak_amplitude < 0.7 * amplitude_range(p)[0]
            share = run.equivalent_damping_ratio.where(below).mean()
            parts.append(100 * float(share) / largest_damping(p).damping_ratio)
    yield f"on average {span(parts, '.1f')} % of that below 0.7 times"
    cycles = cube.fall_time.sel(mass_ratio=1e-2) / (2 * math.pi)
    half, tenth = ([float(n) for n in cycles.sel(part=part)] for part in (0.5, 0.1))
    yield "takes {:.0f}, {:.0f} and {:.0f} cycles with r = 0.3, 0.5 and 0.7".format(*half)
    yield "to a tenth of it {:.0f}, {:.0f} and {:.0f}".format(*tenth)


def noise(results: Results) -> Iterator[str]:
    cube = results["noise"]
    table = means_under_noise(cube).set_index(["restitution", "mean"])
    table["half"] = (table.upper - table.lower) / 2
    white = table.white[1.0, "mean_potential_energy"]
    yield f"a clearance of {float(cube.clearance) / math.sqrt(2 * white):.1f} times the rms"

    def energy(r: float) -> str:
        rows = [table.loc[r, name] for name in ("mean_potential_energy", "mean_kinetic_energy")]
        value, half = (
            100 * sum(row[name] for row in rows) / 2 / white for name in ("value", "half")
        )
        return f"{value:.0f} ± {half:.0f} %"

    lost, loss = table.loc[0.6, "mean_impact_loss"], table.value[0.6, "mean_loss"]
    yield f"is largest, {100 * lost.value / loss:.0f} ± {100 * lost.half / loss:.0f} %"
    yield f"leaves the primary {energy(0.6)} of its energy"
    yield f"A restitution of 0 leaves {energy(0.0)}, and one of 1 all of it ({energy(1.0)})"
    place, rate = (table.loc[1.0, name] for name in ("mean_square_place", "impact_rate"))
    yield f"mean square place {place.value:.3f} ± {place.half:.3f}, closed form 1/3"
    yield f"{rate.value:.2f} ± {rate.half:.2f} times per cycle (closed form {rate.white:.2f})"
    free = table.value[0.8, "mean_free_mass_energy"] / white
    yield f"Already at 0.8 the free mass has only {100 * free:.0f} % of the primary's energy"
    losses = table.xs("mean_loss", level="mean")
    yield f"within limits of {span(100 * losses.half / losses.white, '.0f')} %"
    yield f"costs {span(100 * (1 - losses.in_band / losses.white), '.1f')} % of it"


def shock(results: Results) -> Iterator[str]:
    cube = results["shock"]
    hertz = np.sqrt(cube.stiffness.values / 10) / (2 * math.pi)
    narrow, middle, wide = (cube.sel(gap=gap) for gap in (1e-3, 3e-3, 1e-2))
    ratio = middle.amplitude_ratio.values
    first = hertz[(wide.amplitude_ratio.values < 1.0005).argmax()]
    yield f"ratio 1.00 from {first:.0f} Hz on with a gap of 10 mm"
    yield f"at most {float(wide.amplitude_ratio.max()):.2f} below"
    yield f"({span(narrow.amplitude_ratio)} with 1 mm)"
    yield f"with 3 mm, it is {span(ratio[:-2])} times that without damper up to {hertz[-3]:.0f} Hz"
    ends = [f"{r:.2f} times at {f:.0f} Hz" for r, f in zip(ratio, hertz, strict=True)]
    yield " and ".join(ends[-2:])
    least, gaps = [], []
    for cut in (wide, middle, narrow):
        k = int(np.argmin(cut.rms_ratio.values))
        least += [float(cut.rms_ratio[k]), hertz[k]]
        gaps.append(float(cut.gap * cut.amplitude_ratio[k] / cut.peak_displacement[k]))
    text = "falls to {:.2f} of that without damper with 10 mm at {:.0f} Hz, {:.2f} with 3 mm at"
    yield (text + " {:.0f} Hz, {:.2f} with 1 mm at {:.0f} Hz").format(*least)
    yield f"gaps of {min(gaps):.1f} to {max(gaps):.0f} times the first swing"
    k = abs(hertz - 32).argmin()
    hardest = [f"{float(c.max_impact_loss[k]):.2f} J" for c in (wide, narrow)]
    impulse = [f"{float(c.max_impulse[k]):.1f} N s" for c in (wide, narrow)]
    yield f"takes {hardest[0]} and has an impulse of {impulse[0]} with 10 mm"
    yield f"{hardest[1]} and {impulse[1]} with 1 mm"
    most = cube.rms_ratio.max("gap")
    yield f"up to {float(most.max()):.1f} times the rms, at {hertz[np.argmax(most.values)]:.0f} Hz"


def earthquake(results: Results) -> Iterator[str]:
    cube = results["earthquake"]
    hertz = np.sqrt(cube.stiffness.values / 1e5) / (2 * math.pi)
    low, high = (
        cube.isel(stiffness=int(abs(hertz - f).argmin())).sel(gap=gap)
        for f, gap in ((1.5, 0.2), (2.8, 0.05))
    )
    alone = [1e3 * float(c.peak_displacement / c.amplitude_ratio) for c in (low, high)]
    yield f"at 1.5 Hz, {alone[0]:.0f} mm without damper, a gap of 0.2 m leaves"
    yield f"leaves {low.amplitude_ratio:.2f} of the largest displacement and {low.rms_ratio:.2f} of"
    yield f"at 2.8 Hz, {alone[1]:.0f} mm, one of 0.05 m leaves"
    yield f"leaves {high.amplitude_ratio:.2f} and {high.rms_ratio:.2f}."
    peaks, rms = ((cube[n] > 1).sum("stiffness") for n in ("amplitude_ratio", "rms_ratio"))
    yield f"at {span(peaks, 'd')} of the {hertz.size} frequencies with each of the three gaps"
    most = cube.amplitude_ratio.max("gap")
    yield f"up to {float(most.max()):.2f} times at {hertz[np.argmax(most.values)]:.1f} Hz"
    yield f"and the rms at {span(rms, 'd')} of them"
    yield f"impacts of {low.max_impulse / 1e3:.0f} kN s at 1.5 Hz with the gap of 0.2 m"
    yield f"takes up to {low.max_impact_loss / 1e3:.1f} kJ"
    wide = cube.isel(stiffness=int(abs(hertz - 1.5).argmin())).sel(gap=0.5)
    impulse, loss = float(wide.max_impulse) / 1e3, float(wide.max_impact_loss) / 1e3
    yield f"with 0.5 m they are {impulse:.0f} kN s and {loss:.0f} kJ"


def weight(results: Results) -> Iterator[str]:
    at_best = best(results["vertical_damper"], "gap", "forcing_frequency")
    peaks = [1e3 * float(x) for x in at_best.peak_displacement.max("forcing_frequency")]
    yield "a largest amplitude of {:.2f}, {:.2f} and {:.2f} mm".format(*peaks)
    ratio = at_best.amplitude_ratio
    level, upright = ratio.sel(inclination=0), ratio.sel(inclination=90)
    at = {"forcing_frequency": 200}
    left = [float(each.sel(at)) for each in (upright, level)]
    yield "leaves {:.2f} of the amplitude, the level one {:.2f}".format(*left)
    above, below = (
        [float(each.sel(forcing_frequency=part).max()) for each in (level, upright)]
        for part in (slice(200, None), slice(None, 200))
    )
    yield f"amplifies by up to {above[0]:.2f}, the upright one hardly does, {above[1]:.2f} at most"
    text = "Below resonance the upright mass amplifies by up to {:.2f}, the level one by {:.2f}"
    yield text.format(*below[::-1])


def friction(results: Results) -> Iterator[str]:
    cube = results["idle_damper"]
    idle = (cube.motion_impacts_left + cube.motion_impacts_right == 0).mean(
        ["initial_displacement", "initial_relative_velocity"]
    )
    parts = [100 * float(idle.sel(friction=a)) for a in (0.1, 0.25, 0.3, 0.4)]
    text = (
        "{:.1f} % end without impacts at a friction of 0.1 F0/M, {:.0f} % at 0.25, {:.0f} % at 0.3"
    )
    yield (text + " and {:.0f} % at 0.4").format(*parts)
    w, mu, zeta = (float(cube[n]) for n in ("frequency_ratio", "mass_ratio", "damping_ratio"))
    yield f"{w * w / math.hypot(1 - (1 + mu) * w * w, 2 * zeta * w):.2f} F0/M"
    at_best = best(results["friction"], "gap", "forcing_frequency")
    peaks = [1e3 * float(x) for x in at_best.peak_displacement.max("forcing_frequency")]
    text = "largest amplitude is {:.2f}, {:.2f}, {:.2f} and {:.2f} mm, with 1 it is {:.2f} mm"
    yield text.format(*peaks)
    ratio = at_best.amplitude_ratio
    yield f"is up to {float(ratio.sel(friction_coefficient=0).max()):.2f} times that without damper"
    idle = abs(ratio.sel(friction_coefficient=0.1) - 1).dropna("forcing_frequency")
    outside = idle.where((idle.forcing_frequency < 182) | (idle.forcing_frequency > 220))
    most = 100 * float(outside.max())
    yield f"below 182 and above 220 rad/s the amplitude is that without damper to {most:.0f} %"


SECTIONS = (
    amplification,
    four_masses,
    damper_mass,
    free_decay,
    noise,
    shock,
    earthquake,
    weight,
    friction,
)


def main(folder: str = "results", document: str = "docs/findings.md") -> int:
    """Print the phrases; return 1 if the document lacks one."""
    text, missing = " ".join(Path(document).read_text(encoding="utf-8").split()), 0
    for section in SECTIONS:
        print(section.__name__)
        for phrase in section(Results(folder)):
            found = phrase in text
            missing += not found
            print(f"  {' ' if found else 'x'} {phrase}")
    return int(missing > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
