"""What the checks need to know of a time-varying free mass: its mass at a moment, and no more."""

from damper.models.rigid import Rigid
from damper.models.time_varying import TimeVarying
from damper.verification.stress import checks, rigid_checks  # noqa: F401 - they are shared here

for each in (
    checks.flight_start,
    checks.flight_at,
    checks.contact_force,
    checks.support_stiffness,
    checks.support_speed,
    checks.contact_speed,
):
    each.share(TimeVarying, Rigid)
