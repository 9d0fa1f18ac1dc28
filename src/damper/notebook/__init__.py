"""`damper.run` and the accessor ``cube.damper``, for notebooks and shells.

``import damper.notebook`` gives every xarray.Dataset that a study made an accessor ``damper``.
"""

from damper.notebook import accessor as accessor
