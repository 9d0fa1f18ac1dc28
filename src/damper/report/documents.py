"""Tables of results in documents, taken over from the files that a run has made.

``python -m damper.report.documents results docs/*.md`` replaces what stands between the lines

    <!-- table: stress/tables/summary.md -->
    <!-- /table -->

by the first table in that file of the folder of results, or by the first one below a heading:
``claims.md#B1``.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

_BLOCK = re.compile(r"<!-- table: (\S+) -->\n(.*?)<!-- /table -->", re.DOTALL)


def tables_of(document: str) -> dict[str, str]:
    """Return the tables in a document: path below the results -> text.

    Examples
    --------
    >>> tables_of("Numbers:\\n<!-- table: a/tables/b.md -->\\n| x |\\n<!-- /table -->\\n")
    {'a/tables/b.md': '| x |\\n'}
    """
    return dict(_BLOCK.findall(document))


def table_in(text: str, heading: str = "") -> str:
    """Return the lines of the first Markdown table in a text, below the heading that begins so.

    Raises
    ------
    ValueError
        When there is none.

    Examples
    --------
    >>> table_in("# Title\\n\\n| x |\\n|---|\\n| 1 |\\n\\nRemark.\\n", "Title")
    '| x |\\n|---|\\n| 1 |\\n'
    """
    if heading:
        text = re.split(rf"^#+ {re.escape(heading)}\b", text, maxsplit=1, flags=re.MULTILINE)[-1]
    found = re.search(r"^\|.*(?:\n\|.*)*", text, re.MULTILINE)
    if found is None:
        raise ValueError("no table")
    return f"{found[0]}\n"


def renewed(document: str, results: Path) -> str:
    """Return a document with its tables as they are in the folder of results.

    Raises
    ------
    OSError
        When a table has not been made.
    ValueError
        When a file has no table.
    """

    def renew(block: re.Match[str]) -> str:
        path, _, heading = block[1].partition("#")
        table = table_in((results / path).read_text(encoding="utf-8"), heading)
        return f"<!-- table: {block[1]} -->\n{table}<!-- /table -->"

    return _BLOCK.sub(renew, document)


def main(arguments: list[str] | None = None) -> int:
    """Renew the tables of documents; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("results", type=Path, help="folder of results")
    parser.add_argument("documents", type=Path, nargs="+", help="Markdown files")
    given = parser.parse_args(arguments)
    for path in given.documents:
        before = path.read_text(encoding="utf-8")
        try:
            after = renewed(before, given.results)
        except (OSError, ValueError) as error:
            print(f"{path}: {error}; make the results first", file=sys.stderr)
            return 1
        if after != before:
            path.write_text(after, encoding="utf-8", newline="\n")
            print(f"renewed: {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
