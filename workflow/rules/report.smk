"""One page with all verdicts, figures and tables; captions are in workflow/report."""

from damper.report.documents import tables_of
from damper.report.page import SCRIPTS as PAGE_SCRIPTS
from damper.report.page import too_large

CAPTIONS = HOME / "workflow/report"


# What draws the interactive figures; without any, the page does without.
PLOTLY = [f"{RESULTS}/plotly.js"] if DEFAULT_INTERACTIVE else []


def report_if_complete():
    """The page."""
    return [f"{RESULTS}/report.html"] if COMPLETE else []


# The page and what belongs to it.
PAGE_FILES = [
    f"{RESULTS}/report.html",
    *PLOTLY,
    *(f"{RESULTS}/{n}.js" for n in DEFAULT_INTERACTIVE),
]


def report_too_large():
    """Say what makes the page too large to share."""
    text = too_large(map(Path, PAGE_FILES))
    if text:
        print(text, file=sys.stderr)


def _page_kinds():
    return sorted(
        {product.kind for study in DEFAULT.values() for _, _, product in study.products()}
    )


def _page_texts():
    """Template, script and captions of the page: by content, for their times mean nothing."""
    paths = (
        CAPTIONS / name
        for name in ("page.html", *PAGE_SCRIPTS, *map("{}.rst".format, _page_kinds()))
    )
    return [path for path in paths if path.is_file()]


def _page_inputs(wildcards):
    """Figures and tables of the page. What shows times is linked to: no reason to write it again."""
    made = [path for study in DEFAULT.values() for path in everything_of(study)]
    shown = (path for path in made if "timed" not in path.split("/"))
    return [path for path in shown if path.endswith((".nc", ".svg", ".png", ".csv", ".md"))]


def report_settings():
    return {
        "studies": [study.about() for study in DEFAULT.values()],
        "kinds": _page_kinds(),
        "code": digest("report.py", "damper.report.page"),
        "texts": {path.name: code_digest(path) for path in _page_texts()},
        "interactive": [
            MADE.fingerprint_of(f"{RESULTS}/{name}.js") for name in DEFAULT_INTERACTIVE
        ],
        "claims": MADE.fingerprint_of(f"{RESULTS}/claims.md") if COMPLETE else "",
        "shown": [
            MADE.fingerprint_of(f"{RESULTS}/{name}.{end}")
            for end, made in (("svg", FIGURES), ("md", TABLES))
            for name, (study, *_) in made.items()
            if study.name in DEFAULT and "timed" not in name.split("/")
        ],
    }


MADE |= dict.fromkeys([f"{RESULTS}/report.html", *PLOTLY], report_settings)


rule report:
    input:
        _page_inputs,
        claims=claims_if_complete(),
        interactive=[f"{RESULTS}/{name}.js" for name in DEFAULT_INTERACTIVE],
        rerun=rerun_if_changed(f"{RESULTS}/report.html", *PLOTLY),
    output:
        [f"{RESULTS}/report.html", *PLOTLY],
    log:
        f"{LOGS}/report.log",
    benchmark:
        f"{TIMES}/report/report.tsv"
    params:
        job=job,
        captions=CAPTIONS,
    message:
        "Write the page with everything"
    script:
        "../scripts/report.py"


# Records that drive dampers of the default run: beside their cubes, and as they are.
RECORDS = {
    f"{RESULTS}/{name}/{Path(path).name}": path
    for name, study in DEFAULT.items()
    for path in getattr(study, "force_files", {}).values()
}


rule crate:
    input:
        [everything_of(study) for study in DEFAULT.values()],
        claims_if_complete(),
        PAGE_FILES if COMPLETE else [],
    output:
        f"{RESULTS}/ro-crate-metadata.json",
        [f"{RESULTS}/{name}/study.yaml" for name in DEFAULT],
    log:
        f"{LOGS}/crate.log",
    benchmark:
        f"{TIMES}/crate/crate.tsv"
    params:
        studies=lambda wildcards: [study.about() for study in DEFAULT.values()],
        # Neither input nor output: their names may look like wildcards.
        records=lambda wildcards: RECORDS,
    message:
        "Describe the results as an RO-Crate"
    script:
        "../scripts/crate.py"


# Documents whose tables a run makes again to the letter; those of solvers.md are times.
DOCUMENTS = [
    HOME / f"docs/{name}.md" for name in ("calibration", "findings", "limits", "papers", "theory")
]


def _tables_shown(wildcards):
    texts = [path.read_text(encoding="utf-8") for path in DOCUMENTS]
    return sorted({f"{RESULTS}/{at.partition('#')[0]}" for text in texts for at in tables_of(text)})


rule documents:
    input:
        _tables_shown,
    log:
        f"{LOGS}/documents.log",
    params:
        python=sys.executable,
        results=RESULTS,
        documents=DOCUMENTS,
    message:
        "Compare the documents' tables with the results"
    shell:
        "{params.python:q} -m damper.report.documents --check {params.results:q} {params.documents:q} "
        "2>&1 | tee {log:q}"


rule others:
    log:
        f"{LOGS}/others.log",
    params:
        python=sys.executable,
        script=HOME / "benchmarks/others.py",
        results=RESULTS,
        document=HOME / "docs/others.md",
    message:
        "Compare the cases of other people with their document"
    shell:
        "{params.python:q} {params.script:q} > {params.results:q}/others.md && "
        "{params.python:q} -m damper.report.documents --check {params.results:q} {params.document:q} "
        "2>&1 | tee {log:q}"
