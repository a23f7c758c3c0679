"""Sampled closed loops: single runs, studies of many, their energies; `compiled` is the door to the engine."""
