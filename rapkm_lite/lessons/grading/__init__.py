"""Grading a class: every submission in a process of its own, one row per exercise, a table at the end."""
