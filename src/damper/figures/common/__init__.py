"""What all kinds of figures share."""
