"""Lesson 07: drives that do not wait for each other (fig. 3)."""
