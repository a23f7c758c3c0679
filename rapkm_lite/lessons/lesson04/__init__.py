"""Lesson 04: the antagonism filter and the energy."""
