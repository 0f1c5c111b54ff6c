"""What a person sees of a diagnosis: sentences, a table for a terminal, figures, and one self-contained page."""
