"""Lesson 11: laws of all kinds on one machine, made equally fast."""
