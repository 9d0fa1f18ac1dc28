"""Studies of structures: what they read and refuse, and the cube that their jobs make."""

import json
from importlib import import_module

import numpy as np
import pytest
import yaml

import damper
from damper.parameters.structural import StructureParameters
from damper.parameters.structure import Structure
from damper.structures.structure import settings
from damper.study.check import main
from damper.study.config import ConfigError, load_study

MODES = [
    {"frequency": 1.0, "damping_ratio": 0.02, "shapes": {"tip": 1.0, "middle": 0.3}},
    {"frequency": 6.3, "damping_ratio": 0.02, "shapes": {"tip": -1.0, "middle": 0.7}},
]
STUDY = {
    "title": "A beam",
    "source": "a test",
    "kind": "structure",
    "structure": {"modes": MODES, "force": "middle"},
    "masses": [{"box": "tip", "free_mass": 0.1, "gap": "40 mm", "restitution": 0.6}],
    "parameters": {"force_amplitude": 2.0, "forcing_frequency": "1 Hz"},
    "axes": {
        "mode_2_frequency": {"values": ["6.3 Hz", "300 rpm"]},
        "gap_0": {"values": ["4 cm", "9 m"]},
    },
    "transient": 2,
    "periods": 2,
    "samples": 16,
    "history": 2,
    "figures": {
        "energy": {"kind": "lines", "variables": ["mode_energy"], "along": "instant"}
        | {"lines": "mode", "panels": "gap_0", "at": {"mode_2_frequency": "300 rpm"}, "log": True},
        "peak": {"kind": "lines", "variables": ["peak_displacement"], "along": "gap_0"}
        | {"lines": "point", "at": {"mode_2_frequency": 5.0}},
    },
    "tables": {"peaks": {"kind": "values", "variables": ["peak_displacement", "input_power"]}},
}


def study_of(folder, **changed):
    path = folder / "beam.yaml"
    path.write_text(yaml.safe_dump(STUDY | changed, sort_keys=False), "utf-8")
    return load_study(path)


def done(job, *parts):
    """What a job returns, whose settings went through JSON."""
    module, settings = import_module(job.module), json.loads(json.dumps(job.settings))
    return module.gather(parts, **settings) if parts else module.run_part((), **settings)


@pytest.fixture(scope="module")
def cube(tmp_path_factory):
    study = study_of(tmp_path_factory.mktemp("study"))
    parts = [done(job) for job in study.parts({"accuracy": 1e-12}).values()]
    return done(study.gathered({})["cube.nc"], *parts)


def test_the_cube_has_the_motion_of_each_point(cube):
    """As a run by itself has it; in a gap of 9 m there are no impacts."""
    modes = Structure.from_modes(
        [1.0, 5.0], 0.02, {"tip": [1, -1], "middle": [0.3, 0.7], "force": "middle"}
    )
    p = damper.SIParameters(
        structure=modes,
        force_amplitude=2.0,
        forcing_frequency="1 Hz",
        masses=[{"box": "tip", "free_mass": 0.1, "gap": 0.04, "restitution": 0.6}],
    )
    run = damper.start(p)
    run.advance(4.0)
    moved = run.motion(np.linspace(2.0, 4.0, 33))
    there = cube.sel(mode_2_frequency=5.0, gap_0=0.04)
    assert np.allclose(there.displacement, moved.displacement, rtol=1e-9, atol=1e-12)
    assert np.allclose(there.mode_energy, moved.mode_energy, rtol=1e-9, atol=1e-12)
    assert np.allclose(there.peak_displacement, abs(moved.displacement).max("time"), rtol=0.05)
    hits = run.events["kind"] == damper.IMPACT
    later = run.events["time"] > 2.0
    assert there.power_residual.item() == pytest.approx(0.0, abs=1e-12)
    assert there.impacts_per_cycle.item() == (hits & later).sum() / 2
    assert cube.sel(gap_0=9.0).impacts_per_cycle.values.tolist() == [[0.0], [0.0]]
    assert cube.gap_0.units == "m"
    assert cube.mode_2_frequency.units == "Hz"


def test_any_number_of_jobs_makes_the_same_cube(cube, tmp_path, monkeypatch):
    monkeypatch.setattr(settings, "_WORK_OF_A_JOB", 1)
    study = study_of(tmp_path)
    parts = [done(job) for job in study.parts({"accuracy": 1e-12}).values()]
    assert len(parts) == 2
    assert done(study.gathered({})["cube.nc"], *parts).identical(cube)


def test_jobs_that_take_long_have_their_code_compiled_before(tmp_path):
    """For each kind of force, a weight and friction; tables need other code."""
    (mass,) = STUDY["masses"]
    rubs = {"masses": [mass | {"friction_coefficient": 0.1}]}
    rubs["parameters"] = STUDY["parameters"] | {"transverse_acceleration": 9.81}
    falls = {"masses": [mass | {"gravity": 9.81}], "forcing": {"kind": "harmonics", "orders": [1]}}
    falls["forcing"]["amplitudes"] = [1.0]
    for changed, wanted in (
        ({"periods": 100}, ()),
        ({}, ("engine",)),
        (rubs, ("engine_friction",)),
        (falls, ("engine_harmonics_weight",)),
    ):
        study = study_of(tmp_path, **{"periods": 1000} | changed)
        assert {job.compiled for job in study.parts({}).values()} == {wanted}


def test_figures_and_tables(cube, tmp_path):
    study = study_of(tmp_path)
    for made in study.figures.values():
        figure = study.figure_kinds.module(made.kind).draw({"cube": cube}, made)
        lines = [len(ax.lines) for ax in figure.axes]
        assert lines == ([2, 2] if made.panels else [2])
        if made.panels:
            assert [ax.get_title() for ax in figure.axes] == ["gap: 40 mm", "gap: 9 m"]
        head = figure.get_suptitle().replace("\n", " ")
        fixed = "restitution: 0.6, force amplitude: 2 N, forcing frequency: 1 Hz"
        assert f"mode 2 frequency: 5 Hz, free mass: 0.1 kg, {fixed}" in head
    table = study.table_kinds.module("values").make({"cube": cube}, study.tables["peaks"])
    assert len(table.data) == 4
    assert table.data[["peak_displacement, point tip", "input_power"]].notna().all(axis=None)
    words, cells = table.body
    assert words == f"Fixed: free mass: 0.1 kg, {fixed}."
    assert [*cells.columns] == [
        "mode 2 frequency, Hz",
        "gap 0, m",
        "peak displacement, point tip, m",
        "peak displacement, point middle, m",
        "input power, W",
    ]


def test_observers_and_a_start_are_those_of_a_run(tmp_path):
    """And a section is drawn in dots over an axis."""
    section = {"kind": "lines", "variables": ["free_displacement"], "along": "gap_0"}
    study = study_of(
        tmp_path,
        axes={"gap_0": {"values": [0.04, 0.05]}},
        start={"displacement": ["3 cm", 0.0], "position": [0.5], "relative_velocity": [0.1]},
        observers={"stroboscopic_section": {"free_mass": True}, "bursts": None},
        transient=0,
        history=0,
        figures={"section": section | {"lines": "body"}},
        tables={},
    )
    parts = [done(job) for job in study.parts({"accuracy": 1e-12}).values()]
    cube = done(study.gathered({})["cube.nc"], *parts)
    start = damper.State([0.03, 0.0], [0.0, 0.0], 0.03 + 0.5 * 0.025, 0.1)
    p = study.damper.having({"gap_0": 0.05})
    motion = damper.run(p, 2.0, start, samples_per_period=1).motion
    there = cube.sel(gap_0=0.05, body=0)
    assert there.displacement.values == pytest.approx(motion.displacement.sel(point="tip")[:2])
    assert there.free_displacement.values == pytest.approx(motion.free_displacement.values[:2, 0])
    assert cube.bursts_per_period.dims == ("gap_0", "body")
    figure = study.figure_kinds.module("lines").draw({"cube": cube}, study.figures["section"])
    dots = figure.axes[0].lines
    assert [len(line.get_xdata()) for line in dots] == [2, 2]
    assert {line.get_linestyle() for line in dots} == {"None"}
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["mass 0"]


def test_a_record_is_named_by_the_check_and_in_headings(tmp_path, capsys):
    (tmp_path / "quake.csv").write_text("time (s),east (g)\n0,0\n1,0.1\n2.5,0\n")
    modes = [mode | {"shapes": mode["shapes"] | {"base": 1.0}} for mode in MODES]
    study = study_of(
        tmp_path,
        structure={"modes": modes},
        parameters={"force_amplitude": "1 m/s2"},
        forcing={"kind": "record", "file": "quake.csv", "of": "base_acceleration"},
        figures={"peak": STUDY["figures"]["peak"]},
        transient=0,
    )
    assert main([str(tmp_path / "beam.yaml")]) == 0
    said = capsys.readouterr().out
    assert "beam     yes       1       4     4 " in said
    assert "the file of its record has east in g" in said
    assert "runs end at 2 (0 + 2 cycles), before their record does, at 2.5" in said
    parts = [done(job) for job in study.parts({"accuracy": 1e-12}).values()]
    cube = done(study.gathered({"accuracy": 1e-12})["cube.nc"], *parts)
    assert (cube.transient_periods, cube.recorded_periods, cube.accuracy) == (0, 2, 1e-12)
    words = "record of base acceleration, 3 samples, file quake.csv"
    figure = study.figure_kinds.module("lines").draw({"cube": cube}, study.figures["peak"])
    assert words in figure.get_suptitle().replace("\n", " ")
    table = study.table_kinds.module("values").make({"cube": cube}, study.tables["peaks"])
    assert table.body[0].endswith(f"force amplitude: 1 m/s², forcing: {words}.")


@pytest.mark.parametrize("transient", [0, 2])
def test_a_run_that_stops_early_is_missing_and_takes_no_other_with_it(tmp_path, transient):
    """Within its window, or before that."""
    study = study_of(
        tmp_path, transient=transient, axes={"gap_0": STUDY["axes"]["gap_0"]}, figures={}
    )
    parts = [done(job) for job in study.parts({"max_events": 3}).values()]
    cube = done(study.gathered({})["cube.nc"], *parts)
    assert cube.status.values.tolist() == [1, 0]
    assert (cube.runs, cube.runs_stopped_early) == (2, 1)
    for name in ("displacement", "mode_energy", "power_residual", "peak_displacement"):
        missing = np.isnan(cube[name])
        assert missing.isel(gap_0=0).all()
        assert not missing.isel(gap_0=1).any()


def test_a_value_for_all_stands_where_a_mass_takes_it(tmp_path):
    masses = [STUDY["masses"][0], {"box": "middle", "free_mass": 0.1, "restitution": 0.6}]
    axes = {"mode_2_damping_ratio": {"values": ["1 %", "2 %"]}}
    given = {"gap": "10 mm", **STUDY["parameters"]}
    made = study_of(tmp_path, masses=masses, axes=axes, parameters=given, figures={})
    assert made.axes["mode_2_damping_ratio"].points == (0.01, 0.02)
    gaps = {name: value for name, (value, *_) in made.fixed.items() if "gap" in name}
    assert gaps == {"gap_0": 0.04, "gap_1": 0.01}


def test_words_name_the_box_of_a_mass():
    """Where there are several, and the mass as well where they share a box."""
    modes = Structure.from_modes([1.0], 0.02, {"tip": [1], "middle": [0.3], "force": "middle"})
    one = {"free_mass": 0.1, "gap": 0.04, "restitution": 0.6}
    masses = [one | {"box": box} for box in ("tip", "middle", "tip")]
    p = damper.SIParameters(structure=modes, forcing="none", masses=masses)
    assert p.words_of("gap_1") == "gap in middle"
    assert p.words_of("free_mass_2") == "free mass of mass 2 in tip"
    assert p.words_of("mode_1_frequency") == "mode 1 frequency"
    assert p.having({"masses": masses[:1]}).words_of("gap_0") == "gap"


def test_a_structure_is_read_from_files_beside_the_study(tmp_path):
    (tmp_path / "beam.csv").write_text(
        "frequency,damping_ratio,tip,middle\n1,0.02,1,0.3\n6.3,0.02,-1,0.7\n"
    )
    by_file = study_of(tmp_path, structure={"modes": "beam.csv", "force": "middle"})
    assert by_file.damper == study_of(tmp_path).damper
    assert by_file.force_files == {"modes": str(tmp_path / "beam.csv")}
    np.savez(tmp_path / "m.npz", M=np.eye(2), K=[[2.0, -1.0], [-1.0, 1.0]])
    found = {"matrices": "m.npz", "boxes": {"tip": 1}, "force": 0}
    made = study_of(tmp_path, structure=found, axes={}, figures={}, tables={}).damper.structure
    assert made == Structure(np.eye(2), None, [[2, -1], [-1, 1]], boxes={"tip": 1}, force=0)
    np.save(tmp_path / "mass.npy", np.eye(2))
    found["matrices"] = {"mass": "mass.npy", "stiffness": [[2, -1], [-1, 1]]}
    rows = study_of(tmp_path, structure=found, axes={}, figures={}, tables={})
    assert rows.damper.structure == made
    assert rows.force_files == {"mass": str(tmp_path / "mass.npy")}


def test_settings_in_plain_values_make_the_same_parameters(tmp_path):
    settings = json.loads(json.dumps(study_of(tmp_path).damper.settings))
    made = StructureParameters(
        structure=Structure.of_settings(settings["structure"]), **settings["parameters"]
    )
    assert made == study_of(tmp_path).damper


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"structure": {}}, "given by one of two.*modes or matrices"),
        ({"structure": {"modes": "none.csv"}}, "none.csv"),
        ({"structure": {"modes": MODES, "boxes": {"tip": 1}}}, "boxes goes with matrices"),
        ({"structure": {"matrices": {"mass": [[1, "a"]]}}}, r"matrices.mass.*not allowed"),
        (
            {
                "structure": {
                    "matrices": {"mass": [[1, 0]], "stiffness": [[1]]},
                    "boxes": {"tip": 0},
                }
            },
            r"matrices: mass has the shape \(1, 2\): must be square",
        ),
        ({"masses": [{"box": "tpi"}]}, r"masses\[0\].box 'tpi' \(did you mean 'tip'\?\)"),
        ({"axes": STUDY["axes"] | {"gap_1": {"values": [1.0]}}}, "is of mass 1, and masses has 1"),
        ({"axes": {"gap_0": {"values": [1.0, -1.0]}}}, "gap = -1.0"),
        ({"axes": {"gap_0": {"start": 1.0}}}, "stop is missing.*values; or start and"),
        ({"axes": {"gap_0": {"values": ["2 kg"]}}}, "has the unit 'kg'.*a number in m, "),
        ({"axes": {"gap_0": {"values": [1.0], "unit": "Hz"}}}, "gap_0 is not in Hz here"),
        ({"axes": {}}, "'gap_0' is no dimension of the cube"),
        ({"history": 3}, "the window has 2 cycles"),
        (
            {"axes": STUDY["axes"] | {"mode_3_frequency": {"values": [1.0, 2.0]}}},
            r"axes.mode_3_frequency\n.*\(did you mean 'mode_[12]_frequency'\?\)",
        ),
        (
            {"axes": STUDY["axes"] | {"inclination": {"values": [0.0, 90.0]}}},
            "axes.inclination\n    'inclination' has no effect without gravity",
        ),
        (
            {
                "figures": {
                    "a": STUDY["figures"]["peak"] | {"lines": "gap_0", "at": {"point": "tip"}}
                }
            },
            "the figure shows 'gap_0' twice",
        ),
        (
            {"figures": {"a": STUDY["figures"]["energy"] | {"at": {"point": "tip"}}}},
            "mode_energy has no values along 'point'",
        ),
        (
            {
                "forcing": {
                    "kind": "noise",
                    "seed": "draw",
                    "step": 0.1,
                    "duration": 90,
                    "band": [0, 2],
                }
            },
            "forcing.seed\n    runs on a structure have no draws",
        ),
        (
            {"observers": {"chatter_bursts": {"since": [0, 2]}}},
            r"yaml:\d+ .*chatter_bursts\n.*since = 2.0: begins after the window of 2 cycles",
        ),
        (
            {"observers": {"trajectory": {"length": 3}}, "history": 0, "figures": {}},
            "after the start of the window, which is 2 cycles long",
        ),
        ({"observers": {"decay": None}}, "observers.decay.*a force drives the damper"),
        ({"observers": {"impacts": None}}, "impacts does not know boxes on a structure"),
        (
            {"observers": {"stroboscopic_section": None, "impact_section": None}},
            "both write 'displacement'",
        ),
        ({"observers": {"trajectory": None}}, "history of a run has variables or dimensions"),
        ({"observers": {"burst": None}}, r"'burst' \(did you mean 'bursts'\?\)|unknown observer"),
        ({"start": {"displacement": [0.1]}}, "displacement has 1 values: must be 2"),
        ({"start": {"position": [2.0]}}, "position"),
        ({"start": {"velocity": ["2 kg", 0]}}, "has the unit 'kg'"),
        ({"history": 0}, "'mode_energy' is not in the cube"),
        ({"structure": {"modes": "no.csv"}}, r"structure\n    .*no.csv: there is no such file"),
        (
            {"tables": {"all": {"kind": "values", "variables": ["status", "displacement"]}}},
            r"tables.all.variables\[1\].*'displacement' has a value at each instant",
        ),
    ],
)
def test_mistakes_in_a_study(tmp_path, changed, message):
    with pytest.raises(ConfigError, match=f"(?s){message}"):
        study_of(tmp_path, **changed)
