"""Results for a person: tables for a terminal, figures, and self-contained HTML pages."""
