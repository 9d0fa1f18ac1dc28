"""Unknown quantities found again in synthetic and in measured records."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml
from click.testing import CliRunner
from scipy.io import savemat, wavfile

import damper
from damper.identification.answer import _warnings
from damper.identification.draws import AGREE, Draws
from damper.identification.fit import Fit, Fitter, sum_of_squares
from damper.identification.problem import RecordedDamper, Unknown, _heard
from damper.shell import main
from damper.sizing.answer import cube_of
from damper.sizing.words import text_of
from damper.study.yaml_file import dump_yaml
from damper.sweep.points import one_run

FRAME = {
    "primary_mass": 2.0,
    "stiffness": 800.0,
    "damping": 0.8,
    "free_mass": 0.2,
    "forcing": "none",
    "force_amplitude": 0.0,
    "forcing_frequency": 20.0,
    "transverse_acceleration": 9.81,
    "initial_position": 1.0,
}
TRUE = FRAME | {
    "gap": 0.01,
    "restitution": 0.6,
    "friction_coefficient": 0.02,
    "initial_displacement": 0.02,
}
#: A ball on a heavy floor.
FLOOR = {"primary_mass": 1e6, "stiffness": 1e6, "damping": 0.0, "free_mass": 1.0, "gap": 10.0}
FLOOR |= {"gravity": 9.81}


def decay(until=0.7, count=281):
    parameters, state = one_run(None, None, TRUE)
    run = damper.start(parameters, state)
    run.advance(until)
    times = np.linspace(0.0, until, count)
    return times, run.motion(times).displacement.values, run.events


def problem(record, free, known=FRAME, **more):
    without = {name: value for name, value in TRUE.items() if name not in known}
    known = known | {n: v for n, v in without.items() if n not in free}
    return RecordedDamper(known, [record], free, more.get("starts", {}), more.get("ranges", {}))


@pytest.mark.parametrize("kind", ["displacement", "acceleration", "peaks", "impacts"])
def test_derivatives_are_those_of_runs(kind):
    times, values, events = decay()
    if kind == "impacts":
        record = damper.Recording(events["time"][events["kind"] == damper.IMPACT], kind=kind)
    elif kind == "peaks":
        record = damper.Recording([0.0, 0.157, 0.314], [0.02, -0.019, 0.018], kind=kind)
    else:
        record = damper.Recording(times, values, kind=kind)
    free = ["restitution", "gap", "friction_coefficient", "stiffness", "free_mass"]
    free += ["damping", "initial_displacement", "initial_velocity", "scale"]
    free = free[:-1] if kind in ("impacts", "peaks") else free
    known = TRUE | {"initial_velocity": 0.05}
    asked = problem(record, free, known)
    asked.fine = True
    values = known | {"scale": 1.1, "offset": 1e-3}
    point = np.array([values[unknown.name] for unknown in asked.unknowns])
    _, jacobian = asked.residuals(point, 1.0, True)
    for j, value in enumerate(point):
        step = 1e-5 * value
        ends = []
        for way in (-1.0, 1.0):
            there = point.copy()
            there[j] += way * step
            ends.append(asked.residuals(there)[0])
        slope = (ends[1] - ends[0]) / (2.0 * step)
        # Samples at a kink, or hidden beside it, differ.
        error = np.sort(abs(slope - jacobian[:, j]))[: len(slope) - len(slope) // 20]
        assert error.max() < 1e-4 * abs(jacobian[:, j]).max(), asked.unknowns[j].name


@pytest.mark.parametrize(
    ("order", "kind"), [(0, "displacement"), (1, "velocity"), (2, "acceleration")]
)
def test_starts_are_around_the_first_motion(order, kind):
    """Of a sine with 20 rad/s, the machine's, that begins with 0.02 m and 0.3 m/s."""
    times = np.arange(0.0, 1.0, 0.0025)
    turned = 20.0 * times + 0.5 * math.pi * order
    values = 20.0**order * (0.02 * np.cos(turned) + 0.015 * np.sin(turned))
    values += 1e-3 * abs(values).max() * np.random.default_rng(0).standard_normal(len(times))
    record = damper.Recording(times, values, kind=kind, offset=False)
    asked = problem(record, ["initial_displacement", "initial_velocity"])
    for unknown, true in zip(asked.unknowns, (0.02, 0.3), strict=True):
        low, high = unknown.starts
        assert 0.5 * (low + high) == pytest.approx(true, rel=0.02)
        assert high - low < 0.9 * true


def test_an_exact_record_gives_the_truth(monkeypatch):
    monkeypatch.setattr("damper.identification.fit._ROUNDS", ((8, 1),))
    times, values, _ = decay(0.3, 121)
    known = {name: value for name, value in TRUE.items() if name != "restitution"}
    found = damper.identify(damper.Recording(times, values), ["restitution"], known)
    low, high = found.interval("restitution")
    assert low < 0.6 < high
    assert high - low < 1e-6
    assert found["restitution"] == pytest.approx(0.6, abs=1e-10)
    assert not found.warnings


def test_impacts_hide_the_same_samples_of_every_run():
    """Else a run with other impacts may leave out what the noise makes large."""
    times, values, events = decay()
    points = [np.array([r, 0.0]) for r in (0.6, 0.4)]
    impact = events["time"][events["kind"] == damper.IMPACT][3]
    struck = values + 1e-4 * np.random.default_rng(0).standard_normal(len(times))
    struck[np.argmin(abs(times - impact))] += 0.01  # what an accelerometer feels of it
    asked = problem(damper.Recording(times, struck, kind="acceleration"), ["restitution"])
    seen, own = asked.hidden[0], None
    assert abs(times[seen] - impact).max() < 3.0 * times[1]
    for _ in range(2):
        for point in points:
            assert ((asked.residuals(point)[0] == 0.0) == asked.hidden[0]).all()
        assert asked.hide(points[0]) is (own is None)
        own = asked.hidden[0]
    assert (own > seen).any()
    assert asked.hide(points[1])
    assert (own != asked.hidden[0]).any()


@pytest.mark.compiled
def test_all_that_was_tried_has_the_noise_that_was_found(monkeypatch):
    """Records of two kinds: the noise of each is found late, and what was tried before counts."""
    monkeypatch.setattr("damper.identification.draws._POINTS", 20)
    monkeypatch.setattr("damper.identification.draws._DRAWS", (60, 60))
    times, values, events = decay(0.4, 101)
    rng = np.random.default_rng(4)
    impacts = events["time"][events["kind"] == damper.IMPACT]
    records = [
        damper.Recording(
            times, values + 1e-4 * rng.standard_normal(len(times)), kind="displacement"
        ),
        damper.Recording(impacts + 2e-3 * rng.standard_normal(len(impacts)), kind="impacts"),
    ]
    known = {name: value for name, value in TRUE.items() if name != "restitution"}
    asked = RecordedDamper(known, records, ["restitution"], {"restitution": 0.6}, {})
    fitter = Fitter(asked)
    point = fitter.start(0)
    for r in (0.45, 0.55, 0.75):
        fitter.fit(np.array([r, *point[1:]]), 1.0, 1)
    before = list(asked.noise)
    fit = fitter._weighed(fitter.fit(point, 1.0, 8))
    assert asked.noise[0] < 0.1 * before[0]  # of both, other parts
    assert asked.noise[1] / before[1] != pytest.approx(asked.noise[0] / before[0], rel=0.5)
    for cost, there in fitter.tried:
        assert cost == pytest.approx(float(np.sum(asked.residuals(there)[0] ** 2)), rel=1e-6)
    # Points far off are no part of the interval.
    low, high = fitter.ends(fit, 2.0, fitter.likely(fit))
    assert high[0] - low[0] < 0.05 < 0.75 - 0.45


@pytest.mark.compiled
def test_a_ball_on_a_floor_by_the_law_of_free_fall():
    r, height = 0.83, 1.1
    times = 2.0 * math.sqrt(2.0 * height / 9.81) * r ** np.arange(1, 8)
    record = damper.Recording(times, kind="intervals")
    found = damper.identify(record, ["r", "initial_position"], FLOOR)
    assert found["restitution"] == pytest.approx(r, abs=1e-5)
    # The floor gives way by a millionth.
    assert 5.0 * (1.0 + found["initial_position"]) == pytest.approx(height, rel=1e-4)


@pytest.mark.compiled
def test_measured_tennis_ball():
    # A university's laboratory course: means of five drops, known to some 2 ms.
    record = damper.Recording([0.5007, 0.3805, 0.2895, 0.2303], kind="intervals")
    found = damper.identify(record, ["restitution", "initial_position"], FLOOR)
    low, high = found.interval("restitution")
    assert 0.73 < low < 0.765 < high < 0.80

    # Heights h of first drops, by the chance S^(-4/2) of the sums of squares on a fine grid.
    powers, heights = np.linspace(0.3, 0.999, 700), np.linspace(0.05, 3.0, 2000)
    flights = powers[:, None] ** np.arange(1, 5)
    sums = np.zeros((700, 2000))
    for flight, time in zip(flights.T, record.values, strict=True):
        sums += (2.0 * flight[:, None] * np.sqrt(2.0 * heights / 9.81) - time) ** 2
    chances = np.cumsum((sums**-2.0).sum(axis=0))
    ends = np.interp([0.025, 0.975], chances / chances[-1], heights / 5.0 - 1.0)
    width = ends[1] - ends[0]
    low, high = found.interval("initial_position")
    assert high == pytest.approx(ends[1], abs=0.05 * width)
    # Here the half width of the covariance is larger.
    assert ends[0] - 0.1 * width < low < ends[0]
    # Its study gives no frequency, which nothing has, and runs.
    (study,) = found.studies.values()
    assert not {"forcing_frequency", "force_amplitude"} & {*study["parameters"]}
    assert cube_of(study).trajectory_time.max() > 1.3


class Bent:
    """Sum of squares with minima at x = -1 and 1; y and the constant are straight."""

    rate = 1.0

    def __init__(self):
        self.noise, self.records = [1.0], [damper.Recording(range(40), np.zeros(40))]
        self.unknowns = [
            Unknown("x", None, "x", "1", (-3.0, 1.1), (-3.0, 1.1)),
            Unknown("y", None, "y", "1", (-9.0, 9.0), (-9.0, 9.0)),
            Unknown("offset", 0, "offset", "1", (-9.0, 9.0), (0.0, 0.0)),
        ]

    def residuals(self, point, part=1.0, derivatives=False):
        x, y, offset = point
        rows = np.zeros((40, 3))
        rows[:2] = (4.0 * x, 0.2, 0.0), (0.0, 1.0, 0.0)
        rows[2:12, 2] = 1.0
        missed = np.r_[2.0 * x * x - 2.0 + 0.2 * y, y, np.full(10, offset), np.ones(28)]
        return missed, rows

    def count(self, k, part):
        return 40

    def size(self, k):
        return 1.0


def bent():
    """What finds the minima of that, and its fit at one of them."""
    fitter = Fitter(Bent())
    point = np.array([1.0, 0.0, 0.0]) + 1e-9  # samples with a residual of zero do not count
    for k in range(100):
        fitter._scored(fitter.start(k), (1.0,))
    return fitter, Fit(fitter.problem, point, *Bent().residuals(point), True)


@pytest.mark.parametrize("least", [math.inf, 0.0])
def test_draws_are_as_probable_as_all_points_are(least, monkeypatch):
    """Of two minima that the data cannot tell apart, and of a range that ends beside one.

    By populations, and by draws around these minima alone.
    """
    monkeypatch.setattr("damper.identification.draws._POINTS", 1200)
    monkeypatch.setattr("damper.identification.draws._DRAWS", (100, 12_000))
    monkeypatch.setattr("damper.identification.draws._SMOOTH_WHOLE", least)
    fitter, fit = bent()
    points = fitter.likely(fit)
    assert fitter.spread_of_means < AGREE
    x, y = np.meshgrid(np.linspace(-3.0, 1.1, 821), np.linspace(-9.0, 9.0, 721))
    sums = (2.0 * x * x - 2.0 + 0.2 * y) ** 2 + y * y + 28.0
    each = sums ** (-0.5 * (40 - 1))  # the constant takes one of the 40 data with it
    each /= each.sum()
    for j, values in enumerate((x, y)):
        for power in (1, 2):
            mean = float((each * values**power).sum())
            assert (points[:, j] ** power).mean() == pytest.approx(mean, abs=0.05)
    assert (points[:, 2] ** 2).mean() == pytest.approx(0.1 * fit.variance, rel=0.1)
    order = np.argsort(x.ravel())
    ends = np.interp([0.025, 0.975], np.cumsum(each.ravel()[order]), x.ravel()[order])
    low, high = fitter.ends(fit, 0.0, points)
    assert (low[0], high[0]) == pytest.approx(ends, abs=0.05)
    assert fitter.other(fit)[0] == pytest.approx(-1.0, abs=0.5)


def test_populations_that_differ_are_said(monkeypatch):
    """As where each stays in another minimum."""
    monkeypatch.setattr("damper.identification.draws._SMOOTH_WHOLE", math.inf)
    fitter, fit = bent()
    ways = iter((1.0, -1.0, 1.0))

    def population(self, *_):
        points = fit.point + 0.1 * self.generator.standard_normal((200, 3))
        points[:, 0] *= next(ways)
        return points, np.array([self.sums(point) for point in points])

    monkeypatch.setattr(Draws, "_population", population)
    monkeypatch.setattr(Draws, "_move", lambda *_: 0)
    points = fitter.likely(fit)
    assert next(ways, None) is None
    assert len(points) % 600 == 0
    assert 0.5 < points[:, 0].std() < 1.0
    assert "draws lie around different values" in " ".join(_warnings(fitter, fit, *fitter.bounds))


def test_a_known_table_and_its_study(tmp_path, monkeypatch):
    """A table of a mass as a file beside the machine's; its study has the rows, and runs."""
    monkeypatch.setattr("damper.identification.fit._ROUNDS", ((20, 1), (20, 1)))
    monkeypatch.setattr("damper.identification.draws._DRAWS", (60, 60))
    rows = [[0.5, 0.9], [5.0, 0.75]]
    (tmp_path / "law.csv").write_text("speed (m/s),r\n0.5,0.9\n5,0.75\n")
    table = {"restitution_table": "law.csv"}
    machine = FLOOR | {"masses": [table]}
    (tmp_path / "floor.yaml").write_text(yaml.safe_dump(machine))
    record = damper.Recording([0.5007, 0.3805, 0.2895, 0.2303], kind="intervals")
    found = damper.identify(record, ["initial_position"], tmp_path / "floor.yaml")
    (study,) = found.studies.values()
    assert study["masses"] == [{"restitution_table": rows}]
    common = damper.identify(record, ["initial_position"], FLOOR, restitution_table=rows)
    assert common["initial_position"] == pytest.approx(found["initial_position"], rel=1e-6)
    (study,) = common.studies.values()
    assert study["parameters"]["restitution_table"] == rows
    speeds = cube_of(yaml.safe_load(dump_yaml(study))).trajectory_event
    assert np.isfinite(speeds).sum() >= 5


@pytest.mark.compiled
def test_decay_page_and_study(tmp_path, monkeypatch):
    monkeypatch.setattr("damper.identification.fit._ROUNDS", ((50, 2), (50, 2)))
    monkeypatch.setattr("damper.identification.draws._POINTS", 50)
    monkeypatch.setattr("damper.identification.draws._DRAWS", (150, 150))
    times, values, _ = decay(0.5, 201)
    noise = 2e-5 * np.random.default_rng(2).standard_normal(len(times))
    path = tmp_path / "decay.csv"
    table = {"time (ms)": 1e3 * times, "displacement (mm)": 1e3 * (values + noise + 3e-4)}
    pd.DataFrame(table).to_csv(path, index=False)
    ranges = {"restitution": (0.4, 0.8), "gap": (0.007, 0.014)}
    frame = FRAME | {"friction_coefficient": 0.02, "initial_displacement": 0.02}
    found = damper.identify(path, ["r", "d"], frame, ranges=ranges)
    for name, true in (("restitution", 0.6), ("gap", 0.01), ("offset", 3e-4)):
        low, high = found.interval(name)
        assert low < true < high
        assert high - low < 0.05 * true
    assert found.rms["decay.csv"] == pytest.approx(2e-5, rel=0.1)
    assert not found.warnings
    assert "95 % interval" in repr(found)
    assert f"decay.csv: rms residual {1e3 * found.rms['decay.csv']:.3g} mm" in repr(found)
    found.save(tmp_path / "page")
    html = (tmp_path / "page" / "identification.html").read_text()
    assert "<svg" in html
    profile = pd.read_csv(tmp_path / "page" / "profile.csv")
    unit = {"restitution": "1", "gap": "m"}
    assert profile.unit.tolist() == [unit[name] for name in profile.quantity]
    assert f"<td>{text_of(profile.value.iloc[-1], 'm', 6)}</td>" in html
    study = yaml.safe_load((tmp_path / "page" / "studies" / "record_0.yaml").read_text())
    cube = cube_of(study)
    times = cube.trajectory_time.values
    there = (times < 0.5) & np.isnan(cube.trajectory_event.values)
    moved = np.interp(times[there], *decay()[:2])
    assert abs(cube.trajectory_displacement.values[there] - moved).max() < 5e-5


def test_what_the_data_cannot_tell_is_named():
    # In free motion all lengths may be larger together.
    times, values, _ = decay()
    record = damper.Recording(times, values, offset=False)
    known = {**FRAME, "friction_coefficient": 0.0, "transverse_acceleration": 0.0}
    asked = problem(record, ["gap", "initial_displacement", "scale"], known)
    fitter = Fitter(asked)
    fit = fitter.exact(np.array([0.01, 0.02, 1.0]))
    ((value, which),) = fit.confused
    assert value < 1e-6
    assert which == [0, 1, 2]
    assert np.isinf(np.diag(fit.covariance)).all()


def test_a_residual_larger_than_the_noise_is_said():
    times, values, _ = decay()
    noise = 2e-5 * np.random.default_rng(2).standard_normal(len(times))
    record = damper.Recording(times, values + noise, offset=False)
    assert record.own_noise[0] == pytest.approx(2e-5, rel=0.2)
    for gap, there in ((0.01, False), (0.0105, True)):
        fitter = Fitter(problem(record, ["restitution"], FRAME | {"gap": gap}))
        fit = fitter.fit(np.array([0.6]), 1.0, 10)
        said = " ".join(_warnings(fitter, fit, fit.point, fit.point))
        assert ("times what the record's noise explains" in said) is there
        assert ("no white noise" in said) is there


def test_chances_of_a_residual_are_those_of_white_noise():
    """Of records that are noise alone, a part of 5 % is beyond what has a chance of 5 %."""
    rng = np.random.default_rng(0)
    found = []
    for noise in [None] * 500 + [1.0] * 500:
        drawn = rng.standard_normal(200)
        record = damper.Recording(np.arange(200.0), drawn, noise=noise)
        alone = SimpleNamespace(records=[record], noise=[1.0], size=lambda _: 1.0)
        fit = Fit(alone, np.zeros(0), drawn, np.zeros((200, 0)), True)
        part = drawn[:80], np.zeros((80, 0))
        alone.residuals = lambda *_, part=part: part
        searched = SimpleNamespace(windows=[(0.4, fit.point)], problem=alone)
        chances = [fit.chance, Fitter._chance_in_part(searched, fit)]
        found.append([bool(fit.excess(0.05)), *(chance < 0.05 for chance in chances)])
    large, alike, in_part = np.transpose(found)
    for each in (large[:500], large[500:], alike, in_part):
        assert 0.02 < each.mean() < 0.08


@pytest.mark.parametrize("count", [3, 10_000, 25_001])
def test_sums_of_squares_are_of_products_for_one_thread(count):
    values = np.random.default_rng(count).standard_normal(count)
    assert sum_of_squares(values) == pytest.approx(math.fsum(values**2), rel=1e-13)
    parts = np.split(values, range(10_000, count, 10_000))
    assert sum_of_squares(values) == sum(float(part @ part) for part in parts)


def test_one_wrong_sample_is_no_white_noise():
    for wrong, there in ((0.0, False), (8.0, True)):
        drawn = np.random.default_rng(0).standard_normal(200)
        drawn[50] += wrong
        alone = SimpleNamespace(records=[damper.Recording(np.arange(200.0), drawn)])
        fit = Fit(alone, np.zeros(0), drawn, np.zeros((200, 0)), True)
        assert (fit.chance < 1e-3) is there


def test_searches_go_on_until_two_end_in_the_best_place(monkeypatch):
    times, values, _ = decay(0.2, 81)
    noise = 2e-5 * np.random.default_rng(2).standard_normal(len(times))
    record = damper.Recording(times, values + noise, offset=False)
    for costs, enough in (([1.0, 1.2, 1.0], True), ([1.3, 1.2, 1.0], False)):
        fitter = Fitter(problem(record, ["restitution"]))
        fit = fitter.fit(np.array([0.6]), 1.0, 3)
        left = iter([replace(fit, residuals=math.sqrt(cost) * fit.residuals) for cost in costs])
        monkeypatch.setattr(fitter, "_round", lambda *_, left=left: next(left))
        assert set(fitter._parts(0)) & set(fitter._parts(1)) == {1.0}  # other windows
        best = fitter.best()
        assert next(left, None) is None
        said = " ".join(_warnings(fitter, best, best.point, best.point))
        assert ("No two searches" in said) is not enough


def test_impacts_that_a_recorder_may_miss():
    # A burst after the third one, of which the record has some.
    computed = np.array([1.0, 2.0, 3.0, 3.2, 3.28, 3.3, 3.31, 4.0])
    assert _heard(np.array([1.01, 1.99, 3.0, 3.21, 4.02]), computed, 0.3) == [0, 1, 2, 3, 7]
    assert _heard(np.array([1.01, 1.99, 3.0, 3.29, 4.02]), computed, 0.3) == [0, 1, 2, 5, 7]
    # All others are there.
    assert _heard(np.array([1.01, 3.01, 4.02]), computed, 0.3) == [0, 1, 2]


def test_a_record_without_the_ball():
    times = np.linspace(0.0, 1.0, 101)
    rate, ratio = math.sqrt(400.0), 0.8 / (2.0 * math.sqrt(1600.0))
    damped = rate * math.sqrt(1.0 - ratio**2)
    values = np.exp(-ratio * rate * times) * (
        np.cos(damped * times) + ratio * rate / damped * np.sin(damped * times)
    )
    record = damper.Recording(times, 0.02 * values, ball=False)
    asked = problem(record, ["restitution", "damping"])
    residuals, jacobian = asked.residuals(np.array([0.6, 0.8, 0.0]), 1.0, True)
    assert abs(residuals * asked.noise[0]).max() < 1e-9
    assert jacobian.any(axis=0).tolist() == [False, True, True]


def test_a_high_pass_is_part_of_the_model():
    # Undamped motion cos(w t) through s/(s + a), with what the filter had before.
    times = np.linspace(0.0, 1.0, 2001)
    rate, corner = 20.0, 2.0 * math.pi
    gain = rate / (rate**2 + corner**2)
    passed = gain * (rate * np.cos(rate * times) - corner * np.sin(rate * times))
    values = 0.02 * (passed + 0.3 * np.exp(-corner * times))
    record = damper.Recording(times, values, high_pass=1.0, ball=False)
    asked = problem(record, ["initial_displacement"], FRAME | {"damping": 0.0})
    assert [u.name for u in asked.unknowns] == ["initial_displacement", "settling"]
    fit = Fitter(asked).fit(np.array([0.015, 0.0]), 1.0, 10)
    assert fit.point[0] == pytest.approx(0.02, rel=1e-3)
    assert abs(fit.residuals * asked.noise[0]).max() < 1e-5


def test_where_the_engine_has_no_derivative_runs_are_compared():
    times, values, _ = decay()
    push = damper.Record([0.0, 0.2, 0.7], [0.0, 1.0, 0.0])
    known = FRAME | {"forcing": push, "force_amplitude": 1.0}
    asked = problem(damper.Recording(times, values, offset=False), ["stiffness", "gap"], known)
    asked.fine = True
    _, jacobian = asked.residuals(np.array([800.0, 0.01]), 1.0, True)
    ends = [asked.residuals(np.array([k, 0.01]))[0] for k in (799.9, 800.1)]
    assert asked.differences == {"stiffness"}
    slope = (ends[1] - ends[0]) / 0.2
    assert np.median(abs(jacobian[:, 0] - slope)) < 1e-3 * abs(slope).max()


def test_files(tmp_path):
    times = np.arange(5) * 0.25
    savemat(tmp_path / "a.mat", {"x": [3.0, 1, 4, 1, 5], "t": times, "name": "a"})
    found = damper.read_recording(tmp_path / "a.mat")
    assert found.times.tolist() == times.tolist()
    assert found.values.tolist() == [3, 1, 4, 1, 5]
    wavfile.write(tmp_path / "a.wav", 4, np.array([0, 16384, -32768, 0, 0], np.int16))
    found = damper.read_recording(tmp_path / "a.wav", "acceleration", factor=10.0)
    assert found.times.tolist() == times.tolist()
    assert found.values.tolist() == [0.0, 5.0, -10.0, 0.0, 0.0]
    clicks = [0.1, 0.35, 0.52]
    seconds = np.arange(0, 0.8, 1 / 8000)
    sound = 1e-3 * np.random.default_rng(0).standard_normal(len(seconds))
    for click in clicks:
        since = np.maximum(seconds - click, 0.0)
        sound += (seconds >= click) * np.exp(-since / 5e-3) * np.sin(6000.0 * since)
    wavfile.write(tmp_path / "c.wav", 8000, sound.astype(np.float32))
    heard = damper.read_recording(tmp_path / "c.wav", "impacts").times
    assert heard == pytest.approx(clicks, abs=1e-3)
    (tmp_path / "a.csv").write_text("t (ms),a (g)\n0,1\n2,-1\n")
    found = damper.read_recording(tmp_path / "a.csv", "acceleration")
    assert found.times.tolist() == [0.0, 0.002]
    assert found.values.tolist() == [9.80665, -9.80665]
    (tmp_path / "i.csv").write_text("interval (s)\n0.5\n0.4\n")
    assert damper.read_recording(tmp_path / "i.csv", "intervals").times.tolist() == [0.5, 0.4]
    assert damper.read_recording(tmp_path / "i.csv", "intervals").unit == "s"
    with pytest.raises(ValueError, match=r"columns = \[0, 1, 2\]: must be those of time and value"):
        damper.read_recording(tmp_path / "a.csv", "acceleration", columns=[0, 1, 2])


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"free": ["gaap"]}, "unknown name in free 'gaap' (did you mean 'gap'?)"),
        ({"free": ["frction"]}, "unknown name in free 'frction' (did you mean 'friction'?)"),
        ({"free": ["gap_1"], "masses": [{}]}, "free: gap_1 is of mass 1, and masses has 1, from 0"),
        ({"free": ["gap_0"]}, "free: gap_0 is of mass 0, and there is no list masses"),
        ({"free": ["gap"], "masses": [{"gap": 0.01}]}, "gap: each of masses has its own"),
        ({"free": ["gap"], "structure": 1}, "structure: the machine of records has one primary"),
        ({"free": []}, "free: must name one unknown"),
        ({"free": ["r", "d"]}, "records: 3 data for 3 unknowns (restitution, gap, offset): must"),
        ({"free": ["r", "restitution"]}, "names one quantity twice"),
        ({"free": ["gravity"]}, "gravity is free: must have a value, a start or a range"),
        ({"free": ["r"], "starts": {"gap": 0.01}}, "starts: gap is not free"),
        ({"free": ["r"], "ranges": {"r": (0.5, 1.5)}}, "must go up within 0 to 1"),
        ({"free": ["r"], "ranges": {"r": 3}}, "must have a lowest and a highest value"),
        ({"free": ["r"], "starts": {"r": 2.0}}, "restitution = 2: starts outside of its range"),
        ({"free": ["r"], "restitution_table": [(1, 0.5)]}, "the two exclude each other"),
        ({"free": ["r"], "kind": "sound"}, "unknown kind 'sound'"),
        ({"free": ["d"], "stiffnes": 3.0}, "unknown parameter 'stiffnes'"),
        ({"free": ["d"], "free_mas": "3 g"}, "'free_mas' (did you mean 'free_mass'?)"),
        ({"free": ["d"], "record": []}, "'record' (did you mean 'records'?)"),
        ({"free": ["gap"], "machine": None}, "free: gap is in SI units, and the damper is dimens"),
        ({"free": 3}, "free = 3: must be a list of names"),
        ({"free": ["r"], "starts": [0.5]}, "starts = [0.5]: must be a mapping of names"),
        ({"free": ["r"], "starts": {"r": [0.5]}}, "starts: restitution = [0.5]: must be a real"),
        ({"free": ["r"], "gap": [0.01]}, "gap = [0.01]: must be a real number"),
        ({"free": ["r"], "forcing": {"kind": "harmonc"}}, "(did you mean 'harmonic'?)"),
        ({"free": ["r"], "forcing": {"kind": "record", "fil": "a"}}, "needs its file, or time"),
        ({"free": ["r"], "forcing": {"kind": "unbalance", "k": 1}}, "unknown setting of unbalance"),
        (
            {"free": ["r"], "machine": {"records": [{"fle": "a.csv"}]}},
            "records[0] = {'fle': 'a.csv'}: must be",
        ),
        (
            {"free": ["r"], "machine": {"records": [{"file": "a.csv", "nois": 1}]}},
            "unknown setting of a record 'nois' (did you mean 'noise'?)",
        ),
        (
            {"free": ["r"], "machine": {"records": [{"file": "a.csv", "colums": [0, 1]}]}},
            "unknown setting of a record 'colums' (did you mean 'columns'?)",
        ),
    ],
)
def test_mistakes_are_named(asked, message, tmp_path):
    (tmp_path / "a.csv").write_text("t (s),x (m)\n0,0.01\n0.1,0.02\n0.2,0.01\n")
    frame = {name: value for name, value in TRUE.items() if name != "gravity"}
    with pytest.raises((ValueError, TypeError)) as error:
        damper.identify(tmp_path / "a.csv", **{"machine": frame, **asked})
    assert message in str(error.value)


def test_samples_that_show_no_motion_are_refused():
    times = np.linspace(0.0, 0.7, 281)
    for value in (0.0, 1e-3):
        still = damper.Recording(times, 0.0 * times + value, label="still")
        with pytest.raises(ValueError, match=rf"^still: all values are {value:g}: must show a mot"):
            problem(still, ["gap"])
    coarse = damper.Recording(1e3 * times, np.sin(times), label="coarse")
    with pytest.raises(ValueError, match=r"^coarse: a step of 2.5 s, and a period .* of 0.314 s"):
        problem(coarse, ["gap"])
    problem(coarse, ["gap", "stiffness"])  # whose period is not known


def test_a_quantity_of_one_of_several_masses_may_be_unknown():
    known = {name: value for name, value in TRUE.items() if name != "gravity"}
    known |= {"forcing": "none", "masses": [{}, {"gap": 0.02}]}
    record, names = damper.Recording(*decay(0.2, 21)[:2]), ["gap_1", "restitution_0"]
    asked = RecordedDamper(known, [record], names, {}, {})
    own, r = asked.unknowns[:2]
    assert (own.name, own.unit, own.value, r.value) == ("gap_1", "m", 0.02, TRUE["restitution"])
    assert own.starts == pytest.approx((0.02 / 3.0, 0.06))
    parameters, _ = asked.start(asked.values_of(np.array([0.03, 0.4, 0.0]), 0), 0.0)
    first, second = parameters.dimensionless.each
    assert second.clearance == pytest.approx(first.clearance * 0.03 / TRUE["gap"])
    assert (first.restitution, second.restitution) == (0.4, TRUE["restitution"])


def test_a_table_of_samples_is_no_record():
    for table in (np.ones((3, 2)), {"t": [0, 1]}):
        with pytest.raises(TypeError, match=r"^records is of class .*must be a file or damper.Rec"):
            damper.identify(table, ["restitution"], TRUE)
    shown = repr(damper.Recording([0, 1, 2.5], [0, 1, 2], label="top"))
    assert shown == "<Recording top: displacement, 3 times from 0 to 2.5>"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"times": [0.0, 1.0, 1.0], "values": [1, 2, 3]}, "time 1 follows 1 (sample 2 from 0)"),
        ({"times": [0.0, 1.0], "values": [1, math.nan]}, "values[1] = nan: must be finite"),
        ({"times": [0.0, 1.0]}, "values are missing"),
        ({"times": [0.0, 1.0], "kind": "impacts", "trend": True}, "offset, trend and high_pass"),
        ({"times": [0.5, -1.0], "kind": "intervals"}, "must be > 0"),
        ({"times": [0.0, 1.0, 3.0], "values": [1, 2, 3], "high_pass": 1.0}, "equal steps"),
        ({"times": [0.0, 1.0], "values": [1, 2], "known": {"gaap": 1}}, "did you mean 'gap'?"),
    ],
)
def test_records_are_checked(given, message):
    with pytest.raises((ValueError, TypeError)) as error:
        damper.Recording(**given)
    assert message in str(error.value)


@pytest.mark.compiled
def test_command(tmp_path):
    (tmp_path / "golf.csv").write_text("interval (s)\n0.8396\n0.7503\n0.6723\n0.6018\n")
    floor = FLOOR | {"initial_position": -0.78, "free_mass": "1000 g", "gap": "1000 cm"}
    (tmp_path / "floor.yaml").write_text(yaml.safe_dump(floor))
    given = ["identify", str(tmp_path / "golf.csv"), "--kind", "intervals", "--free", "r"]
    given += ["--machine", str(tmp_path / "floor.yaml")]
    done = CliRunner().invoke(main, [*given, "--output", str(tmp_path / "found")])
    assert done.exit_code == 0, done.output
    assert "restitution 0.89" in done.output
    assert (tmp_path / "found/values.csv").exists()
    (tmp_path / "more.csv").write_text("n;ms\n1;839.6\n2;750.3\n3;672.3\n4;601.8\n")
    read = [*given[:1], str(tmp_path / "more.csv"), *given[2:], "--columns", "ms"]
    assert "restitution 0.89" in CliRunner().invoke(main, read).output
    done = CliRunner().invoke(main, [*given, "--start", "r"])
    assert done.exit_code == 1
    assert "--start r: must be NAME=VALUE" in done.output
    for name in ("restitution", "r"):
        done = CliRunner().invoke(main, [*given, "--known", f"{name}=0.5"])
        assert done.exit_code == 1
        assert f"--known {name}: is unknown by --free r: must be --start" in done.output
    done = CliRunner().invoke(main, ["identify", str(tmp_path / "gold.csv"), *given[2:]])
    assert "gold.csv: there is no such file; did you mean 'golf.csv'?" in done.output
    done = CliRunner().invoke(main, ["identify", str(tmp_path / "x/golf.csv"), *given[2:]])
    assert f"golf.csv: there is no folder {tmp_path / 'x'}" in done.output
    done = CliRunner().invoke(main, [*given, "--range", "gap=5mm:9kg"])
    assert "gap = '9kg': has the unit 'kg': must be a number in m" in done.output
