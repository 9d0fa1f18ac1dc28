"""Studies: from a YAML file to slices, cubes and tables.

Nothing is imported here, so that `damper.study.config` loads with pydantic and PyYAML only.
"""
