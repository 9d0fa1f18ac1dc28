"""The laws of noise beside simulation: in a small study, its table and figure, and at large."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import assert_nothing_overlaps, drawn, legend_texts, svg_of

import damper
from damper.analysis import means_under_noise
from damper.observers.common.limits import mean_within
from damper.sweep.cube import gather
from damper.sweep.record import record
from damper.sweep.slices import simulate_slice
from damper.tables import make
from damper.theory.noise import intensity, means, missing_part

DAMPER = {"mass_ratio": 0.2, "damping_ratio": 0.1, "frequency_ratio": 1.0, "clearance": 3.0}
NOISE = damper.Noise(seed=0, step=0.1, duration=80.0, band=(0.0, 6.0))


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    return under_own_noises(DAMPER, [0.6, 1.0], NOISE, 6, transient=2, periods=10)


def under_own_noises(
    fixed: dict[str, float], restitution: list[float], noise: damper.Noise, count: int, **run: int
) -> xr.Dataset:
    """Cube of so many draws, each with a noise of its own."""
    axes = {"restitution": restitution}
    speeds, place = {"range": [-4.0, 4.0]}, {"range": [-1.0, 1.0]}
    starts = {"initial_relative_velocity": speeds, "initial_position": place}
    ask = {"statistics": {"above": 0.01}}
    part = simulate_slice(
        fixed, axes, observers=ask, forcing=noise, own_noise=True,
        draws={"count": count, "seed": 2, **starts}, **run, max_events=10**9,
    )  # fmt: skip
    about = record(ask, "rest", run, {}, noise)
    return gather([part], axes, (), fixed, about)


def test_means_of_a_small_study_have_their_laws(cube: xr.Dataset) -> None:
    data = means_under_noise(cube)
    known = data.dropna(subset="white").set_index(["restitution", "mean"])
    assert len(known) == 2 + 8
    assert known["holds"].all()
    assert (known["upper"] - known["lower"]).loc[(1.0, "mean_kinetic_energy")] < 0.5
    assert (known["in_band"] <= known["white"]).all()
    half = data[(data["restitution"] == 0.6) & (data["mean"] == "mean_kinetic_energy")]
    assert half["upper"].item() < means(at(1.0))["mean_kinetic_energy"]
    # The mean over impacts is that of the impacts of all draws.
    rates, energies = cube.impact_rate.values[1], cube.mean_approach_energy.values[1]
    mean = np.average(energies, weights=rates)
    assert known["value"].loc[(1.0, "mean_approach_energy")] == pytest.approx(mean)
    table = make("statistics", {"cube": cube})
    assert len(table.data) == 2 * 9
    text = table.markdown()
    assert "Means over 6 draws" in text
    assert text.count("| yes |") == 10


def test_the_figure_shows_means_over_their_laws(cube: xr.Dataset, tmp_path) -> None:
    figure = drawn("statistics", cube, along="restitution")
    data = means_under_noise(cube).set_index(["mean", "restitution"])
    left, right = figure.axes
    alone = means(at(1.0))["mean_kinetic_energy"]
    for ax, name, size in (
        (left, "mean_potential_energy", alone),
        (right, "mean_loss", means(at(1.0))["mean_input"]),
    ):
        points, _, (bars,) = ax.containers[0]
        np.testing.assert_allclose(points.get_ydata().astype(float), data.loc[name, "value"] / size)
        ends = np.array(bars.get_segments())[:, :, 1] * size
        np.testing.assert_allclose(ends, data.loc[name, ["lower", "upper"]].to_numpy(float))
    assert "primary, kinetic" in legend_texts(figure)
    assert "means over 6 draws" in figure.get_suptitle().replace("\n", " ")
    assert_nothing_overlaps(figure)
    svg_of(figure, tmp_path)


def at(restitution: float, **changes: Any) -> damper.Parameters:
    return damper.Parameters(**{**DAMPER, "restitution": restitution, "forcing": NOISE, **changes})


def test_power_is_that_of_the_linear_primary_in_the_band() -> None:
    """By quadrature of the response of the primary alone; what is missing, to second order."""
    w = np.linspace(1e-6, 200.0, 4_000_001)
    density = 2 * intensity(at(1.0)) / math.pi
    taken = density * 0.2 * w**2 / ((1 - w**2) ** 2 + (0.2 * w) ** 2)
    assert np.trapezoid(taken, w) == pytest.approx(intensity(at(1.0)), rel=1e-3)
    for high in (6.0, 12.0, 24.0):
        noise = damper.Noise(0, 0.02, 160.0, (0.0, high))
        inside = np.trapezoid(np.where(w < high, taken, 0.0), w) / intensity(at(1.0))
        missing = missing_part(at(1.0, forcing=noise), 0.0)
        assert 1 - inside == pytest.approx(missing, rel=3.0 / high**2 + 0.02)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"forcing": "harmonic"}, "closed forms are for a damper.Noise"),
        ({"forcing": damper.Noise(0, 0.1, 160.0, (2.0, 6.0))}, "in whose band"),
        ({"gravity": 0.1}, "gravity = 0.1: the closed form holds for"),
        ({"damping_ratio": 0.0}, "nothing takes the power"),
        ({"contact_stiffness_ratio": 1e3}, "compliant"),
    ],
)
def test_what_the_laws_do_not_know_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        means(at(1.0, **changes))


def under_independent_samples(
    step: float, runs: int, samples: int
) -> tuple[dict[str, tuple[float, float]], float]:
    """Means with limits of 99 % in units of their laws, and impacts; the intensity is 2 zeta."""
    mu, d, zeta = 0.1, 5.0, 0.05
    periods = int(samples * step / math.tau)
    rate = math.sqrt((1 + 1 / mu) / math.tau) / d * math.tau
    half = ("mean_potential_energy", "mean_kinetic_energy", "mean_free_mass_energy")
    law = dict.fromkeys(half, 0.5) | {"mean_approach_energy": 1.0, "impact_rate": rate}
    law |= {"mean_square_place": 1 / 3, "mean_input": 2 * zeta * math.tau}
    found: dict[str, list[float]] = {name: [] for name in law}
    for seed in range(runs):
        random = np.random.Generator(np.random.PCG64(seed))
        value = random.standard_normal(samples) * math.sqrt(4 * zeta / step)
        x, v, u = random.standard_normal(3)
        run = damper.simulate(
            mass_ratio=mu, damping_ratio=zeta, frequency_ratio=1.0, clearance=d, restitution=1.0,
            forcing=damper.Record(np.arange(samples) * step, value), transient=0, periods=periods,
            state=damper.State(x, v, x, u / math.sqrt(mu)), observers=["statistics"],
            max_events=10**9,
        )  # fmt: skip
        for name in law:
            found[name].append(float(run[name]) / law[name])
    impacts = sum(found["impact_rate"]) * rate * periods
    return {n: mean_within(np.array(v), np.ones(runs), 0.99) for n, v in found.items()}, impacts


@pytest.mark.exhaustive
def test_equilibrium_of_a_million_impacts() -> None:
    """What steps between samples cost falls in proportion to them: extrapolated to none.

    With -s it prints the table of docs/noise.md.
    """
    coarse, some = under_independent_samples(0.2, 50, 400_000)
    fine, others = under_independent_samples(0.1, 50, 800_000)
    print(f"\n| mean | h = 0.2, {some:.0f} impacts | h = 0.1, {others:.0f} impacts | h = 0 |")
    found = {n: (*coarse[n], *fine[n], 2 * fine[n][0] - coarse[n][0]) for n in fine}
    for name, (*both, white) in found.items():
        error = math.hypot(2 * both[3], both[1])
        print(
            f"| {name} |",
            *(f"{x:.4f} ± {e:.4f} |" for x, e in (both[:2], both[2:], (white, error))),
        )
        found[name] = white - 1.0, error
    assert min(some, others) > 1e6
    assert all(abs(off) < error for off, error in found.values())


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    ("high", "step", "fixed"),
    [
        (12.0, 0.05, {"mass_ratio": 0.1, "clearance": 2.0}),
        (24.0, 0.025, {"mass_ratio": 0.1, "clearance": 2.0}),
        (6.3, 0.09, {"mass_ratio": 0.2, "clearance": 3.0}),
    ],
)
def test_means_in_a_small_box(high: float, step: float, fixed: dict[str, float]) -> None:
    """With -s it prints the rows of the second table of docs/noise.md."""
    duration = math.ceil(215 * math.tau / step) * step
    noise = damper.Noise(0, step, duration, (0.0, high))
    damped = fixed | {"damping_ratio": 0.05, "frequency_ratio": 1.0}
    cube = under_own_noises(damped, [1.0], noise, 200, transient=30, periods=184)
    data = means_under_noise(cube).set_index("mean").dropna(subset="white")
    cells = []
    for name, row in data.drop(index="mean_square_place").iterrows():
        white, half = row["white"], 0.5 * (row["upper"] - row["lower"])
        cells.append(
            f"{row['value'] / white:.3f} ± {half / white:.3f} ({row['in_band'] / white:.3f})"
        )
        slack = 1.5 * half
        assert row["in_band"] - slack < row["value"] < white + slack, name
        if name in ("mean_free_mass_energy", "mean_approach_energy", "impact_rate"):
            # To first order in what is missing.
            part = 0.3 * (white - row["in_band"])
            assert abs(row["value"] - row["in_band"]) < slack + part, name
    print(f"\n{list(data.index)}\n| {fixed}, {high:g} | {' | '.join(cells)} |")
