"""The control laws as values, and their stability: (12), (16)-(20), (28)-(35)."""
