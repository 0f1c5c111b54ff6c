"""The report on a diagnosis: sentences, a table for a terminal, figures, and a self-contained page."""
