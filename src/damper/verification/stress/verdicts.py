"""The metamorphic relations: names, verdicts and limits. No engine is loaded."""

#: What is compared with the run as it is: name -> label.
RELATIONS = {
    "mirrored": "mirrored, half a period later",
    "shifted": "3 periods later",
    "shifted_far": "2^20 periods later",
    "units": "SI units and back",
    "sharper": "accuracy 1e-14",
    "looser": "accuracy 1e-10",
}
#: Verdicts on a run and relation.
NOT_APPLICABLE, PASSED, PASSED_BACKWARD, FAILED, PASSED_LAWS = -1, 0, 1, 2, 3
RELATION_VERDICTS = {
    NOT_APPLICABLE: "not applicable",
    PASSED: "passed",
    PASSED_BACKWARD: "passed by backward error",
    FAILED: "failed",
    PASSED_LAWS: "passed by the laws",
}

#: What a run is: how sharply roundoff leaves its events determined; see
#: `damper.verification.stress.condition`.
REFUSED, WELL, GROWING, GRAZING, BORDER = -1, 0, 1, 2, 3
CONDITIONS = {
    REFUSED: "refused with an error",
    WELL: "well-conditioned",
    GROWING: "error growth",
    GRAZING: "grazing",
    BORDER: "border of two outcomes",
}

#: What is checked of each segment: name -> label; all in units of roundoff of the terms; see
#: `damper.verification.stress.backward.residuals`.
CHECKS = {
    "clock": "clock: duration of a segment",
    "motion": "motion of the masses over a segment",
    "contact": "gap and approach speed at an impact",
    "law": "momentum and restitution in an impact",
    "release": "no contact force at a release",
    "inside": "between the walls in flight, compressive contact force in sticking",
    "tail": "time left of a burst, by its formula",
}

#: Unit roundoff of a double.
EPS = 2.0**-52
#: What a difference may be over what roundoff, multiplied by the condition, makes of it: the noise
#: of two runs is no bound.
ALLOWANCE = 30.0
#: Backward error that passes, in units of roundoff: 2e-13. One run in a hundred has over 30; most
#: of them in the primary's velocity at an impact, which the engine finds to a roundoff of the gap
#: over the length of the search's last stretch.
SOUND = 1000.0
