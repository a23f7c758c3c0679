"""Lesson 10: wrong geometry, coarse encoders, weak and broken drives."""
