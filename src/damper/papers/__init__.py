"""What the two papers state, how it is judged, and the calibration that scores it."""
