"""Functions that read, write and change NamedTuples."""

import numpy as np
import pytest

from damper.engine.compiled import plain
from damper.engine.oscillator import Motion
from damper.engine.tuples import changed, made_of, reader, writer


@plain
def test_each_field_keeps_its_place() -> None:
    old = Motion(1.0, 2.0, 3.0, 4.0, 5.0)
    assert changed(Motion, "v", "phase")(old, -2.0, -5.0) == old._replace(v=-2.0, phase=-5.0)
    assert made_of(Motion, "j", "x")(7.0, 8.0) == Motion(8.0, 0.0, 0.0, 7.0, 0.0)
    table = np.zeros((2, 6))
    writer(Motion)(table, 1, old)
    writer(Motion, of_row=True)(table[0], old)
    assert table.tolist() == [[1.0, 2.0, 3.0, 4.0, 5.0, 0.0]] * 2
    assert reader(Motion)(table, 1) == reader(Motion, of_row=True)(table[0]) == old


def test_unknown_fields_are_refused() -> None:
    with pytest.raises(TypeError, match="Motion has no field u"):
        changed(Motion, "x", "u")
