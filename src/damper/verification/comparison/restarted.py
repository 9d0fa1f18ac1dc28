"""scipy's solve_ivp with terminal events, restarted at each of them: how a careful user does it.

Rigid walls: Newton's law at each impact, and sticking made by hand, because a complete burst has
infinitely many impacts. Walls that give: one set of equations after the other. What all of these
share is in `damper.verification.comparison.integration`.
"""

import math
import warnings
from collections.abc import Sequence

from damper.models.compliant.restitution import contact_damping
from damper.models.walls import slack
from damper.verification.comparison.integration import (
    LONGEST_STEP,
    EventCallable,
    Integration,
    Mode,
    falling_depth,
    falling_gap,
)
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import Solution

#: What a free mass and a compliant wall are doing; released: the wall springs back behind the mass.
FLIGHT, CONTACT, RELEASED = "flight", "contact", "released"


def solve_restarted(
    method: str,
    scene: Scene,
    tolerance: float,
    times: Sequence[float],
    balance: bool,
    max_evaluations: int,
    *,
    sticking: bool = True,
    lasting: bool = False,
) -> Solution:
    """Run a scene.

    Parameters
    ----------
    method : str
        Of `scipy.integrate.solve_ivp`.
    scene : Scene
    tolerance : float
        rtol; atol is this times min(1, clearance).
    times : sequence of float
        Where states are wanted, ascending.
    balance : bool
        Whether the energy residual is wanted.
    max_evaluations : int
        Of the right-hand side.

    Other Parameters
    ----------------
    sticking : bool, default True
        Rigid walls: whether a burst's end becomes sticking. Without it a complete burst stalls.
    lasting : bool, default False
        Walls that give: whether contacts that last are noted as sticking.
    """
    run = Integration(scene, method, tolerance, times, balance, max_evaluations)
    with warnings.catch_warnings():
        # LSODA warns where it gives up, solve_ivp where it raises rtol; both are outcomes here.
        warnings.simplefilter("ignore")
        if scene.model == "compliant":
            return run.outcome(lambda run: _follow_compliant(run, lasting))
        return run.outcome(lambda run: _follow_rigid(run, tolerance, sticking))


def _start(run: Integration) -> tuple[float, list[float]]:
    """Wall that is nearer, and the state relative to it; a gap of roundoff is none.

    From the centre it is the one that the free mass will near, so that a mirrored scene is
    mirrored in every step.
    """
    s = run.scene.state
    a, j = _derivatives(run, s.x, s.v)
    side = 1.0 if (s.y - s.x or s.u - s.v or -(a + j)) >= 0.0 else -1.0
    gap = run.parameters.clearance - side * (s.y - s.x)
    if abs(gap) <= slack(run.parameters.clearance, s.x, s.y):
        gap = 0.0
    return side, [s.x, s.v, gap, -side * (s.u - s.v)]


def _fly(run: Integration, side: float, z: list[float]) -> tuple[float, list[float], bool]:
    """Fly to the next impact, and measure from the wall that it is on."""
    across = 2.0 * run.parameters.clearance
    events = (falling_gap(z), lambda tau, z: across - float(z[2]))
    gap_size = rate_size = math.inf
    force = run.contact_force(side, z)
    if z[2] == 0.0 and z[3] > 0.0:
        rate_size = z[3]
        if force > 0.0:
            gap_size = 0.5 * z[3] * z[3] / force
    flight = Mode(side, events, gap_size=gap_size, rate_size=rate_size)
    z, hit = run.advance(flight, z)
    if hit == 1:
        side, z = -side, [z[0], z[1], 0.0, -z[3]]
    return side, z, hit >= 0


def _force_on(run: Integration, side: float) -> EventCallable:
    return lambda tau, z: run.contact_force(side, z, tau)


def _sticks(run: Integration, side: float, z: Sequence[float]) -> bool:
    """Whether masses in contact without relative velocity stick."""
    a, j = _derivatives(run, z[0], z[1])
    return -side * (a or j) > 0.0


def _derivatives(run: Integration, x: float, v: float) -> tuple[float, float]:
    """Second derivative of the primary in flight, and what decides where it vanishes: the third."""
    p = run.parameters
    a = -run.contact_force(1.0, (x, v))
    angle = p.frequency_ratio * run.reached + p.phase
    return a, p.frequency_ratio * math.cos(angle) - 2.0 * p.damping_ratio * a - v


def _follow_rigid(run: Integration, tolerance: float, sticking: bool) -> tuple[float, list[float]]:
    p = run.parameters
    r = p.restitution
    share = p.mass_ratio / (1.0 + p.mass_ratio)

    def merged(side: float, z: list[float]) -> list[float]:
        run.lost += 0.5 * share * z[3] * z[3]
        return [z[0], z[1] - side * share * z[3], 0.0, 0.0]

    side, z = _start(run)
    if p.clearance == 0.0:
        z, _ = run.advance(Mode(0.0, (), together=True), merged(side, z))
        return 0.0, z
    begin = run.reached
    touches = z[2] == 0.0 and z[3] < 0.0
    stuck = sticking and z[2] == 0.0 and z[3] == 0.0 and _sticks(run, side, z)
    while True:
        if touches:
            approach = max(-z[3], 0.0)
            run.impact(begin, side, approach)
            run.lost += 0.5 * share * (1.0 - r * r) * approach * approach
            z = [z[0], z[1] + side * share * (1.0 + r) * approach, 0.0, r * approach]
            force = run.contact_force(side, z)
            # What is left of the burst to first order, 2 w / (a (1 - r)), is within tolerance.
            stuck = sticking and force > 0.0 and 2.0 * z[3] <= tolerance * force * (1.0 - r)
        if stuck:
            run.stick_times.append(run.reached)
            z = merged(side, z)
        begin = run.reached
        if begin >= run.scene.until:
            return side, z
        if not stuck:
            side, z, touches = _fly(run, side, z)
            continue
        z, ended = run.advance(Mode(side, (_force_on(run, side),), together=True), z)
        if ended >= 0:
            run.release_times.append(run.reached)
        stuck = touches = False


def _follow_compliant(run: Integration, lasting: bool) -> tuple[float, list[float]]:
    p = run.parameters
    k = p.contact_stiffness_ratio
    share = p.mass_ratio / (1.0 + p.mass_ratio)
    frequency = math.sqrt(k / share)
    c = 2.0 * contact_damping(p.restitution, bool(p.contact_tension)) * share * frequency
    # Without damping the force is the depth.
    held = bool(p.contact_tension) or c == 0.0

    def force(tau: float, z: Sequence[float]) -> float:
        return -(k * float(z[2]) + c * float(z[3]))

    side, z = _start(run)
    kind = FLIGHT
    if z[2] < 0.0:
        kind = CONTACT if held or force(0.0, z) > 0.0 else RELEASED
    elif z[2] == 0.0 and z[3] == 0.0 and _sticks(run, side, z):
        kind = CONTACT
    touches = z[2] == 0.0 and z[3] < 0.0
    begin = began = run.reached
    while True:
        if touches:
            run.impact(begin, side, max(-z[3], 0.0))
            kind = CONTACT
            touches = False
            began = run.reached
        begin = run.reached
        if begin >= run.scene.until:
            return side, z
        if kind == FLIGHT:
            side, z, touches = _fly(run, side, z)
            continue
        if kind == CONTACT:
            rate_size = abs(z[3]) + abs(run.contact_force(side, z)) / frequency
            contact = Mode(
                side,
                (falling_depth(z) if held else force,),
                stiffness=k,
                damping=c,
                springs=k,
                gap_size=rate_size / frequency or math.inf,
                rate_size=rate_size or math.inf,
            )
            z, hit = run.advance(contact, z)
            lasts = lasting and run.reached - began >= 2.0 * math.pi / frequency
            if lasts:
                run.stick_times.append(began)
            if hit < 0:
                return side, z
            if lasts:
                run.release_times.append(run.reached)
            kind = FLIGHT if held or z[2] >= 0.0 else RELEASED
        else:
            # Until the gap reopens, or the wall springs back faster than the mass leaves it.
            released = Mode(
                side,
                (lambda tau, z: -float(z[2]), lambda tau, z: -force(tau, z)),
                springs=k,
                gap_size=abs(z[2]),
                rate_size=abs(z[3]) or math.inf,
                max_step=min(1.0 / frequency, LONGEST_STEP),
            )
            z, hit = run.advance(released, z)
            if hit < 0:
                return side, z
            kind = FLIGHT
            if hit == 1:
                kind = CONTACT
                began = run.reached
        if kind == FLIGHT:
            z = [z[0], z[1], 0.0, max(z[3], 0.0)]
            if z[3] == 0.0 and _sticks(run, side, z):
                kind = CONTACT
                began = run.reached
