"""Theory to draw over a figure: a file for each, with its `overlay`."""
