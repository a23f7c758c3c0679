"""The exercise checker under the name that the lessons import."""

from .lessons.checker import Exercise, check, examine, exercises

__all__ = ["Exercise", "check", "examine", "exercises"]
