"""A shoe seen while it is worn: one stream into journal, table, outlet and page, and the server that shows it."""
