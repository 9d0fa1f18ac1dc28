"""What people read of a run: the page of results, and the tables in documents."""
