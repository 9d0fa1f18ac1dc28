"""One page with all verdicts, figures and tables; captions are in workflow/report."""

CAPTIONS = HOME / "workflow/report"


def report_if_complete():
    """The page."""
    return [f"{RESULTS}/report.html"] if COMPLETE else []


def _page_inputs(wildcards):
    made = [path for study in DEFAULT.values() for path in everything_of(study)]
    # What shows times is linked to, and no reason to write the page again.
    shown = (path for path in made if "/timed/" not in path)
    return [path for path in shown if path.endswith((".svg", ".png", ".csv", ".md"))]


def _page_kinds():
    return sorted(
        {product.kind for study in DEFAULT.values() for _, _, product in study.products()}
    )


rule report:
    input:
        _page_inputs,
        claims=claims_if_complete(),
        captions=[CAPTIONS / f"{kind}.rst" for kind in _page_kinds()],
        template=CAPTIONS / "page.html",
    output:
        f"{RESULTS}/report.html",
    log:
        "logs/report.log",
    benchmark:
        "logs/benchmarks/report/report.tsv"
    params:
        studies=[study.about() for study in DEFAULT.values()],
        kinds=_page_kinds(),
        code=code_digest(SCRIPTS / "report.py", ["damper.report.page"]),
    message:
        "Write the page with everything"
    script:
        "../scripts/report.py"
