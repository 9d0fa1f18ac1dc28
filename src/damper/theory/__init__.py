"""Closed forms and limits to lay beside simulations; nothing here runs the event loop."""
