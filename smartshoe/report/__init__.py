"""What a person sees: tables for a terminal, figures, and one self-contained HTML page."""
