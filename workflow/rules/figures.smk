"""Figures, as SVG and PNG: a job draws all figures of a study that show the same files."""

from damper.figures import modules

FIGURES = products("figures")


def figure_settings(figure):
    study, product, settings = FIGURES[figure]
    drawn_by = type(product).__module__
    return {
        "settings": settings,
        "module": drawn_by,
        "code": digest("figure.py", *modules(drawn_by, settings)),
        "shown": [MADE.fingerprint_of(path) for path in shown(study, product).values()],
    }


for name in FIGURES:
    for end in SUFFIXES["figures"]:
        MADE[f"{RESULTS}/{name}.{end}"] = partial(figure_settings, name)


def memory_with_cube(study, wildcards=None):
    """Return the megabytes of a job that opens a cube; those of checks of the engine are small."""
    gathering = taken_by(study.name).gather_resources["mem_mb"] if study.name in STUDIES else 0
    return max(1000, 500 + gathering)


def figure_jobs(wildcards, output):
    """The settings of each figure of a job, by the path of its SVG."""
    return {path: MADE.settings_of(path) for path in output[::2]}


# (Folder, files that are shown) -> figures. What shows times lies in a folder of its own.
DRAWN_TOGETHER = {}
for name, (study, product, _) in FIGURES.items():
    key = (name.rpartition("/")[0], *shown(study, product).items())
    DRAWN_TOGETHER.setdefault(key, []).append(name)

# Starting a job takes as long as drawing a figure. Figures that are sound stay as they are: so they
# are updated, and not removed before.
for number, ((folder, *files), names) in enumerate(DRAWN_TOGETHER.items()):
    study = FIGURES[names[0]][0]

    rule:
        name:
            f"figure_{number}_of_{study.name}"
        input:
            **dict(files),
            rerun=rerun_if_changed(
                *(f"{RESULTS}/{n}.{end}" for n in names for end in ("svg", "png"))
            ),
        output:
            [
                path
                for n in names
                for path in (
                    report(
                        update(f"{RESULTS}/{n}.svg"),
                        category=study.name,
                        subcategory="figures",
                        labels={"figure": n.rpartition("/")[2]},
                    ),
                    update(f"{RESULTS}/{n}.png"),
                )
            ],
        log:
            f"{LOGS}/{names[0]}.log",
        benchmark:
            f"{TIMES}/{names[0]}.tsv"
        priority: 2 * int(study.name in JUDGED_BY)
        resources:
            mem_mb=partial(memory_with_cube, study),
        params:
            jobs=figure_jobs,
        message:
            f"Draw {folder}: {len(names)}"
        script:
            "../scripts/figure.py"
