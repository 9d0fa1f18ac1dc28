"""Free masses in boxes of a structure: responses at its points, and its energy by mode."""
