"""Answers that people would give, a table per lesson: verdict, what it is, the answer, a word of the mistake's name."""
