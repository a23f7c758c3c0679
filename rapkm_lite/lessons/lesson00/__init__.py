"""Lesson 00: the machine in pictures."""
