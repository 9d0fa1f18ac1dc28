"""Statements of the two papers, their verdicts, and the calibration that scores them."""
