"""Figures that several lessons share: the style, machine, maps and runs.  ``plotting`` shows them all."""

import logging

# Matplotlib's first search for fonts, as in each new browser, would put red text above the first output of a lesson.
logging.getLogger("matplotlib.font_manager").addFilter(lambda record: "font cache" not in record.getMessage())
