"""Tables of a comparison of solvers, one file for each kind."""
