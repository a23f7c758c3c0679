"""What belongs to the lessons: exercises with their checks."""
