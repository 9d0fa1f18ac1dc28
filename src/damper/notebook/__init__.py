"""One run and one cube at hand, for a notebook or a shell.

``import damper.notebook`` gives every xarray.Dataset that a study made an accessor ``damper``.
"""

from damper.notebook import accessor as accessor
