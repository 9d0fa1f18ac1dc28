"""The page of results: everything on it, escaped, and the same each time."""

import fnmatch
import html.parser
from pathlib import Path

import pytest
from jinja2 import UndefinedError

import damper
from damper.report.page import SUBJECTS, Chapter, captions, chapter, page
from damper.report.stopped import stopped_lines
from damper.study.config import load_study
from damper.study.kinds import FIGURES, TABLES
from damper.sweep.cube import write_cube

ROOT = Path(__file__).parents[2]
CAPTIONS = ROOT / "workflow/report"
TEMPLATE = CAPTIONS / "page.html"
VERDICT = {
    "claim": "A1",
    "statement": "1 < 2",
    "stated": "no number",
    "found": "one & two",
    "numbers": "r | d\n0.5 | 1 < 2",
    "verdict": "true only if read as follows",
    "why": "if it rains",
    "assumptions": "d 0.05",
    "figures": "restitution/figures/paper_b_fig_2",
}


class Page(html.parser.HTMLParser):
    """Links, pictures, anchors and text of a page; fails on tags that do not close."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.images: list[dict[str, str | None]] = []
        self.names: list[str] = []
        self.open: list[str] = []
        self.lazy = True
        self.text = ""
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.links += [values["href"]] if "href" in values else []
        self.names += [values["id"]] if "id" in values else []
        self.images += [values] if values.get("alt") else []  # not thumbnails
        self.lazy &= tag != "img" or values.get("loading") == "lazy"
        if tag not in ("img", "meta", "br", "input"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("style", "script"):
            self.text += data


def made(tmp_path: Path, rows: int = 3) -> Page:
    study = load_study(ROOT / "config/studies/restitution.yaml")
    about = study.about()
    for path, _ in about["tables"]:
        file = tmp_path / f"{path}.md"
        file.parent.mkdir(parents=True, exist_ok=True)
        lines = ["| gap, F0/K | a<b |", "|---|---|", *(f"| {k} | <i> |" for k in range(rows))]
        file.write_text("\n".join(["# Title", "", *lines, "", "Remark."]))
    kinds = [kind for _, kind, *_ in (*about["figures"], *about["tables"])]
    how = captions(CAPTIONS, kinds)
    text = page([chapter(about, tmp_path)], [VERDICT], how, TEMPLATE)
    assert text == page([chapter(about, tmp_path)], [VERDICT], how, TEMPLATE)
    return Page(text)


def test_runs_that_stopped_early_are_counted(tmp_path: Path) -> None:
    assert " runs stopped early" not in made(tmp_path).text.replace("where runs", "")
    point = {"mass_ratio": 0.1, "damping_ratio": 0.02, "frequency_ratio": 1.3, "restitution": 0.4}
    run = {"transient": 10, "periods": 5, "max_events": 100, "observers": "impacts"}
    cube = damper.simulate(**point, clearance=[0.05, 50.0], **run)
    assert cube.attrs["runs_stopped_early"] == 1
    write_cube(cube, tmp_path / "restitution/cube.nc")
    assert "1 of 2 runs stopped early" in made(tmp_path).text
    assert stopped_lines(tmp_path, ["basins", "restitution"]) == [
        "restitution: 1 of 2 runs stopped early (`status` in the cube)"
    ]


def test_idle_runs_from_exact_rest_are_counted(tmp_path: Path) -> None:
    point = {"mass_ratio": 0.1, "damping_ratio": 0.02, "frequency_ratio": 1.3, "restitution": 0.4}
    run = {"transient": 1, "periods": 5, "observers": "impacts", "clearance": [0.05, 50.0]}
    made(tmp_path)
    for start, words in ((0.0, True), (1e-3, False)):
        cube = damper.simulate(**point, **run, initial_relative_velocity=start)
        write_cube(cube, tmp_path / "restitution/cube.nc")
        text = made(tmp_path).text
        assert ("1 of 2 runs never touch a wall: all runs start at exact rest" in text) == words


@pytest.mark.parametrize("kind", [*FIGURES, *TABLES])
def test_every_kind_has_a_caption_that_renders(kind: str) -> None:
    text = captions(CAPTIONS, [kind])[kind]({"variables": ["displacement", "peak_displacement"]})
    assert text.startswith("<p>")
    assert len(Page(text).text) > 40


def test_captions_in_error_are_refused(tmp_path: Path) -> None:
    (tmp_path / "map.rst").write_text("A `broken link_ and *emphasis")
    with pytest.raises(Exception, match="start-string without end-string"):
        captions(tmp_path, ["map"])["map"]({})


def test_page_shows_everything(tmp_path: Path) -> None:
    found = made(tmp_path)
    study = load_study(ROOT / "config/studies/restitution.yaml")
    paths = list(study.files("figures"))
    assert [image["src"] for image in found.images] == [f"restitution/{p}.png" for p in paths]
    assert found.lazy, "or the page waits for all its pictures"
    for path in paths:
        assert f"restitution/{path}.svg" in found.links
    for name in study.tables:
        assert f"restitution/tables/{name}.md" in found.links
    for text in (study.title, study.source, "gap, F0/K", "a<b", "<i>", "1 < 2", "one & two."):
        assert text in found.text
    assert "true only if read as follows: if it rains" in found.text
    assert "rd\n0.51 < 2" in found.text
    for reason in study.assumed.values():
        assert reason in found.text
    assert "0.03 of the burst's first approach speed" in found.text


def test_values_have_units() -> None:
    values = load_study(ROOT / "config/studies/machine_frame.yaml").values
    assert values["stiffness"] == "4e+06 N/m"
    assert values["gap"] == "0 to 0.0016 m, 41 values"
    values = load_study(ROOT / "config/studies/ball_on_table.yaml").values
    assert (values["mass_ratio"], values["clearance"]) == ("0", "0 F0/K")


@pytest.mark.parametrize(
    ("name", "shown"),
    [("chatter_map", True), ("paper_a_histories", True), ("earthquake", False), ("design", False)],
)
def test_threshold_of_visible_impacts_is_told_where_chatter_is_shown(
    name: str, shown: bool
) -> None:
    study = load_study(ROOT / f"config/studies/{name}.yaml")
    assert any(hasattr(observer, "threshold") for observer in study.observers.values())
    assert ("visibility_threshold" in study.values) is shown


def test_every_caption_stands_alone(tmp_path: Path) -> None:
    """What it shows, what to see in it, how to read it, and all values."""
    found = made(tmp_path)
    study = load_study(ROOT / "config/studies/restitution.yaml")
    kinds = [product.kind for product, _ in study.files("figures").values()]
    assert found.text.count("A ladder of approach speeds") == kinds.count("bifurcation") > 5
    # How to read it speaks only of what is there.
    assert "White dots mark" not in found.text
    # A drawing of the model has none.
    assert found.text.count("Values of the study: ") == len(found.images) - kinds.count("schematic")
    for figure in study.figures.values():
        assert getattr(figure, "see", None) is None or figure.see in found.text


def test_links_within_the_page_lead_somewhere(tmp_path: Path) -> None:
    found = made(tmp_path)
    inside = [link[1:] for link in found.links if link.startswith("#")]
    assert {"claims", "restitution", "restitution/figures/paper_b_fig_2", "claim-A1"} < set(inside)
    assert set(inside) <= set(found.names)


def test_every_study_of_the_project_has_a_subject() -> None:
    names = {path.stem for path in (ROOT / "config/studies").glob("*.yaml")} - {"template"}
    of = {name: Chapter(name, "", "", "").subject for name in names | {"mine"}}
    assert [name for name, subject in of.items() if subject == "Your studies"] == ["mine"]
    mine = load_study(ROOT / "config/studies/modes.yaml").about() | {"name": "mine", "tables": []}
    assert chapter(mine, ROOT).subject == "Your studies"
    for names_of in SUBJECTS.values():
        for pattern in names_of.split():
            assert fnmatch.filter(names, pattern), f"no study {pattern}"


def test_a_kind_without_caption_is_an_error(tmp_path: Path) -> None:
    about = load_study(ROOT / "config/studies/burst.yaml").about()
    with pytest.raises(UndefinedError):
        page([chapter(about, tmp_path)], [], {}, TEMPLATE)
