"""Tables of results in documents."""

from pathlib import Path

import pytest

from damper.report.documents import main, tables_of
from damper.study.config import load_config
from damper.study.yaml_file import read_yaml

ROOT = Path(__file__).parents[2]
DOCUMENT = "Before.\n\n<!-- table: one/tables/t.md#Words -->\nold\n<!-- /table -->\n\nAfter.\n"


def test_tables_are_renewed(tmp_path, capsys):
    document = tmp_path / "page.md"
    document.write_text(DOCUMENT)
    assert main([str(tmp_path), str(document)]) == 1
    assert "t.md" in capsys.readouterr().err
    assert document.read_text() == DOCUMENT
    made = tmp_path / "one/tables/t.md"
    made.parent.mkdir(parents=True)
    made.write_text("# T\n\n| c |\n\n## Words: more\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\nMore.\n")
    assert main([str(tmp_path), str(document)]) == 0
    assert document.read_text() == DOCUMENT.replace("old\n", "| a | b |\n|---|---|\n| 1 | 2 |\n")
    assert main([str(tmp_path), str(document)]) == 0
    assert capsys.readouterr().out.count("renewed: ") == 1
    made.write_text("# T\n")
    assert main([str(tmp_path), str(document)]) == 1


@pytest.mark.parametrize("path", sorted((ROOT / "docs").glob("*.md")), ids=lambda path: path.stem)
def test_documents_show_tables_that_the_default_run_makes(path):
    shown = tables_of(path.read_text(encoding="utf-8"))
    config = load_config(read_yaml(ROOT / "config/config.yaml", "config").data, ROOT)
    made = {
        f"{about}.md" for study in config.studies.values() for about, _ in study.about()["tables"]
    }
    made.add("claims.md")
    for table, text in shown.items():
        assert table.partition("#")[0] in made
        assert text.startswith("|"), f"renew {path.name}"
