"""Figures for papers, drawn by matplotlib: imported only where figures are asked for."""
