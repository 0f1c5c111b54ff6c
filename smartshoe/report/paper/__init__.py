"""Figures for papers, drawn with matplotlib, which is imported only if figures are asked for."""
