"""Lesson 01: constraints."""
