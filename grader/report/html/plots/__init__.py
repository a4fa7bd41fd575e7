"""Plots as SVG, drawn here: no script is needed to see them."""
