"""The force of a study: what a file says of it reaches the engine, and what is refused."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import studies
import xarray as xr
import yaml
from jsonschema import Draft202012Validator
from studies import ENGINE, MISTAKES

import damper
import damper.notebook
from damper.analysis.closed_forms import damper_at
from damper.analysis.orbits import follow_orbits
from damper.models import model_of
from damper.parameters.forcing import FORCINGS, Forcing
from damper.report.interactive import interactive
from damper.study.config import ConfigError, load_study
from damper.study.fingerprint import fingerprint
from damper.study.jobs import file_digest, read_files
from damper.study.parts import engine_parts
from damper.sweep import branches
from damper.sweep.record import force_of
from damper.tables import Table

ROOT = Path(__file__).parents[2]
SCHEMA = Draft202012Validator(json.loads((ROOT / "config/schema/study.schema.json").read_text()))
STUDY = """\
title: Forces
source: our own
parameters: {mass_ratio: 0.1, damping_ratio: 0.05, frequency_ratio: 0.8, restitution: 0.6}
axes: {clearance: {values: [0.5, 1, 2], fan: true}}
transient: 1
periods: 4
observers: {stroboscopic_section: , impacts: , response: }
"""
POINT = {"mass_ratio": 0.1, "damping_ratio": 0.05, "frequency_ratio": 0.8, "restitution": 0.6}
SI_STUDY = STUDY.replace(
    "mass_ratio: 0.1, damping_ratio: 0.05, frequency_ratio: 0.8", "{}"
).replace("clearance: {values: [0.5, 1, 2]", "gap: {values: [0.02, 0.04]")
SI_POINT = {
    "primary_mass": 2.0,
    "damping": 4.0,
    "stiffness": 200.0,
    "forcing_frequency": 11.0,
    "free_mass": 0.2,
}
CSV = "time (s),acceleration (m/s2)\n0,0\n1,3\n2,-1\n3,0\n"
NOISE = "{kind: noise, seed: %s, step: 0.1, duration: 60, band: [0.5, 2]}"

#: What a study says -> the same in Python.
SAID: dict[str, Forcing | str] = {
    "none": "none",
    "harmonic": "harmonic",
    "base": "base",
    "{kind: base, frame: base}": damper.Base("base"),
    "unbalance": "unbalance",
    "{kind: harmonics, orders: [1, 3], amplitudes: [1, 0.3], phases: [0, 1]}": damper.Harmonics(
        (1, 3), (1.0, 0.3), (0.0, 1.0)
    ),
    "{kind: record, file: quake.csv, of: base_acceleration}": damper.Record(
        [0, 1, 2, 3], [0, 3, -1, 0], "base_acceleration"
    ),
    "{kind: record, time: [0, 1, 2], value: [0, 4, 1], after: hold}": damper.Record(
        [0, 1, 2], [0, 4, 1], after="hold"
    ),
    NOISE % 1: damper.Noise(1, 0.1, 60.0, (0.5, 2.0)),
}


def written(folder: Path, forcing: str, more: str = "", text: str = STUDY) -> str:
    (folder / "quake.csv").write_text(CSV)
    return f"{text}forcing: {forcing}\n{more}"


def load(folder: Path, *given: str, **text: str) -> Any:
    return studies.load(folder, written(folder, *given, **text), "forces")


def blame(folder: Path, *given: str) -> str:
    return studies.blame(folder, written(folder, *given), "forces")


run = studies.cube_of


def simulated(said: str, **given: Any) -> xr.Dataset:
    """The same runs without a study."""
    observers = ["stroboscopic_section", "impacts", "response"]
    return damper.simulate(**given, forcing=SAID[said], transient=1, periods=4, observers=observers)


def same(one: xr.Dataset, other: xr.Dataset) -> None:
    assert set(one.data_vars) == set(other.data_vars)
    for name in other.data_vars:
        np.testing.assert_array_equal(one[name], other[name], err_msg=str(name))


def test_every_kind_is_here() -> None:
    forces = (damper.Parameters(**POINT, clearance=1.0, forcing=f).forcing for f in SAID.values())
    assert {force.kind for force in forces} == set(FORCINGS)


@pytest.mark.parametrize("said", SAID)
def test_study_runs_as_simulate_does(tmp_path: Path, said: str) -> None:
    study = load(tmp_path, said)
    cube = run(study)
    same(cube, simulated(said, **POINT, clearance=[0.5, 1, 2]))
    # It says the same after it was written out.
    (tmp_path / "again.yaml").write_text(study.to_yaml())
    assert load_study(tmp_path / "again.yaml").force == study.force
    assert ("forcing" in cube.attrs) == (said != "harmonic")
    if study.force.kind not in ("harmonic", "record"):
        assert force_of(cube)["forcing"] == study.force


@pytest.mark.parametrize(
    ("said", "amplitude", "unit"),
    [
        ("base", 0.003, "m"),
        ("{kind: record, file: quake.csv, of: base_acceleration}", 9.81, "m/s2"),
        ("none", 0.0, "N"),
    ],
)
def test_si_units(tmp_path: Path, said: str, amplitude: float, unit: str) -> None:
    given = SI_POINT | {"force_amplitude": amplitude}
    values = ", ".join(f"{name}: {value}" for name, value in given.items())
    study = load(tmp_path, said, text=SI_STUDY.replace("{}", values))
    cube = run(study)
    direct = simulated(said, **given, restitution=0.6, gap=[0.02, 0.04])
    same(cube, direct)
    assert cube.force_amplitude.attrs["units"] == direct.force_amplitude.attrs["units"] == unit
    # So does all that people read: the page with its sliders, and tables.
    assert study.values["force_amplitude"] == f"{amplitude:g} {unit}"
    about = {"fixed": study.fixed, "axes": study.axis_values, "primary": "rest", "draws": {}}
    about |= {"follow": {}, "run": study.run, "observers": {}}
    settings = {"kind": "bifurcation", "along": "gap", "variables": ["peak_displacement"]}
    shown = {one["name"]: one for one in interactive(cube, settings, about)["parameters"]}
    milli = {"m": "mm"}
    assert shown["force_amplitude"]["units"] == milli.get(unit, unit)
    table = Table.of(cube, "a table", pd.DataFrame(), []).markdown()
    assert (f"force amplitude {amplitude:g} {unit}, " in table) == (said != "none")
    values = values.replace(f"force_amplitude: {amplitude}", "gravity: 0")
    if said == "none":  # it has no amplitude
        assert load(tmp_path, said, text=SI_STUDY.replace("{}", values)).fixed == study.fixed | {
            "gravity": 0.0
        }
        return
    with pytest.raises(ConfigError, match=f"force_amplitude >= 0 in {unit}, under"):
        load(tmp_path, said, text=SI_STUDY.replace("{}", values))


def test_laws_of_noise_are_for_noise_alone(tmp_path: Path) -> None:
    shown = "tables: {one: {kind: statistics}}\n"
    text = STUDY.replace("response: }", "statistics: }")
    assert load(tmp_path, NOISE.replace("[0.5, 2]", "[0, 6]") % 1, shown, text).tables
    with pytest.raises(ConfigError, match=r"tables.one\n    shows the laws of noise"):
        load(tmp_path, "harmonic", shown, text)
    message = r"observers.statistics\n    the window ends at 39.2699, after the noise, which .* 38"
    with pytest.raises(ConfigError, match=message + r"\n    allowed: a window within it"):
        load(tmp_path, NOISE.replace("60, band: [0.5, 2]", "38, band: [0, 6]") % 1, text=text)


def test_times_and_bands_of_a_study_in_si_units_may_have_units(tmp_path: Path) -> None:
    units = "{kind: noise, seed: 1, step: 100 ms, duration: 1 min, band: [0.5 rad/s, 2 rad/s]}"
    text = SI_STUDY.replace("{}", "primary_mass: 2, damping: 4, stiffness: 200, free_mass: 0.2")
    text = text.replace("periods: 4", "periods: {time: 4000 ms}")
    text = text.replace("restitution", "force_amplitude: 1, restitution")
    made = load(tmp_path, units, text=text)
    assert made.force == damper.Noise(1, 0.1, 60.0, (0.5, 2.0))
    assert made.periods.time == 4.0
    assert SCHEMA.is_valid(yaml.safe_load(written(tmp_path, units, text=text)))


def test_each_draw_has_a_noise_of_its_own(tmp_path: Path) -> None:
    text = STUDY.replace("[0.5, 1, 2]", "[1]")
    study = load(tmp_path, NOISE % "draw", "draws: {count: 3, seed: 1}\n", text)
    cube = run(study)
    assert len(set(cube.noise_seed.values.tolist())) == 3
    for draw, seed in enumerate(cube.noise_seed.values.tolist()):
        noise = damper.Noise(seed, 0.1, 60.0, (0.5, 2.0))
        assert force_of(cube.sel(draw=draw)) == {"forcing": noise}
        direct = damper.simulate(
            **POINT,
            clearance=[1],
            forcing=noise,
            transient=1,
            periods=4,
            observers=["stroboscopic_section", "impacts", "response"],
        )
        same(cube.sel(draw=draw), direct)
    with pytest.raises(ValueError, match="choose a draw"):
        force_of(cube)
    other = load(
        tmp_path, NOISE % "draw", "draws: {count: 3, seed: 1, initial_position: [0, 1]}\n", text
    )
    assert run(other).noise_seed.values.tolist() == cube.noise_seed.values.tolist()


def test_studies_that_share_compiled_code_have_the_same_constants(tmp_path: Path) -> None:
    def sort_of(constants: Any) -> Any:
        if isinstance(constants, tuple):
            return type(constants), tuple(map(sort_of, constants))
        return type(constants), getattr(constants, "dtype", None)

    sorts: dict[str, set[Any]] = {}
    for said in SAID:
        study: Any = load(tmp_path, said)
        [part] = engine_parts(study)
        sorts.setdefault(part, set()).update(sort_of(model_of(point)) for point in study.corners)
    assert set(sorts) == {
        "engine",
        "engine_none",
        "engine_base_base",
        "engine_harmonics",
        "engine_record_force",
        "engine_record_base_acceleration",
    }
    assert {len(found) for found in sorts.values()} == {1}


@pytest.mark.parametrize(
    ("said", "right"),
    [
        *((said, True) for said in SAID),
        (NOISE % "draw", True),
        ("{kind: record, file: a.csv, columns: [time, 2], delimiter: ;}", True),
        ("bse", False),
        ("{kind: base, frame: wall}", False),
        ("{kind: unbalance, frame: base}", False),
        (NOISE % "x", False),
    ],
    ids=str,
)
def test_schema(said: str, right: bool) -> None:
    data = yaml.safe_load(f"{STUDY}forcing: {said}\n")
    assert SCHEMA.is_valid(data) == right


def test_bytes_of_a_record_count(tmp_path: Path) -> None:
    said = "{kind: record, file: quake.csv, of: base_acceleration}"

    def made_of(study: Any) -> list[str]:
        jobs = [*study.parts(ENGINE).values(), *study.gathered(ENGINE).values()]
        files = [{k: file_digest(path) for k, path in job.files.items()} for job in jobs]
        return [fingerprint([j.settings, f]) for j, f in zip(jobs, files, strict=True)]

    study = load(tmp_path, said)
    before, paths = made_of(study), study.force_files
    digests = {name: file_digest(path) for name, path in paths.items()}
    assert read_files(paths, digests) == paths
    # Elsewhere, the same bytes are the same record.
    (tmp_path / "other").mkdir()
    assert made_of(load(tmp_path / "other", said)) == before
    (tmp_path / "quake.csv").write_text(CSV.replace("1,3", "1,3.5"))
    study = load_study(tmp_path / "forces.yaml")
    assert not set(made_of(study)) & set(before)
    for change in (lambda: None, (tmp_path / "quake.csv").unlink):
        change()
        with pytest.raises(SystemExit, match=r"quake\.csv has changed"):
            read_files(paths, digests)


def test_examples_of_the_documentation(tmp_path: Path) -> None:
    section = (ROOT / "docs/studies.md").read_text().split("\n## Forces\n")[1].split("\n## ")[0]
    (tmp_path / "quake.csv").write_text(CSV)
    whole = yaml.safe_load(STUDY)
    kinds = set()
    for block in re.findall(r"(?m)(?:^    .*\n)+", section):
        given = yaml.safe_load(block)
        study = whole | given
        if "parameters" not in given:
            study["parameters"] = {n: v for n, v in POINT.items() if n not in study["axes"]}
            if "clearance" not in study["axes"]:
                study["parameters"]["clearance"] = 1
        path = tmp_path / "example.yaml"
        path.write_text(yaml.safe_dump(study))
        kinds.add(load_study(path).force.kind)
    assert kinds == {"record", "base", "none", "noise"}


def test_frequencies_in_hertz(tmp_path: Path) -> None:
    given = SI_POINT | {"force_amplitude": 1.0, "forcing_frequency": "{value: 3.5, unit: Hz}"}
    text = SI_STUDY.replace("{}", ", ".join(f"{name}: {value}" for name, value in given.items()))
    study = load(tmp_path, "harmonic", text=text)
    assert study.fixed["forcing_frequency"] == 2.0 * np.pi * 3.5
    assert study.values["forcing_frequency"] == "3.5 Hz"
    assert study.to_yaml() == load(tmp_path, "harmonic", text=study.to_yaml()).to_yaml()
    del given["forcing_frequency"]
    text = SI_STUDY.replace("{}", ", ".join(f"{name}: {value}" for name, value in given.items()))
    axis = "axes: {forcing_frequency: {start: 3, stop: 4, num: 3, unit: Hz}, "
    study = load(tmp_path, "harmonic", text=text.replace("axes: {", axis))
    assert study.axis_values["forcing_frequency"] == tuple(2.0 * np.pi * f for f in (3, 3.5, 4))
    assert study.values["forcing_frequency"] == "3, 3.5, 4 Hz"
    places = "{gap: 0.02, forcing_frequency: 3.5}"
    history = f"figures: {{one: {{kind: trajectory, at: {places}, caption: C}}}}\n"
    drawn = text.replace("axes: {", history + axis).replace(
        "observers: {", "observers: {trajectory: , "
    )
    (figure,) = load(tmp_path, "harmonic", text=drawn).about()["figures"]
    assert figure[2] == "C; gap 0.02 m; forcing frequency 3.5 Hz"
    cube = run(study)
    assert cube.forcing_frequency.values.tolist() == [3.0, 3.5, 4.0]
    assert cube.forcing_frequency.attrs["units"] == "Hz"
    point = cube.damper.run(gap="2 cm", forcing_frequency="210 rpm").parameters
    assert point.forcing_frequency == pytest.approx(2.0 * np.pi * 3.5)
    shown = cube.damper.curves("forcing_frequency", ["rms_ratio"], at={"gap": "4 cm"})
    assert "40 mm" in shown.get_suptitle()
    # What a cube says and what it computes from it.
    again = cube.damper.run(forcing_frequency=3.5, gap=0.02)
    np.testing.assert_allclose(again.parameters.forcing_frequency, 2.0 * np.pi * 3.5, rtol=1e-15)
    here = cube.sel(forcing_frequency=3.5, gap=0.02)
    assert damper_at(here)[0].frequency_ratio == again.parameters.dimensionless.frequency_ratio
    (ax,) = cube.damper.curves("forcing_frequency", ["rms_displacement"], lines="gap").axes
    assert ax.get_xlabel().replace("\xa0", " ") == "forcing frequency $\\Omega/2\\pi$ / Hz"
    assert ax.get_xlim() == (3.0, 4.0)
    heading = cube.damper.curves(
        "gap", ["rms_displacement"], at={"forcing_frequency": 3.5}
    ).get_suptitle()
    assert "$\\Omega/2\\pi$ = 3.5 Hz" in heading.replace("\n", " ")
    drawn = "draws: {count: 3, seed: 1, forcing_frequency: {range: [3, 4], unit: Hz}}\naxes: {"
    study = load(tmp_path, "harmonic", text=text.replace("axes: {", drawn))
    rule = {"range": (2.0 * np.pi * 3.0, 2.0 * np.pi * 4.0), "spacing": "linear"}
    assert study.draw_settings() == {"count": 3, "seed": 1, "forcing_frequency": rule}
    assert study.ends["forcing_frequency"] == rule["range"]
    assert study.values["forcing_frequency"] == "at random: 3 to 4 Hz"
    cube = run(study)
    np.testing.assert_allclose(
        cube.forcing_frequency,
        np.divide(branches.draw(study.draw_settings())["forcing_frequency"], 2.0 * np.pi),
        rtol=1e-14,
    )
    for wrong, message in (
        (
            "restitution: {value: 0.6, unit: Hz}",
            "parameters.restitution.unit\n    'restitution' has",
        ),
        ("restitution: {value: 0.6, unit: rpm}", "(value: 'rpm')\n    allowed: Hz"),
    ):
        assert message in blame(tmp_path, "none", "", STUDY.replace("restitution: 0.6", wrong))


def test_a_frequency_that_is_no_number_may_be_in_rad_per_second_or_hertz(tmp_path: Path) -> None:
    given = SI_POINT | {"force_amplitude": 1.0, "forcing_frequency": "fast"}
    text = SI_STUDY.replace("{}", ", ".join(f"{name}: {value}" for name, value in given.items()))
    said = blame(tmp_path, "harmonic", "", text)
    assert "allowed: number in rad/s, or with its unit, as 12 Hz, forcing_frequency > 0" in said


def si_study(**given: Any) -> str:
    values = SI_POINT | {"force_amplitude": 1.0} | given
    return SI_STUDY.replace("{}", ", ".join(f"{name}: {value}" for name, value in values.items()))


def test_what_presses_a_mass_that_does_not_rub_is_refused(tmp_path: Path) -> None:
    said = blame(tmp_path, "harmonic", "", si_study(transverse_acceleration=9.81))
    assert "'transverse_acceleration' has no effect without friction_coefficient" in said
    load(tmp_path, "harmonic", text=si_study(transverse_acceleration=9.81, friction_coefficient=0))


def test_values_with_units(tmp_path: Path) -> None:
    text = si_study(primary_mass="2000 g", forcing_frequency="210 rpm", initial_velocity="3 mm/s")
    text = text.replace("[0.02, 0.04]", "[20 mm, 4 cm]")
    SCHEMA.validate(yaml.safe_load(text))
    study = load(tmp_path, "harmonic", text=text)
    expected = SI_POINT | {"forcing_frequency": 2.0 * np.pi * 3.5, "initial_velocity": 0.003}
    assert study.fixed == study.fixed | expected
    assert study.axis_values["gap"] == (0.02, 0.04)
    assert study.values["forcing_frequency"] == "3.5 Hz"
    assert study.to_yaml() == load(tmp_path, "harmonic", text=study.to_yaml()).to_yaml()
    figures = """\
figures:
  a: {kind: curves, variables: [rms_ratio], along: gap, at: {forcing_frequency: 240 rpm}}
  b: {kind: curves, variables: [rms_ratio], along: forcing_frequency, at: {gap: 4 cm}}
"""
    two = text.replace("forcing_frequency: 210 rpm, ", "").replace("forcing_frequency: 210 rpm", "")
    two = two.replace("axes: {", "axes: {forcing_frequency: {values: [3.5 Hz, 4 Hz]}, ") + figures
    SCHEMA.validate(yaml.safe_load(two))
    made = load(tmp_path, "harmonic", text=two).figures
    assert [made[name].at for name in "ab"] == [{"forcing_frequency": 4.0}, {"gap": 0.04}]
    axis = text.replace("values: [20 mm, 4 cm]", "start: 1 cm, stop: 40 mm, step: 10 mm")
    assert load(tmp_path, "harmonic", text=axis).axis_values["gap"] == (0.01, 0.02, 0.03, 0.04)


def test_the_unit_of_an_amplitude_is_that_of_the_force(tmp_path: Path) -> None:
    study = load(tmp_path, "base", text=si_study(force_amplitude="2 mm"))
    assert study.fixed["force_amplitude"] == 0.002
    record = "{kind: record, file: quake.csv, of: base_acceleration}"
    study = load(tmp_path, record, text=si_study(force_amplitude="0.5 g"))
    assert study.fixed["force_amplitude"] == 0.5 * 9.80665


@pytest.mark.parametrize("given", MISTAKES["forces"], ids=str)
def test_mistakes(tmp_path: Path, given: list[str]) -> None:
    said, *messages = given
    found = blame(tmp_path, said)
    for message in messages:
        assert message in found
    for jargon in ("pydantic", "Traceback", "Noise.", "Record.", "Harmonics."):
        assert jargon not in found


@pytest.mark.parametrize("given", MISTAKES["records"], ids=ascii)
def test_mistakes_in_a_record(tmp_path: Path, given: list[str]) -> None:
    text, message = given
    (tmp_path / "gaps.csv").write_bytes(text.encode(errors="surrogateescape"))
    found = blame(tmp_path, "{kind: record, file: gaps.csv}")
    assert "forces.yaml:8  forcing.file\n" in found
    assert message in found


ORBITS = "orbits: {a: {along: clearance, start: 1}}\n"


@pytest.mark.parametrize("given", MISTAKES["under a force"], ids=str)
def test_what_a_force_forbids(tmp_path: Path, given: list[str]) -> None:
    said, more, *messages = given
    found = blame(tmp_path, said, more)
    for message in messages:
        assert message in found


def test_orbits_under_a_force_that_repeats(tmp_path: Path) -> None:
    study = load(tmp_path, "base", ORBITS)
    entries = {name: {"settle": 60, **entry.model_dump()} for name, entry in study.orbits.items()}
    entries["a"]["max_orbits"] = 3
    followed = follow_orbits(
        entries, study.fixed, study.axis_values, 0.0, study.forcing_settings["forcing"]
    )
    p = damper.Parameters(**POINT, clearance=1.0, forcing="base")
    orbit = damper.periodic_orbit(p, settle=60)
    at = int(np.argmin(abs(followed.value.values - 1.0)))
    np.testing.assert_allclose(followed.displacement[at, 0], orbit.start[0], atol=1e-9)
