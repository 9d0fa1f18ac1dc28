"""Tables of a cost study, one file for each kind."""
