"""Compile the solvers of a comparison into numba's cache by running short scenes."""

import sys
from pathlib import Path

from damper.engine.compiled import COMPILED, compile_at_once
from damper.verification.comparison.scene import read_scene
from damper.verification.comparison.solvers import load

sys.stderr = open(snakemake.log[0], "w", buffering=1)

POINT = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.8,
    "clearance": 0.25,
    "restitution": 0.3,
}
#: A short scene of each model.
SCENES = {
    "rigid": read_scene(POINT, 5.0),
    "compliant": read_scene(POINT | {"contact_stiffness_ratio": 1e4}, 5.0),
}
#: A coarse value of each setting.
SETTINGS = {
    "accuracy": 1e-6,
    "steps_per_period": 100,
    "tolerance": 1e-3,
    "contact_stiffness": 1e4,
}

compile_at_once()
for name in snakemake.wildcards.solvers.split("+"):
    solver = load(name)
    for model in set(solver.models).intersection(snakemake.wildcards.models.split("+")):
        scene = SCENES[model]
        for more in ({}, {"times": [scene.until], "balance": True}):
            solver.solve(scene, SETTINGS[solver.setting], max_evaluations=10_000, **more)
how = "compiled by numba" if COMPILED else "plain Python: numba is not installed"
Path(snakemake.output[0]).write_text(f"{how}\n")
