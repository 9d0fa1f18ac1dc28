"""From the parameters of a structure to the constants of a run."""

from typing import Any

import numpy as np

from damper.engine.compiled import plain
from damper.engine.forcing import rate_of
from damper.engine.forcing.weighed import WeighedForce
from damper.models.forces import drive_of, oscillator_under
from damper.models.friction import LEAST_FRICTION, Frictions, NoFriction
from damper.models.structure.constants import HEAD_WIDTH, WEIGHTS, OnStructure, fill_table
from damper.models.structure.linear import eigenvectors, product, root_inverse
from damper.models.structure.system import make_system, shape_of_tables
from damper.models.wall_laws import wall_laws


@plain
def prepare(
    parameters: Any, law: Any, accuracy: float, along_friction: bool = False
) -> OnStructure:
    """Constants of one run, from the scaled parameters of a structure.

    Along friction slides stop also where there is none yet.

    Raises
    ------
    ValueError
        For walls without play, which no structure knows.
    """
    p, given = parameters, parameters.structure
    _refuse(p.each)
    drive = drive_of(p)
    shapes, stiffness = _modes_of(given.mass, given.stiffness)
    base = np.zeros(len(stiffness)) if given.base is None else given.base
    force = given.mass @ base if drive.share else given.force
    push = shapes.T @ force * drive.amplitude
    # A mode's sign is free: the force pushes each of them forwards.
    shapes = shapes * np.where(push < 0.0, -1.0, 1.0)
    boxes = np.array([given.boxes[one.box] @ shapes for one in p.each])
    carries = [drive.share * drive.amplitude * given.base_shares[one.box] for one in p.each]
    walls, of_walls = wall_laws(p.each)
    own = [
        (
            *(one.mass, one.clearance, one.gravity, one.tie_stiffness, one.tie_damping, carried),
            max(one.friction, LEAST_FRICTION if along_friction else 0.0),
        )
        for one, carried in zip(p.each, carries, strict=True)
    ]
    masses = np.column_stack([own, of_walls])
    forcing = drive.forcing
    rubs = bool(masses[:, 6].any())
    shape = WeighedForce(forcing, 1.0, 0.0) if masses[:, 2].any() or rubs else forcing
    damping = _symmetric(shapes.T @ given.damping @ shapes)
    size, count = len(push), len(masses)
    table = np.zeros((WEIGHTS + count + 3 * size, max(size, count, HEAD_WIDTH)))
    blocks = (damping, shapes, np.ascontiguousarray(shapes.T @ given.mass))
    fill_table(table, stiffness, np.abs(push), np.zeros(size), boxes, blocks)
    model = OnStructure(
        float(masses[:, 0].sum()),
        float(masses[:, 1].max()),
        walls,
        p.cycle,
        accuracy / max(1.0, rate_of(forcing)),
        oscillator_under(
            shape, 0.5 * float(damping[0, 0]), float(stiffness[0]), abs(float(push[0])), 0.0
        ),
        shape,
        table,
        masses,
        count,
        table,
        Frictions() if rubs else NoFriction(),
    )
    flying = np.zeros(shape_of_tables(model)[:2])
    make_system(model, np.zeros(count), flying)
    return model._replace(flying=flying)


def _refuse(each: Any) -> None:
    for k, one in enumerate(each):
        if not one.clearance > 0.0:
            raise ValueError(
                f"masses[{k}]: a mass without play belongs to the structure: add it to mass"
            )


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(0.5 * (matrix + matrix.T))


def _modes_of(mass: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shapes of modal mass 1, in columns, and squares of the frequencies, which increase."""
    if np.array_equal(mass, np.diag(np.diag(mass))):
        root = np.diag(1.0 / np.sqrt(np.diag(mass)))
    else:
        root = root_inverse(mass)
    squares, vectors = eigenvectors(_symmetric(root @ stiffness @ root.T))
    order = np.argsort(squares, kind="stable")
    shapes = np.ascontiguousarray(product(root.T, vectors)[:, order])
    return shapes, np.maximum(squares[order], 0.0)
