"""Tables of results in documents, taken over from the files that a run has made.

``python -m damper.report.documents results docs/*.md`` replaces what stands between the lines

    <!-- table: stress/tables/summary.md -->
    <!-- /table -->

by the first table in that file of the folder of results, or by the first one below a heading:
``claims.md#B1``. With ``--check`` nothing is written: differences are named, and the exit status is
1.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path

_BLOCK = re.compile(r"<!-- table: (.+?) -->\n(.*?)<!-- /table -->", re.DOTALL)


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


def differences(before: str, after: str) -> Iterator[tuple[int, str, str]]:
    """Yield the lines of a document that differ from those of its renewed text.

    Of each table the first: its number in the document, the line, and what it is to be.

    Examples
    --------
    >>> text = "Text.\\n<!-- table: t.md -->\\n| 1 |\\n<!-- /table -->\\n"
    >>> list(differences(text, text.replace("1", "2")))
    [(3, '| 1 |', '| 2 |')]
    """
    for old, new in zip(_BLOCK.finditer(before), _BLOCK.finditer(after), strict=True):
        first = before.count("\n", 0, old.start(2)) + 1
        lines = zip_longest(old[2].splitlines(), new[2].splitlines(), fillvalue="nothing")
        for number, (shown, made) in enumerate(lines, first):
            if shown != made:
                yield number, shown, made
                break


def main(arguments: list[str] | None = None) -> int:
    """Renew or check the tables of documents; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("results", type=Path, help="folder of results")
    parser.add_argument("documents", type=Path, nargs="+", help="Markdown files")
    parser.add_argument("--check", action="store_true", help="write nothing, name differences")
    given = parser.parse_args(arguments)
    status = 0
    for path in given.documents:
        before = path.read_text(encoding="utf-8")
        try:
            after = renewed(before, given.results)
        except (OSError, ValueError) as error:
            reason = str(error)
            if isinstance(error, FileNotFoundError):
                reason = f"{error.filename}: there is no such file"
            print(f"{path}: {reason}; make the results first", file=sys.stderr)
            return 1
        if given.check:
            for line, shown, made in differences(before, after):
                print(f"{path}:{line}: {shown}\n  in the results: {made}", file=sys.stderr)
                status = 1
        elif after != before:
            path.write_text(after, encoding="utf-8", newline="\n")
            print(f"renewed: {path}")
    return status


if __name__ == "__main__":
    sys.exit(main())
