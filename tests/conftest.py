"""Settings of all tests: the same examples on every machine, and no timing of single ones."""

from hypothesis import settings

settings.register_profile("damper", deadline=None, derandomize=True)
settings.load_profile("damper")
