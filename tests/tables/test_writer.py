"""What all tables share: the writer, the study's values, the kinds."""

import pandas as pd
import pytest
import xarray as xr

from damper.tables import Table, make


def test_files_have_all_digits_and_unix_line_ends(tmp_path) -> None:
    data = pd.DataFrame({"a": [0.1 + 0.2, float("nan")], "b": [1, 2], "c": [True, False]})
    cells = pd.DataFrame([["x", "R1 | L1"]], columns=["", ""])
    table = Table("T", data, ["Words.", cells, "## More", "- one\n- two"])
    table.save(tmp_path / "t.csv", tmp_path / "t.md")
    assert (tmp_path / "t.csv").read_bytes() == b"a,b,c\n0.30000000000000004,1,True\n,2,False\n"
    assert (tmp_path / "t.md").read_bytes() == (
        b"# T\n\nWords.\n\n|  |  |\n|---|---|\n| x | R1 \\| L1 |\n\n## More\n\n- one\n- two\n"
    )


def test_every_table_says_what_its_study_fixes_and_assumes() -> None:
    cube = xr.Dataset(
        {"x": ("clearance", [1.0, 2.0])},
        {
            "mass_ratio": ((), 0.1, {"assumed": "lost"}),
            "walls": ((), -1.0),
            "clearance": [0.1, 0.2],
        },
        {"title": "A study", "assumed_visibility_threshold": "ours"},
    )
    for name, value in {"chatter": [0, 0], "status": [0, 0]}.items():
        cube[name] = "clearance", value
    cube.attrs["observers"], cube.attrs["primary_starts"] = '{"bursts": {}}', "rest"
    cube.attrs |= {"transient_periods": 1, "recorded_periods": 1, "accuracy": 1e-9, "max_events": 9}
    cube.attrs["restitution_tables"] = '{"restitution_table": [[0.1, 0.9], [1, 0.7]]}'
    text = make("intervals", {"cube": cube}, along="clearance", resolution=0.1).markdown()
    title = "# A study: chatter intervals in clearance"
    assert text.startswith(
        f"{title}\n\nFixed: mass ratio 0.1, walls left, restitution table 0.9 to 0.7.\n\n"
    )
    assert text.endswith("\n- mass ratio: lost\n- visibility threshold: ours\n")


def test_unknown_kind_is_told_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match="did you mean 'performance'"):
        make("perfomance", {})
