"""Unknown quantities of a damper from what was recorded of it: `damper.identify`."""
