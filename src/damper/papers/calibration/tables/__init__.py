"""Tables of a calibration, one file for each kind."""
