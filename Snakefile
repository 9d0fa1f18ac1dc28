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
include: "workflow/rules/report.smk"


rule all:
    default_target: True
    input:
        [everything_of(study) for study in STUDIES.values()],
        claims_if_complete(),
        report_if_complete(),
    message:
        "Everything is made"


onsuccess:
    tell_cost()
