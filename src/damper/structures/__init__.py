"""Kinds of studies of structures, a folder each."""
