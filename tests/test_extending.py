"""The examples of docs/extending.md, in a copy of the package."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml
from project_copy import copy_project, jobs, snakemake

from damper import Parameters, events

ROOT = Path(__file__).parents[1]
EXTENDING = (ROOT / "docs/extending.md").read_text()
BLOCKS = re.findall(r"```python\n(.*?)```", EXTENDING, re.DOTALL)
OBSERVER, OBSERVED, FIGURE, TABLE, RUN_SETTING, LAW, QUANTITY, SI_QUANTITY, WITH_LAW = BLOCKS[:9]
OFFSET, SI_OFFSET, PULL, FORCE, BOX, WITH_FORCE, STUDY_SETTINGS, STUDY_JOBS = BLOCKS[9:]
(FIGURES,) = re.findall(r"```yaml\n(.*?)```", EXTENDING, re.DOTALL)
(STATEMENT,) = re.findall(r"(?m)^    Statement\((?:\n    .*)+\n    \),\n", EXTENDING)


def insert(path: Path, before: str, block: str) -> None:
    text = path.read_text()
    assert text.count(before) == 1
    path.write_text(text.replace(before, block + before))


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """The package with all examples in it."""
    folder = tmp_path_factory.mktemp("copy")
    package = folder / "damper"
    shutil.copytree(ROOT / "src/damper", package, ignore=shutil.ignore_patterns("__pycache__"))
    (package / "observers/wall_share.py").write_text(OBSERVER)
    (package / "figures/histogram.py").write_text(FIGURE)
    (package / "tables/extremes.py").write_text(TABLE)
    with (package / "engine/impact.py").open("a") as file:
        file.write("\n\n" + LAW)
    kind = package / "verification/first_impacts"
    kind.mkdir()
    for name, text in (("__init__", ""), ("settings", STUDY_SETTINGS), ("jobs", STUDY_JOBS)):
        (kind / f"{name}.py").write_text(text)
    dampers = package / "parameters/dampers.py"
    insert(dampers, "    yield_speed: float = quantity(", QUANTITY)
    insert(dampers, "    yield_speed: float = shared(", SI_QUANTITY)
    insert(dampers, "    support_damping_ratio: float = quantity(", OFFSET)
    insert(dampers, "    support_damping: float = quantity(", SI_OFFSET)
    insert(dampers, "        return self.gravity\n", PULL)
    names = package / "parameters/names.py"
    insert(names, '    *("mass_share", "clearance_factor"),\n', '    "support_offset",\n')
    insert(
        names,
        '    *("yield_speed", "yield_exponent", "support_stiffness", "supp',
        '    "support_offset",\n',
    )
    before = "\n\n@dataclass(frozen=True, kw_only=True)\nclass EngineSettings"
    insert(package / "parameters/run.py", before, RUN_SETTING)
    insert(package / "papers/paper_b.py", '    Statement(\n        "B6",', STATEMENT)
    insert(package / "sweep/runs.py", ", time, length)", " + settings.pause")
    return folder


def run(copy: Path, code: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(copy)}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment, cwd=copy
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_observer_is_one_short_file(copy):
    assert len(OBSERVER.splitlines()) < 50
    more = """
import json
single = damper.simulate(
    mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.8, clearance=0.25, restitution=0.6,
    halving_speed=0.5, observers={"wall_share": None}, transient=0, periods=20,
)
parameters = damper.Parameters(0.1, 0.05, 0.8, 0.25, 0.6, halving_speed=0.5)
found = damper.events(parameters, until=20 * parameters.cycle)
sides = found["side"][found["kind"] == 0]
print(json.dumps([single.right_share.item(), (sides > 0).mean(), single.status.item()]))
"""
    observed, counted, status = json.loads(run(copy, OBSERVED + more).splitlines()[-1])
    assert status == 0
    assert observed == pytest.approx(counted, abs=1e-15)
    assert 0.0 < observed < 1.0


STUDY = f"""
title: All clearances
source: docs/extending.md
parameters: {{mass_ratio: 0.1, damping_ratio: 0.05, restitution: 0.6}}
axes:
  frequency_ratio: {{values: [0.8, 1.0, 1.2]}}
  clearance: {{values: [0.25, 0.5]}}
transient: 5
periods: 5
pause: 3
observers: {{response: , wall_share: }}
{FIGURES}
  map: {{kind: map, variable: right_share, x: frequency_ratio, y: clearance}}
  curves: {{kind: curves, variables: [right_share], along: frequency_ratio, lines: clearance}}
tables:
  ends: {{kind: extremes, variables: [rms_ratio]}}
"""


def test_a_study_asks_for_all_and_its_mistakes_are_named(copy, tmp_path):
    """An observer, a kind of figure and one of table are a file each, a key of every run is two.

    All are in the reference and the schema.
    """
    study = tmp_path / "all.yaml"
    study.write_text(STUDY)
    code = f"""
import json, sys
from pathlib import Path
import damper
from damper.figures import draw
from damper.study.config import ConfigError, load_study
from damper.study.reference import files
from damper.tables import make
made = files()
reference, schema = made["docs/reference.md"], made["config/schema/study.schema.json"]
for text in ("`right_share`", "`observers.wall_share.above`", "| `figures.<file>.bins` |",
             "### kind: extremes", "`B7`"):
    assert text in reference, text
assert '"const": "histogram"' in schema
path = Path({str(study)!r})
study = load_study(path)
light = "matplotlib" not in sys.modules and "xarray" not in sys.modules
values, asked = study.fixed | study.axis_values, study.observer_settings()
cube = damper.simulate(**values, **study.run, observers=asked)
later = damper.simulate(**values, transient=8, periods=5, observers=asked)
assert (cube.rms_ratio == later.rms_ratio).all()
assert cube.attrs["pause"] == 3
assert "pause : int, default 0" in damper.simulate.__doc__
panels = {{}}
for name, (_, settings) in study.files("figures").items():
    panels[name] = draw(settings.pop("kind"), {{"cube": cube}}, **settings).axes
heights = [bar.get_height() for bar in panels["figures/spread"][0].patches]
found = make(results={{"cube": cube}}, **study.tables["ends"].model_dump())
ends = found.data["value"].tolist()
for mistake in (
    {{"observers": {{"wall_share": {{"abvoe": 0.5}}}}}},
    {{"figures": {{"map": {{"variable": "right_shar"}}}}}},
    {{"figures": {{"spread": {{"variable": "rms_rato"}}}}}},
    {{"pause": -1}},
):
    try:
        load_study(path, mistake)
    except ConfigError as error:
        print(json.dumps(str(error)))
print(json.dumps([light, len(heights), sum(heights), ends,
                  [float(cube.rms_ratio.min()), float(cube.rms_ratio.max())], found.markdown(),
                  len(panels["figures/map"]), len(panels["figures/curves"])]))
"""
    *messages, found = map(json.loads, run(copy, code).splitlines())
    light, bars, points, ends, true, markdown, *panels = found
    assert light
    assert (bars, points, panels) == (12, 6, [2, 1])
    assert ends == true
    assert markdown.startswith("# Impact damper simulation: extremes\n")
    known = ("unknown key 'abvoe'", "did you mean 'right_share'?", "did you mean 'rms_ratio'?")
    for message, part in zip(messages, (*known, "pause"), strict=True):
        assert part in message


def test_contact_law_is_a_function_and_its_parameter(copy):
    check = """
import json
from damper.engine.segment import CAUSE, IMPACT, GAP_RATE, SPEED
from damper.models import start_run
run = start_run(parameters)
worst, impacts = 0.0, 0
for log in run.segments(20.0, 0.0):
    for row in log[log[:, CAUSE] == IMPACT]:
        restitution = 0.6 / (1.0 + row[SPEED] / 0.5)
        worst = max(worst, abs(row[GAP_RATE] / row[SPEED] / restitution - 1.0))
        impacts += 1
constant = damper.events(damper.Parameters(0.1, 0.05, 0.8, 0.25, 0.6), until=100.0)
endless = damper.Parameters(0.1, 0.05, 0.8, 0.25, 0.6, halving_speed=1e300)
same = (damper.events(endless, until=100.0) == constant).all()
for more in ({"yield_speed": 1.0}, {"contact_stiffness_ratio": 1e4}, {"masses": [{}]}):
    try:
        damper.Parameters(0.1, 0.05, 0.8, 0.25, 0.6, halving_speed=0.5, **more)
    except ValueError as error:
        print(error)
print(json.dumps([worst, impacts, bool(same)]))
"""
    *_, laws, compliant, masses, last = run(copy, WITH_LAW + check).splitlines()
    worst, impacts, same = json.loads(last)
    assert impacts > 20
    assert worst < 1e-15
    assert same
    assert "ask for different contact laws" in laws
    assert "compliant contact has a constant restitution" in compliant
    assert masses.startswith("masses and halving_speed (halving)")


def test_constant_of_a_mass_is_a_declaration_and_where_it_acts(copy):
    """A weight, of one mass as of each of several, also in SI units; refused without support."""
    check = """
import json
from damper import Parameters, SIParameters, events, simulate
given = dict(mass_ratio=0.125, damping_ratio=0.05, frequency_ratio=0.8, clearance=0.25,
             restitution=0.6, support_stiffness_ratio=0.0625)
alike = []
for one, other in (
    ({"support_offset": -0.5}, {"gravity": 0.25}),
    ({"masses": [{}, {"support_offset": -0.5}]}, {"masses": [{}, {"gravity": 0.25}]}),
):
    p, q = Parameters(**given, **one), Parameters(**given, **other)
    found = events(p, until=60.0)
    alike += [len(found), found.tobytes() == events(q, until=60.0).tobytes()]
si = SIParameters.of(p, 2.0, 200.0, 10.0)
si = SIParameters(**si.given)
alike.append(abs(dict(si.dimensionless.masses[1])["support_offset"] + 0.5) < 1e-15)
cube = simulate(**given, masses=[{}, {}], support_offset_1=[0.0, -0.5], transient=0, periods=2,
                observers=["response"])
alike.append(float(abs(cube.energy_residual).max()) < 1e-12)
del given["support_stiffness_ratio"]
try:
    Parameters(**given, support_offset=0.1)
except ValueError as error:
    print(error)
print(json.dumps(alike))
"""
    message, last = run(copy, check).splitlines()
    assert "support_offset without support_stiffness_ratio" in message
    count, same, count_of_two, same_of_two, scaled, balanced = json.loads(last)
    assert min(count, count_of_two) > 20
    assert [same, same_of_two, scaled, balanced] == [True] * 4


def test_one_entry_makes_a_statement_and_its_score(copy):
    code = """
import xarray as xr
from damper.papers.statements import STATEMENTS
from damper.papers.tables.scores import scores_of
from damper.papers.verdicts import judge, table
chatter = ("clearance", "restitution"), [[2, 0], [2, 2]]
cube = xr.Dataset({"chatter": chatter}, {"clearance": [0.1, 0.2], "restitution": [0.9, 1.0]})
found = [one for one in judge({"restitution": cube}) if one.statement.name == "B7"]
print(table(found).markdown(), table(found).csv(), [one.name for one in STATEMENTS][-2:])
print(scores_of(cube, ["B7"])["B7"].values.tolist())
"""
    printed = run(copy, code)
    assert "## B7: without losses at impacts no chatter completes" in printed
    assert "\n- Found: complete chatter at restitution 1\n" in printed
    assert "\n- Verdict: **does not hold**: chatter counts as complete" in printed
    assert "\nB7,without losses" in printed
    assert printed.endswith("['B7', 'B6']\n[1.0, 0.0]\n")


def test_kind_of_study_needs_no_rule(copy, tmp_path):
    """Its parts run by the rules of all kinds; what is damaged or edited is made again."""
    project = copy_project(tmp_path)
    study = {"title": "First", "source": "docs", "kind": "first_impacts"}
    study["clearances"] = [0.1, 0.5, 0.9]
    (project / "config/studies/first.yaml").write_text(yaml.safe_dump(study))
    (project / "config/config.yaml").write_text("studies: [first]\n")
    environment = {"PYTHONPATH": str(copy), "DAMPER_COMPILE": "0"}
    part = project / "results/first/parts/clearance~0.5.npz"
    part.parent.mkdir(parents=True)
    part.write_bytes(b"cut short")
    output = snakemake(project, **environment)
    assert f"{part.relative_to(project)} is damaged" in output
    assert jobs(output) == {"part": 3, "gather": 1, "all": 1}
    with xr.open_dataset(project / "results/first/cube.nc") as cube:
        assert cube.clearance.values.tolist() == [0.1, 0.5, 0.9]
        assert (np.diff(cube.first_impact) > 0.0).all()
        found = events(Parameters(0.1, 0.05, 0.8, 0.5, 0.6), until=100.0)
        assert cube.first_impact.sel(clearance=0.5) == found["time"][0]
        assert cube.attrs["code_digest"]
    with (copy / "damper/verification/first_impacts/jobs.py").open("a") as edited:
        edited.write("# edited\n")
    assert jobs(snakemake(project, "-n", **environment))["part"] == 3


def test_a_force_is_one_file(tmp_path):
    """Its events are those of a record with small steps; what it cannot do is refused."""
    (tmp_path / "decaying_push.py").write_text(FORCE + "\n\n" + BOX)
    check = """
from dataclasses import replace
import numpy as np
time = np.linspace(0.0, 25.0, 25001)
for model in ({}, {"support_stiffness_ratio": 0.2}, {"modulation_depth": 0.2}):
    given = dict(zip(parameters.given, (0.1, 0.05, 1.0, 0.3, 0.6)), **model)
    record = damper.Record(time, np.exp(-0.4 * time))
    found, expected = (
        damper.events(damper.Parameters(**given, forcing=force), until=20.0)["time"]
        for force in (DecayingPush(0.4), record)
    )
    print(len(found) > 5, len(found) == len(expected), abs(found - expected).max() < 1e-5)
cube = damper.simulate(
    **given, forcing=DecayingPush(0.4), observers={"response": {}}, transient=0, periods=3
)
print(abs(float(cube.energy_residual)) < 1e-12)
plain = damper.Parameters(0.1, 0.05, 1.0, 0.3, 0.6, forcing=DecayingPush(0.4))
run = damper.run(plain, until=20.0)
print("decaying_push, rate 0.4" in run.plot().get_suptitle())
# A unit of time is half a second.
si = {"primary_mass": 1.0, "stiffness": 4.0, "damping": 0.2, "force_amplitude": 4.0}
si |= {"free_mass": 0.1, "gap": 0.6, "restitution": 0.6}
found = damper.events(damper.SIParameters(**si, forcing=DecayingPush(0.8)), until=10.0)["time"]
print(len(found) == len(run.events), abs(found - 0.5 * run.events["time"]).max() < 1e-12)
found = damper.events(box, damper.State(1.0, 0.0, 0.9, 0.0), until=20.0)
time, side = found["time"], found["side"]
print(len(found) >= 3, abs(found["x"] - np.exp(-0.4 * time)).max() < 1e-15)
walls = found["x"] + 0.3 * side
before = np.diff(walls) / np.diff(time)
speed = side[1:] * (before - found["v"][1:])
print(abs(speed - found["approach_speed"][1:]).max() < 1e-12)
soft = {"modulation_depth": 0.0, "contact_stiffness_ratio": 1e3}
for refused in (
    lambda: damper.periodic_orbit(parameters),
    lambda: damper.events(replace(parameters, **soft), until=9.0),
):
    try:
        refused()
    except (TypeError, ValueError) as error:
        print(type(error).__name__)
"""
    environment = {**os.environ, "PYTHONPATH": f"{ROOT / 'src'}{os.pathsep}{tmp_path}"}
    environment["DAMPER_COMPILE"] = "0"
    code = [sys.executable, "-c", WITH_FORCE + check]
    done = subprocess.run(code, capture_output=True, text=True, env=environment, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rigid, grounded, varying, balance, drawn, si, *others = done.stdout.splitlines()[-10:]
    box, speeds, orbit, compliant = others
    assert (drawn, si) == ("True", "True True")
    assert (box, speeds) == ("True True", "True")
    assert (rigid, grounded, varying) == ("True True True",) * 3
    assert (balance, orbit, compliant) == ("True", "ValueError", "TypeError")
