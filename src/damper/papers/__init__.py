"""Statements of the two papers, how each is judged, and how it is scored."""
