"""Tables of results in documents."""

import shutil
from pathlib import Path

import pytest
from project_copy import copy_project, snakemake

from damper.report.documents import main, tables_of
from damper.study.config import load_config
from damper.study.yaml_file import read_yaml

ROOT = Path(__file__).parents[2]
DOCUMENT = "Before.\n\n<!-- table: one/tables/t.md#Words: m -->\nold\n<!-- /table -->\n\nAfter.\n"


def test_tables_are_renewed(tmp_path, capsys):
    document = tmp_path / "page.md"
    document.write_text(DOCUMENT)
    assert main([str(tmp_path), str(document)]) == 1
    assert "t.md" in capsys.readouterr().err
    assert document.read_text() == DOCUMENT
    made = tmp_path / "one/tables/t.md"
    made.parent.mkdir(parents=True)
    made.write_text("# T\n\n| c |\n\n## Words: m\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\nMore.\n")
    assert main([str(tmp_path), str(document)]) == 0
    assert document.read_text() == DOCUMENT.replace("old\n", "| a | b |\n|---|---|\n| 1 | 2 |\n")
    assert main([str(tmp_path), str(document)]) == 0
    assert capsys.readouterr().out.count("renewed: ") == 1
    made.write_text("# T\n")
    assert main([str(tmp_path), str(document)]) == 1


def test_check_names_file_and_line_of_a_wrong_number(tmp_path, capsys):
    document, made = tmp_path / "page.md", tmp_path / "one/tables/t.md"
    made.parent.mkdir(parents=True)
    made.write_text("# T\n\n## Words: m\n\n| a |\n|---|\n| 1.5 |\n")
    document.write_text(DOCUMENT.replace("old\n", "| a |\n|---|\n| 1.4 |\n"))
    before = document.read_text()
    check = ["--check", str(tmp_path), str(document)]
    assert main(check) == 1
    assert capsys.readouterr().err == f"{document}:6: | 1.4 |\n  in the results: | 1.5 |\n"
    assert document.read_text() == before
    document.write_text(before.replace("1.4", "1.5"))
    assert main(check) == 0


@pytest.mark.exhaustive
def test_tables_in_documents_are_those_of_a_run(tmp_path):
    """The studies behind them are made anew, which takes some minutes."""
    folder = copy_project(tmp_path)
    for name in ("docs", "benchmarks"):
        shutil.copytree(ROOT / name, folder / name)
    snakemake(folder, "documents", "others")


def test_documents_show_tables_that_the_default_run_makes():
    config = load_config(read_yaml(ROOT / "config/config.yaml", "config").data, ROOT)
    made = {
        f"{about}.md" for study in config.studies.values() for about, _ in study.about()["tables"]
    }
    made |= {"claims.md", "others.md"}
    for path in sorted((ROOT / "docs").glob("*.md")):
        for table, text in tables_of(path.read_text(encoding="utf-8")).items():
            assert table.partition("#")[0] in made
            assert text.startswith("|"), f"renew {path.name}"
