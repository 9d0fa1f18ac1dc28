"""What the observer `laws` has to know of a time-varying free mass: no more than its mass."""

from damper.models import laws
from damper.models.rigid import Rigid
from damper.models.rigid import laws as _rigid  # noqa: F401 - which is shared here
from damper.models.time_varying import TimeVarying

for each in (
    laws.flight_start,
    laws.flight_at,
    laws.contact_force,
    laws.support_stiffness,
    laws.support_speed,
    laws.contact_speed,
):
    each.share(TimeVarying, Rigid)
