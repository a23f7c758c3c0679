"""Lesson 05: singularity-robust control."""
