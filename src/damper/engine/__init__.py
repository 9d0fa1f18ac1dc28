"""Exact event-driven simulation of one run; knows no model of the damper."""
