"""Benchmarks, run by hand: ``python -m tests.bench`` from the repository root."""
