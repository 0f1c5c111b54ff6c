"""The report on a trial: a table on a terminal, charts, a page and files."""
