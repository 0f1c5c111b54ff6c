"""A trial as a table, as figures, as a page and as files."""
