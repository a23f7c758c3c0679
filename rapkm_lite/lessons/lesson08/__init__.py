"""Lesson 08: offsets that the machine finds by itself, from encoders that contradict each other."""
