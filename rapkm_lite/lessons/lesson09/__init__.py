"""Lesson 09: what the redundancy is good for: limits, gears and heat."""
