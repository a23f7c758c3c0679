"""Lesson 03: antagonism at rest."""
