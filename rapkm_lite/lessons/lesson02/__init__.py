"""Lesson 02: actuation and singularities."""
