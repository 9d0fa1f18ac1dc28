"""Matrices of a shear building of five storeys: floors of 20 t, and 2 % damping of modes 1 and 2.

`python config/structures/make_building.py` writes building_mass.mtx, building_damping.mtx and
building_stiffness.mtx beside it: Matrix Market, in kg, N s/m and N/m.
"""

from pathlib import Path

import numpy as np

FLOORS, FLOOR, FIRST = 5, 2e4, 1.5
"""Number of floors, mass of each in kg, and lowest frequency in Hz."""
RATIO = 0.02


def matrices() -> dict[str, np.ndarray]:
    """Mass, damping and stiffness; equal storeys, damping by Rayleigh."""
    shape = 2.0 * np.eye(FLOORS) - np.eye(FLOORS, k=1) - np.eye(FLOORS, k=-1)
    shape[-1, -1] = 1.0
    squares = np.linalg.eigvalsh(shape)
    storey = FLOOR * (2.0 * np.pi * FIRST) ** 2 / squares[0]
    storey = float(f"{storey:.3g}")
    first, second = np.sqrt(storey / FLOOR * squares[:2])
    mass, stiffness = FLOOR * np.eye(FLOORS), storey * shape
    of_mass = float(f"{2.0 * RATIO * first * second / (first + second):.3g}")
    of_stiffness = float(f"{2.0 * RATIO / (first + second):.3g}")
    return {
        "mass": mass,
        "damping": of_mass * mass + of_stiffness * stiffness,
        "stiffness": stiffness,
    }


def text(matrix: np.ndarray) -> str:
    """A symmetric matrix as Matrix Market has it: the lower triangle."""
    entries = [
        f"{i + 1} {j + 1} {matrix[i, j]:.10g}"
        for j in range(FLOORS)
        for i in range(j, FLOORS)
        if matrix[i, j]
    ]
    head = "%%MatrixMarket matrix coordinate real symmetric"
    return "\n".join([head, f"{FLOORS} {FLOORS} {len(entries)}", *entries]) + "\n"


if __name__ == "__main__":
    for name, matrix in matrices().items():
        Path(__file__).with_name(f"building_{name}.mtx").write_text(text(matrix), "utf-8")
