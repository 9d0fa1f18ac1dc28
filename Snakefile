"""Studies of impact dampers: config/studies/*.yaml -> cubes, figures and tables in results/."""

from snakemake.utils import min_version

min_version("9.0")


configfile: "config/config.yaml"


include: "workflow/rules/common.smk"
include: "workflow/rules/simulate.smk"
include: "workflow/rules/gather.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/tables.smk"
include: "workflow/rules/verify.smk"
include: "workflow/rules/comparison.smk"
include: "workflow/rules/stress.smk"
include: "workflow/rules/cost.smk"
include: "workflow/rules/verification.smk"
include: "workflow/rules/report.smk"


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


onsuccess:
    report_cost()


onerror:
    print(
        "Some jobs failed. The reason of each stands above, and in its log below logs/. What is "
        "made stays: the same command goes on from there.",
        file=sys.stderr,
    )
