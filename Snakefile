"""Studies of impact dampers: config/studies/*.yaml -> cubes, figures and tables in results/."""

from snakemake.utils import min_version

min_version("9.17")


include: "workflow/rules/common.smk"
include: "workflow/rules/compile.smk"
include: "workflow/rules/parts.smk"
include: "workflow/rules/orbits.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/tables.smk"
include: "workflow/rules/interactive.smk"
include: "workflow/rules/verify.smk"
include: "workflow/rules/report.smk"


if VERIFY is not None:
    sys.exit(verify(VERIFY.split()))


# They take seconds: a cluster's queue is not asked.
localrules:
    claims,
    crate,
    documents,
    others,
    report,
    tidy,


rule all:
    default_target: True
    input:
        [everything_of(study) for study in DEFAULT.values()],
        claims_if_complete(),
        report_if_complete(),
    message:
        "Everything is made"


# Named targets outside of the default run, such as `snakemake --cores 2 calibration`.
for target, names in CONFIG.targets.items():

    rule:
        name:
            target
        input:
            [everything_of(CONFIG.studies[name]) for name in names],


# Not by itself: a file that no entry makes any more may still be wanted.
rule tidy:
    log:
        f"{LOGS}/tidy.log",
    message:
        "Remove figures and tables that no entry of their study makes any more"
    run:
        remove_left_over(log[0])


onstart:
    report_cache()


onsuccess:
    report_cost()
    report_stopped()
    report_too_large()
    report_left_over()


onerror:
    report_failed(log)
