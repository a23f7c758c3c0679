"""Figures that several lessons share: the style, machine, maps and runs.  ``plotting`` shows them all."""

import logging

# Where fonts are looked for the first time, as in each new browser, the first output of a lesson would be red.
logging.getLogger("matplotlib.font_manager").addFilter(lambda record: "font cache" not in record.getMessage())
