"""Lesson 06: the energy landscape."""
