"""Lesson 12: the theory on a machine that is not ours, and a machine of your own."""
