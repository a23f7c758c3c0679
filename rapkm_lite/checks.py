"""The exercise checker under the name that the lessons import."""

from .lessons.checker import Case, Exercise, Measured, check, examine, exercises, hint
from .lessons.own import draw_own

__all__ = ["Case", "Exercise", "Measured", "check", "draw_own", "examine", "exercises", "hint"]
