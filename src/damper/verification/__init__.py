"""Studies that check the engine: against other solvers, under stress, and what it costs."""
