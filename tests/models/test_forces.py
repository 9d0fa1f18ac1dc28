"""Every force in every model: laws, and forces that are another one. Events: many digits."""

import pytest
from cases import thinned
from event_pairs import assert_as_in_digits
from scenes import CASES, GENERIC, MODELS, QUIET, SEVERAL, scene_of

from damper import Parameters, State, events
from damper.observers.common.laws import broken
from damper.parameters.forcing import Harmonics, Record
from damper.sweep.runs import run_points

#: Model of several masses -> forces under which its run takes a few seconds of plain Python.
SHORT = {
    "several": ("five harmonics", "held record of a force"),
    "several, sliding": ("base in its own frame", "record of a force"),
    "several, grounded": ("unbalance", "record of the base"),
    "several, grounded, sliding": ("base in the ground's frame", "harmonic"),
}
#: Some of all cases.
OFTEN = [c for k, c in enumerate(CASES) if k % 11 == 1 and c[0] not in SEVERAL]
OFTEN += [(model, force, "") for model, forces in SHORT.items() for force in forces]


@pytest.mark.parametrize(("model", "force", "features"), thinned(CASES, OFTEN.__contains__))
def test_energy_is_kept_and_no_law_is_broken(model: str, force: str, features: str) -> None:
    """To 1e-12 of the turnover, the losses in friction and in supports with it.

    Free motion without losses has none: there of the energy at the start, too.
    """
    observers = {"response": {"friction_loss": True}, "laws": {}}
    periods, free, all_lost = 1 if model in SEVERAL else 2, force == "none", 0.0
    for seed in range(periods):
        values, state = scene_of(model, force, seed, features)
        ask = {"state": State(*state), "transient": 0, "periods": periods, "max_events": 20_000}
        arrays, _ = run_points([values], observers, **ask)
        assert not broken(arrays).any(), seed
        assert arrays["status"] == 0
        found = {name: float(array[0]) for name, array in arrays.items() if array.ndim == 1}
        lost = found["impact_loss"] + found["friction_loss"]
        turnover = abs(found["energy_input"]) + found["dashpot_loss"] + lost
        turnover += 0.5 * (state[0] ** 2 + state[1] ** 2) * free
        assert abs(found["energy_residual"]) < 1e-12 * turnover, seed
        assert lost > 0.0 or free
        all_lost += lost
    assert all_lost > 0.0


@pytest.mark.parametrize("model", MODELS)
def test_one_term_of_a_sum_is_the_harmonic(model: str) -> None:
    """Byte for byte; and to rounding where a term that is next to nothing follows it."""
    scene = QUIET | MODELS[model] | {"phase": 0.3}
    single = events(Parameters(**scene), until=60.0)
    one = Harmonics((1,), (1.0,))
    assert events(Parameters(**scene, forcing=one), until=60.0).tobytes() == single.tobytes()
    nearly = Harmonics((1, 2), (1.0, 1e-300))
    found = events(Parameters(**scene, forcing=nearly), until=60.0)
    assert len(found) == len(single) > 20
    for name in ("kind", "side", "time", "x", "v", "approach_speed"):
        assert found[name] == pytest.approx(single[name], rel=0, abs=1e-11)


@pytest.mark.parametrize("model", ["rigid", "grounded"])
@pytest.mark.parametrize(("start", "end"), [(1.0, 1.0), (-1.0, -1.0), (0.0, 1.0), (0.0, -1.0)])
@pytest.mark.parametrize("of", ["force", "base_acceleration"])
def test_at_rest_on_a_wall_until_a_record_begins(
    model: str, start: float, end: float, of: str
) -> None:
    """It jumps or rises, and throws the free mass off or presses it."""
    forcing = Record([1.0, 3.0], [start, end], of=of)
    values = GENERIC | MODELS[model] | {"clearance": 0.5, "forcing": forcing}
    assert_as_in_digits(values, (0.0, 0.0, 0.5, 0.0), 6.0)
