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
NOT_APPLICABLE, PASSED, PASSED_BY_STEPS, FAILED = -1, 0, 1, 2
RELATION_VERDICTS = {
    PASSED: "compared outright",
    PASSED_BY_STEPS: "step by step",
    FAILED: "failed",
    NOT_APPLICABLE: "not applicable",
}

#: What is checked of each segment: name -> label; all in units of roundoff of the terms; see
#: `damper.verification.metamorphic.backward.residuals`.
CHECKS = {
    "motion": "motion of the masses over a segment",
    "contact": "gap and approach speed at an impact",
    "release": "no contact force at a release",
}

#: What a difference may be over what roundoff, multiplied by the condition, makes of it: the noise
#: of two runs is no bound.
ALLOWANCE = 30.0
#: Backward error that passes, in units of roundoff: 2e-13. One run in a hundred has over 30; most
#: of them in the primary's velocity at an impact, which the engine finds to a roundoff of the gap
#: over the length of the search's last stretch.
SOUND = 1000.0
