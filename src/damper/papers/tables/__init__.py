"""Tables of the papers' statements, one file for each kind."""
