"""Figures and tables of the studies that check the engine."""

from damper.verification import kinds


def _product(section, folder, wildcards):
    """A figure or table of such a study, and the settings of this file of it."""
    files = VERIFICATIONS[wildcards.study].files(section)
    return files["/".join([*filter(None, [folder]), section, wildcards.stem])]


def _reads(section, folder):
    """Input function: the files of the study that are shown."""
    return lambda wildcards: [
        f"{RESULTS}/{wildcards.study}/{path}"
        for path in _product(section, folder, wildcards)[0].reads
    ]


# What shows times lies beside them, in a folder of its own.
for folder in ("", "timed"):
    below = f"{RESULTS}/{{study}}/{folder}".rstrip("/")

    rule:
        name:
            f"{folder or 'verification'}_figure"
        input:
            _reads("figures", folder),
        output:
            svg=f"{below}/figures/{{stem}}.svg",
            png=f"{below}/figures/{{stem}}.png",
        log:
            f"logs/{{study}}/figures/{{stem}}.log",
        benchmark:
            f"logs/benchmarks/{{study}}/figures/{{stem}}.tsv"
        wildcard_constraints:
            study=one_of(VERIFICATIONS),
            stem=stems(VERIFICATIONS, f"{folder}/figures".lstrip("/")),
        params:
            settings=lambda wildcards, folder=folder: _product("figures", folder, wildcards)[1],
            code=lambda wildcards, folder=folder: code_digest(
                SCRIPTS / "verification_figure.py",
                [kinds.FIGURES.modules[_product("figures", folder, wildcards)[0].kind]],
            ),
        message:
            "Draw {wildcards.study}: {wildcards.stem}"
        script:
            "../scripts/verification_figure.py"

    rule:
        name:
            f"{folder or 'verification'}_table"
        input:
            _reads("tables", folder),
        output:
            csv=f"{below}/tables/{{stem}}.csv",
            md=f"{below}/tables/{{stem}}.md",
        log:
            f"logs/{{study}}/tables/{{stem}}.log",
        benchmark:
            f"logs/benchmarks/{{study}}/tables/{{stem}}.tsv"
        wildcard_constraints:
            study=one_of(VERIFICATIONS),
            stem=stems(VERIFICATIONS, f"{folder}/tables".lstrip("/")),
        params:
            settings=lambda wildcards, folder=folder: _product("tables", folder, wildcards)[1],
            code=lambda wildcards, folder=folder: code_digest(
                SCRIPTS / "verification_table.py",
                [kinds.TABLES.modules[_product("tables", folder, wildcards)[0].kind]],
            ),
        message:
            "Write {wildcards.study}: {wildcards.stem}"
        script:
            "../scripts/verification_table.py"
