"""Figures that several lessons share: the style, machine, maps and runs.  ``plotting`` shows them all."""
